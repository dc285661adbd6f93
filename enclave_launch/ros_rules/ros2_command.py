"""Which commands of ``ros2`` in a launch file make a ROS participant, and what to write instead. Pure."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence

_WITHOUT_PARTICIPANT = frozenset(
    ("interface", "pkg", "security", "test", "extensions", "extension_points", "multicast", "plugin")
)
_OF_BAGS = frozenset(("record", "play", "burst"))
_SHELLS = frozenset(("bash", "sh", "dash", "zsh"))
_OPERATORS = ";&|()"
_LONGEST = 50_000  # characters of a command line; the reader of shlex is quadratic in its words


def participant_command(words: Sequence[str], *, shell: bool) -> tuple[str, ...] | None:
    """Return the first command of ``ros2`` in a command line that makes a participant, or ``None``."""
    text = " ".join(words) if shell else _script(words)
    for command in [tuple(words)] if text is None else _commands(text):
        if len(command) > 1 and os.path.basename(command[0]) == "ros2" and _participates(command[1:]):
            return command
    return None


def instead_of(command: Sequence[str]) -> str:
    """Return what a launch file writes in place of ``command``, or how that gets an enclave."""
    verb, given = command[1], list(command[2:])
    if verb == "run" and len(given) > 1:
        node = f'<node pkg="{given[0]}" exec="{given[1]}"/>'
        return f"write it as a node, which gets an enclave and its permissions: {node}"
    if verb == "launch" and len(given) > 1:
        return "include that launch file: <include file=.../>, so that its nodes are in this plan"
    cure = "give it an enclave (enclave=), and that enclave in a policy file (--policy) what the command uses"
    if verb == "bag" and {"-a", "--all"} & set(given):
        return f"{cure}; name the topics instead of {'-a' if '-a' in given else '--all'}"
    return cure


def _participates(words: Sequence[str]) -> bool:
    if words[0] == "bag":
        return len(words) > 1 and words[1] in _OF_BAGS
    return words[0] not in _WITHOUT_PARTICIPANT and not words[0].startswith("-")


def _script(words: Sequence[str]) -> str | None:
    """Return the script of ``bash -c SCRIPT``."""
    if not words or os.path.basename(words[0]) not in _SHELLS:
        return None
    options = [
        index for index, word in enumerate(words[1:-1], start=1) if word.startswith("-") and "c" in word
    ]
    return words[options[0] + 1] if options else None


def _commands(text: str) -> list[tuple[str, ...]]:
    """Split a shell's text at its operators; a text that is no shell's has no commands."""
    reader = shlex.shlex(text[:_LONGEST].replace("\n", ";"), posix=True, punctuation_chars=_OPERATORS)
    reader.whitespace_split = True
    commands: list[list[str]] = [[]]
    try:
        for word in reader:
            if set(word) <= set(_OPERATORS):
                commands.append([])
            elif commands[-1] or word != "exec":
                commands[-1].append(word)
    except ValueError:
        return []
    return [tuple(command) for command in commands if command]
