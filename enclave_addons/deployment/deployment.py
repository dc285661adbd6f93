"""The input of the writers for all engines: the processes of one host and the files of their enclaves, read from a
keystore or an imported bundle.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from enclave_addons.deployment.processes import DeployedProcess
from enclave_addons.deployment.semantics import Unexpressed
from enclave_addons.deployment.units import MARK
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


class Deployment(NamedTuple):
    """The processes of one host and what they use.

    Attributes:
        name: A DNS label, of the target, project or application.
        source: What was exported, for the reader.
        host: None if there is only one.
        processes: In launch order.
        order: The names of ``processes`` in the order of a rolling restart.
        members: Domain -> names of all its secured processes, on any host, sorted.
        material: Enclave -> its files.
        ends_launch: Processes whose exit ends the whole launch.
    """

    name: str
    source: str
    host: str | None
    processes: tuple[DeployedProcess, ...]
    order: tuple[str, ...]
    members: Mapping[int, tuple[str, ...]]
    material: Mapping[str, EnclaveMaterial]
    ends_launch: frozenset[str]
    lost: tuple[Unexpressed, ...] = ()
    notes: tuple[str, ...] = ()

    def enclave_of(self, process: DeployedProcess) -> EnclaveMaterial | None:
        """Return the material of the process's enclave, None if it has none."""
        return self.material[process.enclave] if process.enclave is not None else None

    def parameter_files(self, process: DeployedProcess) -> dict[str, File]:
        """Return file name -> file."""
        texts = process.parameter_texts().items()
        return {f"parameters/{name}": File(self.mark() + text) for name, text in texts}

    def mark(self) -> str:
        """Return the comment line of every generated file. It is the same whatever else the launch holds."""
        return f"# {MARK} from {one_line(self.source)}; generate it again, changes here are lost\n"

    def header(self) -> str:
        """Return the mark, and what the generated files do not do: for the one file that is about all processes."""
        lines = [f"not expressed here: {one}" for one in self.lost]
        lines += [f"differs from launch: {one}" for one in self.notes]
        return self.mark() + "".join(f"# {one_line(line)}\n" for line in lines)


def one_line(text: str) -> str:
    """Return ``text`` for a comment or description: names from outside end no line."""
    return "".join(char if char.isprintable() else "?" for char in text)


class File(NamedTuple):
    """A generated file; ``mode`` is 0600 if it holds keys."""

    text: str
    mode: int = 0o644
