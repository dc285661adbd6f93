"""Call the user's code: once for plan and start together (``user_code_results``), and for a plan only where the plan
learns something from it.
"""

from __future__ import annotations

import dis
import inspect
from collections.abc import Callable, Hashable, Iterable
from functools import wraps
from types import CodeType
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
    """Return ``call()``, which calls ``function`` of ``owner``; the user's is called once for plan and start together.

    At an event, the result of the plan is used if all that the function read is unchanged.
    """
    results = context.host.user_code_results
    if results is None or not is_users(function):
        return call()
    key = (getattr(function, "__qualname__", ""), *results.keep(owner), *more)
    return results.call(key, call, context, at_event=context.on_event is not None)


def called_for_entities(
    owner: object, function: object, call: Callable[[], T], context: LaunchContext, *more: Hashable
) -> T | None:
    """Call, as ``called_once``, a function that returns entities.

    A function from which a plan learns nothing is not called for it, nor one that a shutdown calls: it may remove what
    is still needed. A function that was called for the plan and returned nothing is reported.
    """
    if context.on_event is None or not is_users(function):
        return called_once(owner, function, call, context, *more)
    if only_acts(function):
        return None
    if _at_shutdown(context):
        _report_unforeseeable(owner, function, context)
        return None
    result = called_once(owner, function, call, context, *more)
    if result is None or result == []:
        _report_called_again(owner, function, context)
    return result


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
        *("execute", "visit", "extend_globals", "extend_locals"),
        *("add", "append", "clear", "extend", "insert", "pop", "putenv", "remove", "setdefault", "update"),
    )
)
"""Methods by which a function changes the launch, or a list or dictionary that another function may look at."""
_STORES = frozenset(("STORE_SUBSCR", "DELETE_SUBSCR", "STORE_ATTR", "STORE_GLOBAL", "STORE_DEREF"))


def only_acts(function: object) -> bool:
    """Return True if ``function``, by its code, returns nothing and changes nothing that the launch may see.

    A plan learns nothing from it; it is called when its event happens.
    """
    inner = _inner(function)
    code = getattr(getattr(inner, "__func__", inner), "__code__", None)
    return isinstance(code, CodeType) and _gives_nothing(code) and not _changes(code)


def _gives_nothing(code: CodeType) -> bool:
    if code.co_flags & (inspect.CO_GENERATOR | inspect.CO_COROUTINE | inspect.CO_ASYNC_GENERATOR):
        return False
    before: dis.Instruction | None = None
    for instruction in dis.get_instructions(code):
        if instruction.opname == "RETURN_CONST" and instruction.argval is not None:
            return False
        if instruction.opname == "RETURN_VALUE" and (instruction.is_jump_target or not _loads_none(before)):
            return False
        before = instruction
    return True


def _loads_none(instruction: Any) -> bool:
    return instruction is not None and instruction.opname == "LOAD_CONST" and instruction.argval is None


def _changes(code: CodeType) -> bool:
    return any(
        set(each.co_names) & _CHANGES or any(step.opname in _STORES for step in dis.get_instructions(each))
        for each in _with_inner(code)
    )


def _with_inner(code: CodeType) -> Iterable[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _with_inner(constant)
