"""The files of enclaves as a keystore or an imported bundle has them. Reads only."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from enclave_common.words import some_of
from enclave_launch.errors import ProvisionError, keystore_errors
from keystore.disk import layout, safe_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.steps.expiry import status

_NAMED = 5
PUBLIC_FILES = tuple(name for name in layout.RUNTIME_FILES if name != layout.KEY)


class EnclaveMaterial(NamedTuple):
    """Public files by name, with the CRL if there is one, and the key, unless it never left its host."""

    enclave: str
    public: Mapping[str, bytes]
    key: bytes | None

    def __repr__(self) -> str:
        return f"EnclaveMaterial({self.enclave!r})"


def read_material(keystore: str, enclaves: Iterable[str]) -> dict[str, EnclaveMaterial]:
    """Return enclave -> its files; raises ProvisionError for one that is not there, complete and valid."""
    wanted = sorted(set(enclaves))
    root = resolve_root(keystore)
    view = KeystoreView(root)
    with keystore_errors():
        view.require_complete()
        found = {name: _enclave(view, name) for name in wanted}
        report = status(root)
    first = next(one for one in report.expiries if one.enclave is None or one.enclave in found)
    if not first.is_valid(report.now):
        raise ProvisionError(
            f"{first.subject} in {keystore} is not valid now; renew it first: secure-keystore renew {keystore}"
        )
    return found


def _enclave(view: KeystoreView, enclave: str) -> EnclaveMaterial:
    directory = layout.enclave_directory(enclave)
    names = (*PUBLIC_FILES, *([layout.ENCLAVE_CRL] if view.has_crl else []))
    public = {}
    known = view.enclaves()
    if enclave not in known:
        raise ProvisionError(
            f"the keystore {view.root} has no enclave {enclave}; it has {some_of(known, _NAMED) or 'none'}; provision "
            "it first (secure-launch --secure, secure-keystore apply-policy), or give the --enclave-scope that it was "
            "provisioned with"
        )
    for name in names:
        content = safe_files.read_if_there(view.root, f"{directory}/{name}")
        if content is None:
            raise ProvisionError(
                f"enclave {enclave} is not complete in {view.root} ({name} is missing); provision it first: "
                "secure-launch --secure, or secure-keystore apply-policy"
            )
        public[name] = content
    has_key = safe_files.read_if_there(view.root, f"{directory}/{layout.KEY}") is not None
    key = safe_files.read_private(view.root, f"{directory}/{layout.KEY}") if has_key else None
    return EnclaveMaterial(enclave, public, key)
