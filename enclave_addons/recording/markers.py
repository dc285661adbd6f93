"""``--learn-parameters``: a second run of the same launch with marker values, which decides what matching cannot.

Every parameter and argument that may be the source of a recorded name gets a value that nothing else has; names that
follow come from it, those that do not are fixed. An integer gets one that is slightly larger, as it may be a number of
things. Reads the records of the folder; changes command lines.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_addons.recording.record.assembly import read_record
from enclave_addons.recording.record.learning import observation_of
from enclave_addons.recording.record.origins import MARKER, possible_sources
from enclave_addons.recording.record.requested import all_requested
from enclave_launch.policy.program_inputs import own_words
from enclave_launch.process import ResolvedProcess


class Questions(NamedTuple):
    """By program (package, executable): the inputs that some recorded name may come from, with a recorded value."""

    inputs: Mapping[tuple[str, str], Mapping[str, object]]

    def __bool__(self) -> bool:
        return any(self.inputs.values())

    @property
    def shown(self) -> str:
        names = {f"{program}: {name}" for (_, program), found in self.inputs.items() for name in found}
        return ", ".join(sorted(names))


class Marked(NamedTuple):
    """A command line with markers, and the values that the process now has."""

    cmd: tuple[str, ...]
    parameters: dict[str, object]
    arguments: tuple[str, ...]


def questions(folder: Path) -> Questions:
    """Return what the records leave to decide; a component's parameters do not come with a command line."""
    found: dict[tuple[str, str], dict[str, object]] = {}
    for path in sorted(folder.glob("records/*.record")):
        for node in all_requested(read_record(path.read_bytes()).attributed()):
            if not node.start.executable:
                continue
            seen = observation_of(node)
            sources = {source for name in seen.names for source in possible_sources(name, seen)}
            values = {name: seen.values[name] for source in sources for name in source.parameters}
            found.setdefault((node.start.package, node.start.executable), {}).update(values)
    return Questions(found)


class MarkerRun:
    """Hands out markers, each once."""

    def __init__(self, open_questions: Questions) -> None:
        self._questions = open_questions
        self._count = 0

    def mark(self, process: ResolvedProcess, cmd: tuple[str, ...]) -> Marked:
        """Return ``cmd`` with a marker for each value in question; later ROS arguments win over earlier ones."""
        wanted = self._questions.inputs.get(
            (process.package or "", process.executable.rpartition("/")[2]), {}
        )
        given = {
            name: process.parameters.get(name, value)
            for name, value in sorted(wanted.items())
            if name[0] not in "<-"
        }
        parameters = {name: self._marker(value) for name, value in given.items()}
        words = own_words(process)
        arguments = list(self._words(words, wanted))
        marked = _with_words(cmd, words, arguments)
        if marked == cmd:
            arguments = list(words)
        if parameters:
            marked += ("--ros-args",)
            for name, value in parameters.items():
                marked += ("-p", f"{name}:={_yaml(value)}")
        return Marked(marked, parameters, tuple(arguments))

    def _words(self, words: Sequence[str], wanted: Container[str]) -> Iterator[str]:
        before = ""
        for place, word in enumerate(words, 1):
            option, equals, value = word.partition("=")
            if equals and option in wanted:
                yield f"{option}={self._marked_word(value)}"
            else:
                yield self._marked_word(word) if f"<{place}>" in wanted or before in wanted else word
            before = word

    def _marked_word(self, word: str) -> str:
        return str(self._marker(int(word) if word.isdecimal() else word))

    def _marker(self, value: object) -> object:
        if isinstance(value, tuple):
            return tuple(self._marker(each) for each in value)
        self._count += 1
        return value + self._count if isinstance(value, int) else f"{MARKER}{self._count}"


def _yaml(value: object) -> str:
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)


def _with_words(cmd: tuple[str, ...], words: Sequence[str], others: Sequence[str]) -> tuple[str, ...]:
    """Return ``cmd`` with ``words`` exchanged; launch puts a program's own arguments before ``--ros-args``."""
    end = cmd.index("--ros-args") if "--ros-args" in cmd else len(cmd)
    start = end - len(words)
    if start < 1 or list(cmd[start:end]) != list(words):
        return cmd
    return (*cmd[:start], *others, *cmd[end:])
