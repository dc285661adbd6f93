"""Signal handlers that run inside an asyncio loop."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import TracebackType
from typing import Any


class AsyncSafeSignalManager:
    """Within its ``with`` block, ``handle(signal, function)`` calls ``function(signum)`` from the loop."""

    def __init__(self, loop: Any) -> None:
        self.__loop = loop
        self.__handled: set[int] = set()

    def __enter__(self) -> AsyncSafeSignalManager:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        for signum in self.__handled:
            self.__loop.remove_signal_handler(signum)
        self.__handled.clear()

    def handle(self, signum: int, handler: Callable[[int], object] | None) -> None:
        """Handle ``signum`` from now on; ``None`` stops that."""
        number = signal.Signals(signum)
        if handler is None:
            self.__handled.discard(number)
            self.__loop.remove_signal_handler(number)
            return
        self.__loop.add_signal_handler(number, handler, number)
        self.__handled.add(number)
