"""A plan does not call a function of an event that starts nothing."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import pytest

from enclave_launch.host.user_code import starts_nothing


def _says(context: Any) -> None:
    print(context)


def _sets(context: Any) -> None:
    context.launch_configurations["x"] = "y"


def _cancels(context: Any) -> None:
    context.timer.cancel()


def _returns_early(context: Any) -> None:
    if not context:
        return
    print("on")


def _gives(context: Any) -> Any:
    return [context] if context else None


def _yields(context: Any) -> Any:
    yield context


class _Bound:
    def says(self, context: Any) -> None:
        print(context)

    def gives(self, context: Any) -> Any:
        return [context]


@pytest.mark.parametrize(
    "function",
    [_says, _returns_early, _Bound().says, functools.partial(_says), functools.partial(_Bound().says)],
)
def test_a_function_that_starts_nothing(function: Callable[..., Any]) -> None:
    assert starts_nothing(function)


@pytest.mark.parametrize(
    "function", [_gives, _yields, _sets, _cancels, _Bound().gives, lambda context: [], print, None, _Bound]
)
def test_a_function_that_may_start_something(function: object) -> None:
    assert not starts_nothing(function)
