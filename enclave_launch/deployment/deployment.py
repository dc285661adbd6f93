"""The input of the writers for all engines: the processes of one host and the files of their enclaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from enclave_launch.deployment.material import EnclaveMaterial
from enclave_launch.deployment.processes import DeployedProcess
from enclave_launch.deployment.semantics import Unexpressed
from keystore.disk.units import MARK


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
