"""What the writers of all engines take: the processes of one host, their enclaves' files, what to say of both. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from enclave_launch.deployment.material import EnclaveMaterial, Material
from enclave_launch.deployment.processes import DeployedProcess
from enclave_launch.deployment.semantics import Unexpressed
from keystore.disk import layout
from keystore.formats.validity import iso

MARK = "Written by secure-plan export"
"""In the first lines of every generated file: such files are replaced, others never."""


class Deployment(NamedTuple):
    """``name``: a DNS label, of the target, project or namespace. ``source``: what was exported, for the reader.
    ``processes`` in launch order, ``order`` their names in the order of a rolling restart. ``host``: None for the
    only one."""

    name: str
    source: str
    host: str | None
    processes: tuple[DeployedProcess, ...]
    order: tuple[str, ...]
    material: Material
    ends_launch: frozenset[str]
    lost: tuple[Unexpressed, ...] = ()
    notes: tuple[str, ...] = ()

    def enclave_of(self, process: DeployedProcess) -> EnclaveMaterial | None:
        return self.material.enclaves[process.enclave] if process.enclave is not None else None

    def parameter_files(self, process: DeployedProcess) -> dict[str, File]:
        """File name -> file."""
        texts = process.parameter_texts().items()
        return {f"parameters/{name}": File(self.header() + text) for name, text in texts}

    def header(self) -> str:
        """Comment lines that say where the file comes from, when its enclaves end, and what it does not do."""
        return "".join(f"# {one_line(line)}\n" for line in self._header())

    def _header(self) -> Iterator[str]:
        yield f"{MARK} from {self.source}; generate it again, changes here are lost"
        yield f"ends: {iso(self.material.ends)} ({self.material.what}); processes read these files at their start only"
        yield from (f"not expressed here: {one}" for one in self.lost)
        yield from (f"otherwise than launch: {one}" for one in self.notes)


def one_line(text: str) -> str:
    """For comments and descriptions: names from outside end no line."""
    return "".join(char if char.isprintable() else "?" for char in text)


class File(NamedTuple):
    """A generated file. ``mode``: 0600 where it holds keys."""

    text: str
    mode: int = 0o644


def source_of(material: EnclaveMaterial, name: str) -> str:
    """Where the enclave's file lies in a keystore, behind the links."""
    if name in (layout.KEY, layout.CERT, layout.PERMISSIONS):
        return f"{layout.enclave_directory(material.enclave)}/{name}"
    return layout.link_source(name)


def runtime_names(material: EnclaveMaterial) -> tuple[str, ...]:
    """The files that a process of the enclave reads, in the order of rcl's list; the CRL where there is one."""
    more = (layout.ENCLAVE_CRL,) if layout.ENCLAVE_CRL in material.public else ()
    return (*layout.RUNTIME_FILES, *more)
