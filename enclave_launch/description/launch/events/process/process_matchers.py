"""Matchers for ``ProcessTargetedEvent``; a process that was not prepared matches none."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.execute_local import ExecuteLocal

Matcher = Callable[["ExecuteLocal"], bool]


def _matches(test: Callable[[dict[str, Any]], bool]) -> Matcher:
    def matcher(action: ExecuteLocal) -> bool:
        details = action.process_details
        return details is not None and test(details)

    return matcher


def matches_pid(pid: int) -> Matcher:
    return _matches(lambda details: bool(details["pid"] == pid))


def matches_name(name: str) -> Matcher:
    """By NAME-N."""
    return _matches(lambda details: bool(details["name"] == name))


def matches_executable(executable: str) -> Matcher:
    """By the end of the first word of the command."""
    return _matches(lambda details: bool(details["cmd"][0].endswith(executable)))
