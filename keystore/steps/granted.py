"""What the signed permissions of a keystore grant, in ROS terms. Reads only; proves no signature (see ``verify``)."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout, safe_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.formats.permissions_read import parse_permissions
from keystore.formats.policy import Qualifier, Rule
from keystore.signing import smime


class Granted(NamedTuple):
    """``allowed`` and ``denied``: rules with final names, sorted; ``topics``: DDS topics that no ROS rule explains."""

    allowed: tuple[Rule, ...]
    denied: tuple[Rule, ...]
    topics: tuple[str, ...]


def granted(keystore: Path | str) -> dict[str, Granted]:
    """Enclave -> what its permissions say; an enclave without permissions is left out.

    Raises NotAKeystoreError, DamagedKeystoreError and InvalidInputError for what cannot be read.
    """
    view = KeystoreView(resolve_root(keystore))
    view.require_complete()
    found = {}
    for enclave in view.enclaves():
        place = f"{layout.enclave_directory(enclave)}/{layout.PERMISSIONS}"
        signed = safe_files.read_if_there(view.root, place)
        if signed is not None:
            found[enclave] = _granted(smime.read(signed, place).document, place)
    return found


def _granted(document: bytes, place: str) -> Granted:
    rules: set[Rule] = set()
    topics: set[str] = set()
    for grant in parse_permissions(document, place):
        explained, rest = grant.ros_rules
        rules.update(explained)
        topics.update(rest)
    allowed = sorted(rule for rule in rules if rule.qualifier is Qualifier.ALLOW)
    return Granted(tuple(allowed), tuple(sorted(rules.difference(allowed))), tuple(sorted(topics)))
