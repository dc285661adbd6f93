"""The signals that end a launch, while it blocks the main thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from signal import SIG_IGN, SIGHUP, SIGINT, SIGQUIT, SIGTERM, Signals, getsignal

from enclave_launch.errors import RuntimeFailure


def require_signals() -> None:
    """Refuse to block if signals cannot be taken: only the main thread can, and only one that runs no loop."""
    if threading.current_thread() is not threading.main_thread():
        raise RuntimeFailure(
            "run() takes the signals of the process, which only its main thread can; "
            "in another thread use asyncio.run(run_async(...))"
        )
    if asyncio._get_running_loop() is not None:
        raise RuntimeFailure(
            "run() would block the event loop that is running here; await run_async(...) instead"
        )


@contextmanager
def signals_to(on_signal: Callable[[Signals], None]) -> Iterator[None]:
    """Handle signals within the block; SIGHUP only if nobody (nohup) requested to ignore it."""
    loop = asyncio.get_running_loop()
    ignored = {SIGHUP} if getsignal(SIGHUP) is SIG_IGN else set()
    numbers = [number for number in (SIGINT, SIGTERM, SIGQUIT, SIGHUP) if number not in ignored]
    for number in numbers:
        loop.add_signal_handler(number, on_signal, number)
    try:
        yield
    finally:
        for number in numbers:
            loop.remove_signal_handler(number)
