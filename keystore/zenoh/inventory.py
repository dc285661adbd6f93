"""What the router's file lets each enclave do, and in what the files of two keystores differ. Reads only."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from keystore.add_ons import FileDifference
from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.formats.permissions_names import add_dds_topics, ros_rules
from keystore.formats.policy import Operation, Rule
from keystore.zenoh.comparison import (
    EVERYBODY,
    MessagePermission,
    ZenohConfiguration,
    differences,
    read_configuration,
)
from keystore.zenoh.meaning import meaning

_DECIDES = {
    "put": Operation.PUBLISH,
    "declare_subscriber": Operation.SUBSCRIBE,
    "query": Operation.REQUEST,
    "declare_queryable": Operation.REPLY,
}
"""Of an enclave's own messages those without which it can do nothing."""


def enforced(view: KeystoreView) -> dict[str, frozenset[Rule]]:
    """Return what the router's file lets each enclave do that it has rules for.

    Raises InvalidInputError for a file that cannot be read.
    """
    read = _read(view, layout.ZENOH_ROUTER)
    everybody = read.admitted.get(EVERYBODY, frozenset())
    return {
        read.enclaves[name]: _rules(permissions | everybody)
        for name, permissions in read.admitted.items()
        if name != EVERYBODY
    }


def compare(before: KeystoreView, after: KeystoreView) -> list[FileDifference]:
    """Compare the router's file, and those of the enclaves that are on Zenoh in both keystores."""
    roots = (before.root, after.root)
    both = sorted({*before.zenoh_enclaves()} & {*after.zenoh_enclaves()})
    return [
        FileDifference(file, each.more, f"{each.who} {each.text}".strip())
        for file in (layout.ZENOH_ROUTER, *map(layout.zenoh_session, both))
        for each in differences(_read(before, file, roots), _read(after, file, roots))
    ]


def _read(view: KeystoreView, file: str, roots: Iterable[Path] = ()) -> ZenohConfiguration:
    """Read a file. ``roots``: of two keystores that are compared; where each lies does not count, nor that one is a
    copy.
    """
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
