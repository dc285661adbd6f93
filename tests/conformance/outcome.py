"""What one evaluation did, as lines of text: the same for ours and for real launch.

    run WORDS   {node FQN; env+ A=1; cwd /; shell}      one process, in launch order
    load PACKAGE/PLUGIN name= ns= remaps= params= extra= into CONTAINER
    log LEVEL: text                                      what ``log`` says, and warnings
    error Type: message                                  the exception that ended the visit

Generated parameter files show as ``<key | content>``; ``DIR`` is the folder of the launch file, ``PREFIX``
the install prefix.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from enclave_launch.description.install import upstream_name

# Messages that come from the parsing library or from Python, not from launch: the type is what counts.
_TYPE_ONLY = {
    *("UnexpectedCharacters", "UnexpectedEOF", "ParseError", "SyntaxError", "XMLSyntaxError"),
    *("ScannerError", "ParserError", "ConstructorError", "ComposerError"),
    *("AssertionError", "RecursionError", "InvalidNodeNameException", "InvalidNamespaceException"),
}

_SET = re.compile(r"\{('[^']*'(?:, '[^']*')+)\}")  # of names: its order is by chance

# What may differ without meaning: addresses, where classes really live, the driver's own folder, empty lines
# (they would end a section of a case file).
_NORMALIZED = [
    (re.compile(pattern), replacement)
    for pattern, replacement in (
        (r"0x[0-9a-f]{6,}", "0x.."),
        (r"(enclave_launch\.description\.[\w.]+)\.([A-Z]\w+)", lambda ours: upstream_name(ours[1], ours[2])),
        (r"typing\.List\[", "list["),
        (r", '[^']*launch_grammar_[^']*'", ""),
        (r"(cannot import name .*) \([^)]*\)", r"\1"),
        (r"\n\n+", "\n"),
    )
]


@dataclass
class Process:
    cmd: Sequence[str]
    fqn: str | None = None
    environment: Mapping[str, str] = field(default_factory=dict)
    cwd: str | None = None
    shell: Any = False
    event: str | None = None


@dataclass
class Component:
    container: str
    package: str
    plugin: str
    name: str
    namespace: str
    remaps: Sequence[str]
    parameters: Mapping[str, Any]
    extra_arguments: Mapping[str, Any]
    event: str | None = None


@dataclass
class Outcome:
    """``folders``: path -> short name. ``parameter_files``: path -> text of those that launch generated."""

    processes: Sequence[Process] = ()
    components: Sequence[Component] = ()
    logs: Sequence[tuple[str, str]] = ()
    error: tuple[str, str] | None = None
    parameter_files: Mapping[str, str] = field(default_factory=dict)
    folders: Mapping[str, str] = field(default_factory=dict)


def render(outcome: Outcome) -> str:
    lines = [_process(item, outcome.parameter_files) for item in outcome.processes]
    lines += [_component(item) for item in _by_container(outcome.components)]
    lines += [f"log {level}: {text}" for level, text in sorted(outcome.logs, key=_warnings_last)]
    if outcome.error is not None:
        lines.append(_error(*outcome.error))
    text = "\n".join(lines).strip() or "nothing"
    for path in sorted(outcome.folders, key=len, reverse=True):
        text = text.replace(path, outcome.folders[path])
    text = _SET.sub(lambda found: f"{{{', '.join(sorted(found[1].split(', ')))}}}", text)
    for pattern, replacement in _NORMALIZED:
        text = pattern.sub(replacement, text)
    return text


def _warnings_last(log: tuple[str, str]) -> bool:
    return log[0] == "WARNING"


def _by_container(components: Sequence[Component]) -> list[Component]:
    """Loads into one container are in order; different containers load at the same time."""
    order = list(dict.fromkeys(item.container for item in components))
    return sorted(components, key=lambda item: order.index(item.container))


def _process(process: Process, parameter_files: Mapping[str, str]) -> str:
    words = [_word(word, parameter_files) for word in process.cmd]
    notes = [f"node {_short(process.fqn)}"] if process.fqn else []
    if process.environment:
        notes.append("env+ " + " ".join(f"{k}={v}" for k, v in sorted(process.environment.items())))
    if process.cwd is not None:
        notes.append(f"cwd {process.cwd}")
    if process.shell:
        notes.append(f"shell={process.shell}")
    if process.event is not None:
        notes.append(f"on {process.event}")
    return f"run {' '.join(words)}" + (f"   {{{'; '.join(notes)}}}" if notes else "")


def _word(word: str, parameter_files: Mapping[str, str]) -> str:
    if word in parameter_files:
        return "<" + _one_line(parameter_files[word]) + ">"
    return shlex.quote(word).replace("\n", "\\n")


def _one_line(text: str) -> str:
    """``/n:\\n  ros__parameters:\\n    a: 1\\n`` as ``/n | a: 1``."""
    lines = text.rstrip("\n").split("\n")
    if len(lines) > 1 and lines[1].strip().startswith("ros__parameters:"):
        inner = [lines[1].partition("ros__parameters:")[2].strip(), *(line.strip() for line in lines[2:])]
        return f"{lines[0].rstrip(':')} | " + "; ".join(item for item in inner if item)
    return "; ".join(line.rstrip() for line in lines)


def _short(fqn: str) -> str:
    return fqn.replace("<node_namespace_unspecified>", "<ns?>").replace("<node_name_unspecified>", "<name?>")


def _component(item: Component) -> str:
    line = f"load {item.package}/{item.plugin} name={item.name!r} ns={item.namespace!r}"
    if item.remaps:
        line += f" remaps={list(item.remaps)!r}"
    for label, values in (("params", item.parameters), ("extra", item.extra_arguments)):
        if values:
            line += f" {label}={{{', '.join(f'{k}: {_plain(v)!r}' for k, v in values.items())}}}"
    line += f" into {item.container}"
    return f"{line}   {{on {item.event}}}" if item.event is not None else line


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _error(kind: str, message: str) -> str:
    if kind in _TYPE_ONLY or not message:
        return f"error {kind}"
    return f"error {kind}: {message}"
