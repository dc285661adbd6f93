"""``OpaqueCoroutine``."""

from __future__ import annotations

import collections.abc
import inspect
from collections.abc import Awaitable, Callable, Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.event_handlers.on_shutdown import OnShutdown
from enclave_launch.description.launch.utilities import ensure_argument_type

if TYPE_CHECKING:
    from enclave_launch.description.launch.event import Event
    from enclave_launch.description.launch.launch_context import LaunchContext


class OpaqueCoroutine(Action):
    """Run a coroutine function beside the launch; its result is ignored. A dry run does not run it.

    Called as ``coroutine(context, *args, **kwargs)``, without the context if ``ignore_context``.
    """

    def __init__(
        self,
        *,
        coroutine: Callable[..., Awaitable[None]],
        args: Iterable[Any] | None = None,
        kwargs: dict[str, Any] | None = None,
        ignore_context: bool = False,
        **left_over_kwargs: Any,
    ) -> None:
        super().__init__(**left_over_kwargs)
        if not inspect.iscoroutinefunction(coroutine):
            raise TypeError(
                f"OpaqueCoroutine expected a coroutine function for 'coroutine', got '{type(coroutine)}'"
            )
        ensure_argument_type(args, (collections.abc.Iterable, type(None)), "args", "OpaqueCoroutine")
        ensure_argument_type(kwargs, (dict, type(None)), "kwargs", "OpaqueCoroutine")
        ensure_argument_type(ignore_context, bool, "ignore_context", "OpaqueCoroutine")
        self.__coroutine = coroutine
        self.__args: Iterable[Any] = [] if args is None else args
        self.__kwargs: dict[str, Any] = {} if kwargs is None else kwargs
        self.__ignore_context = ignore_context
        self.__future: Any = None

    def execute(self, context: LaunchContext) -> None:
        args = self.__args if self.__ignore_context else [context, *self.__args]
        self.__future = context.asyncio_loop.create_task(self.__coroutine(*args, **self.__kwargs))
        context.register_event_handler(OnShutdown(on_shutdown=self.__on_shutdown))

    def __on_shutdown(self, event: Event, context: LaunchContext) -> None:
        if self.__future is not None:
            self.__future.cancel()

    def get_asyncio_future(self) -> Any:
        return self.__future
