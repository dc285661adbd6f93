"""Find how a node was started, from the command line of its process or the dry run's JSON. Performs no I/O."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from enclave_addons.recording.record.requested import StartedNode
from nodl.ros_arguments import ParameterRule, parse_ros_arguments, words_without_ros_arguments

_IN_PREFIX = re.compile(r"(?:.*/)?lib/([^/]+)/([^/]+)\Z")  # an executable of an ament package
_GENERATED_FILE = re.compile(r"<params:\d+>")
_UNSPECIFIED = "<node_name_unspecified>"
_NO_NAMESPACE = "<node_namespace_unspecified>"


def start_of_command(command: Sequence[str]) -> StartedNode | None:
    """Return the start of a running process by its command; None for what is not a program of an ament package."""
    programs = ((place, _IN_PREFIX.match(word)) for place, word in enumerate(command[:3], 1))
    for rest, match in programs:
        if match:
            words = command[rest:]
            given = parse_ros_arguments(words)
            rules = (each for each in given.parameters if isinstance(each, ParameterRule))
            return StartedNode(
                match[1],
                match[2],
                command=tuple(command),
                rule_texts=given.remaps,
                parameters={rule.name: rule.value for rule in rules},
                arguments=tuple(words_without_ros_arguments(words)),
            )
    return None


def starts_of_plan(document: Mapping[str, Any]) -> tuple[StartedNode, ...]:
    """Return what a launch file starts. Raises ``KeyError`` or ``TypeError`` for a document that is not a plan."""
    return (*map(_of_process, document["processes"]), *map(_of_component, document["components"]))


def start_for(fqn: str, command: Sequence[str], starts: Iterable[StartedNode]) -> tuple[StartedNode, ...]:
    """Return the starts that may be those of ``fqn`` in the process of ``command`` (empty: not known)."""
    known = [each for each in starts if not each.command or not command or _within(each.command, command)]
    named = [each for each in known if each.fqn == fqn]
    if named:
        alike = len({(each.program, each.rule_texts) for each in named}) == 1
        return tuple(named[:1] if alike else named)
    by_command = [each for each in known if command and each.command]
    if by_command:  # a further node of a program, or one that the launch file does not name
        return tuple(by_command[:1])
    namespace = fqn.rpartition("/")[0] or "/"
    return tuple(each for each in known if not each.fqn and each.namespace == namespace)


def _within(planned: tuple[str, ...], running: Sequence[str]) -> bool:
    """Return True if ``running`` is ``planned``, with an interpreter before it and what ``--secure`` adds behind it.

    A parameter file that launch generates has another path at each start; a plan writes ``<params:N>`` for it.
    """
    size = len(planned)
    return any(
        all(
            word == there or _is_generated(word, there)
            for word, there in zip(planned, running[i:], strict=False)
        )
        for i in range(min(4, len(running) - size + 1))
    )


def _is_generated(planned: str, running: str) -> bool:
    return _GENERATED_FILE.fullmatch(planned) is not None and running.startswith("/")


def _of_process(fields: Mapping[str, Any]) -> StartedNode:
    command = tuple(map(str, fields["cmd"]))
    program = next((i for i, word in enumerate(command) if word.endswith(str(fields["executable"]))), 0)
    words = command[program + 1 :]
    fqn = str(fields["fqn"] or "").replace(_NO_NAMESPACE, "")
    return StartedNode(
        str(fields["package"] or ""),
        str(fields["executable"]).rpartition("/")[2],
        fqn="" if _UNSPECIFIED in fqn else fqn,
        namespace=str(fields["namespace"] or "").replace(_NO_NAMESPACE, "") or "/",
        command=command,
        rule_texts=parse_ros_arguments(words).remaps,
        parameters=dict(fields["parameters"]),
        arguments=tuple(words_without_ros_arguments(words)),
    )


def _of_component(fields: Mapping[str, Any]) -> StartedNode:
    fqn = str(fields["fqn"]).replace(_NO_NAMESPACE, "")
    named = _UNSPECIFIED not in fqn
    namespace, _, name = fqn.rpartition("/")
    rules = [f"{source}:={target}" for source, target in fields["remaps"]]
    rules += [f"__node:={name}"] if named else []
    rules += [f"__ns:={namespace}"] if namespace else []
    return StartedNode(
        str(fields["package"]),
        plugin=str(fields["plugin"]),
        fqn=fqn if named else "",
        namespace=namespace or "/",
        rule_texts=tuple(rules),
        parameters=dict(fields["parameters"]),
    )
