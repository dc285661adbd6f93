"""What a keystore's Zenoh router is told to let each enclave do, in ROS terms: ``granted`` for the other middleware.

As the router reads its file, whether or not that follows from what is signed (``verify`` compares the two). Reads only.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from keystore.disk import layout, safe_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView, complete_keystore
from keystore.disk.zenoh_files import session_file, zenoh_enclaves
from keystore.formats.permissions_names import add_dds_topics, ros_rules
from keystore.formats.policy import Operation, Rule
from keystore.formats.zenoh.comparison import (
    EVERYBODY,
    MessagePermission,
    ZenohConfiguration,
    ZenohDifference,
    differences,
    read_configuration,
)
from keystore.formats.zenoh.meaning import meaning

_DECIDES = {
    "put": Operation.PUBLISH,
    "declare_subscriber": Operation.SUBSCRIBE,
    "query": Operation.REQUEST,
    "declare_queryable": Operation.REPLY,
}
"""Of an enclave's own messages those without which it can do nothing."""


def enforced(keystore: Path | str) -> dict[str, frozenset[Rule]]:
    """Enclave -> what the router's file lets it do, each enclave that has rules; empty without such a file.

    Raises NotAKeystoreError, and InvalidInputError for a file that cannot be read.
    """
    view = complete_keystore(keystore)
    read = _read(view, layout.ZENOH_ROUTER)
    everybody = read.admitted.get(EVERYBODY, frozenset())
    return {
        read.enclaves[name]: _rules(permissions | everybody)
        for name, permissions in read.admitted.items()
        if name != EVERYBODY
    }


def files_changed(before: Path | str, after: Path | str) -> list[tuple[str, ZenohDifference]]:
    """File -> difference, of the router and of the enclaves that are on Zenoh in both keystores."""
    one, other = (KeystoreView(resolve_root(keystore)) for keystore in (before, after))
    roots = (one.root, other.root)
    both = sorted({*zenoh_enclaves(one)} & {*zenoh_enclaves(other)})
    return [
        (file, each)
        for file in (layout.ZENOH_ROUTER, *map(session_file, both))
        for each in differences(_read(one, file, roots), _read(other, file, roots))
    ]


def _read(view: KeystoreView, file: str, roots: Iterable[Path] = ()) -> ZenohConfiguration:
    """``roots``: of two keystores that are compared; where each lies does not count, nor that one is a copy."""
    text = safe_files.read_if_there(view.root, file) or b"{}"
    for root in roots:
        text = text.replace(f'"{root}/'.encode(), b'"KEYSTORE/')
    return read_configuration(text, file)


def _rules(permissions: Iterable[MessagePermission]) -> frozenset[Rule]:
    publish: set[str] = set()
    subscribe: set[str] = set()
    for one in permissions:
        about = meaning(one.flow, one.message, one.key)
        if about and one.allowed and one.flow == "ingress" and one.message in _DECIDES and "@" not in one.key:
            add_dds_topics(_DECIDES[one.message], about.name, publish, subscribe)
    return frozenset(ros_rules(publish, subscribe)[0])
