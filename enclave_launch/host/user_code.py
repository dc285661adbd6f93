"""Call the user's code.

What is called while the file is visited is called once for plan and start together (``user_code_results``). What an
event or a timer calls depends on that moment: it is called for the plan, to know what it
starts, and again at its event.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Hashable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar

from enclave_launch.description.events.event import Shutdown
from enclave_launch.description.location import location_of
from enclave_launch.diagnostics.evaluation import function_called_again
from enclave_launch.process import Unforeseeable

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext

T = TypeVar("T")
_OURS = "enclave_launch."


def is_users(function: object) -> bool:
    """Return True for code of the launch file or of a package it imports, False for ours."""
    return not str(getattr(_inner(function), "__module__", "")).startswith(_OURS)


def called_once(
    owner: object, function: object, call: Callable[[], T], context: LaunchContext, *more: Hashable
) -> T:
    """Return ``call()``, which calls ``function`` of ``owner``; the user's is called once for plan and start together,
    unless an event calls it."""
    results = context.host.user_code_results
    if results is None or context.on_event is not None or not is_users(function):
        return call()
    key = (getattr(function, "__qualname__", ""), *results.keep(owner), *more)
    return results.call(key, call, context)


def called_for_entities(
    owner: object, function: object, call: Callable[[], T], context: LaunchContext, *more: Hashable
) -> T | None:
    """Call, as ``called_once``, a function that returns entities.

    A plan does not call a function that starts nothing, nor one that a shutdown calls: it may remove what is still
    needed. A function that an event calls for the plan is reported, since it is called again.
    """
    if context.on_event is None or not is_users(function):
        return called_once(owner, function, call, context, *more)
    if starts_nothing(function):
        return None
    if _at_shutdown(context):
        _report_unforeseeable(owner, function, context)
        return None
    _report_called_again(owner, function, context)
    return call()


def once(method: Callable[..., T]) -> Callable[..., T]:
    """Wrap ``perform(self, context)`` of a foreign substitution class: called once for plan and start together."""
    return _wrapped(method, called_once)


def executed_once(method: Callable[..., T]) -> Callable[..., T | None]:
    """Wrap ``execute(self, context)`` of a foreign action class: called once for plan and start together."""
    return _wrapped(method, called_for_entities)


def _wrapped(method: Callable[..., Any], called: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(method)
    def remembering(self: Any, context: LaunchContext) -> Any:
        if getattr(context, "host", None) is None:  # upstream allows ``perform(None)``
            return method(self, context)
        return called(self, method, lambda: method(self, context), context)

    return remembering


def _at_shutdown(context: LaunchContext) -> bool:
    return isinstance(context.get_locals_as_dict().get("event"), Shutdown)


def _report_unforeseeable(owner: object, function: object, context: LaunchContext) -> None:
    what = f"what {_name(function)} gives when the launch ends"
    context.host.unforeseeable(Unforeseeable(what, location_of(owner, context)))


def _report_called_again(owner: object, function: object, context: LaunchContext) -> None:
    context.host.warn(
        function_called_again(_name(function), str(context.on_event), location_of(owner, context))
    )


def _name(function: object) -> str:
    name = str(getattr(_inner(function), "__qualname__", type(function).__name__))
    return name.replace("<locals>.", "")


def _inner(function: Any) -> Any:
    while hasattr(function, "func"):  # functools.partial
        function = function.func
    return function


_CHANGES = frozenset(
    (
        *("cancel", "emit_event", "emit_event_sync", "register_event_handler", "unregister_event_handler"),
        *("execute", "visit", "extend_globals", "extend_locals", "launch_configurations"),
    )
)
"""Methods and attributes by which a function changes the rest of the launch."""


def starts_nothing(function: object) -> bool:
    """Return True if the source of ``function`` is in reach, returns no value and changes nothing of the launch."""
    inner = _inner(function)
    try:
        source = inspect.getsource(getattr(inner, "__func__", inner))
        definition = ast.parse(textwrap.dedent(source)).body[0]
    except (OSError, TypeError, SyntaxError):  # a lambda in the middle of an expression, a function of C
        return False
    return isinstance(definition, ast.FunctionDef) and not any(map(_matters, ast.walk(definition)))


def _matters(node: ast.AST) -> bool:
    if isinstance(node, ast.Return):
        return node.value is not None
    if isinstance(node, ast.Attribute):
        return node.attr in _CHANGES
    return isinstance(node, (ast.Yield, ast.YieldFrom))
