"""The ROS arguments of a command line, as rcl reads them. Pure.

Source: rcl/src/rcl/arguments.c. ROS arguments stand between ``--ros-args`` and ``--`` (or the end), in any
number of blocks; outside of them a bare ``a:=b`` still counts as a remap rule (deprecated).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

_REMAP = ("-r", "--remap")
_WITH_VALUE = (*_REMAP, "-p", "--param", "--params-file", "--log-level", "--log-config-file", "-e", "--enclave")


def remap_rules(cmd: Sequence[str]) -> tuple[str, ...]:
    """The text of all remap rules in ``cmd``, in the order in which rcl tries them."""
    return tuple(value for flag, value in _arguments(cmd) if flag in _REMAP)


def _arguments(cmd: Sequence[str]) -> Iterator[tuple[str, str]]:
    words = iter(cmd)
    inside = False
    for word in words:
        if word == "--ros-args":
            inside = True
        elif inside and word == "--":
            inside = False
        elif inside and word in _WITH_VALUE:
            yield word, next(words, "")
        elif not inside and ":=" in word and not word.startswith("-"):
            yield "-r", word
