"""A change to the whole process that several launches want at the same time: made by the first, undone by the last."""

from __future__ import annotations

import resource
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager


class Overlap:
    """A change that overlapping users share: ``with overlap():`` as often as one likes, in any order; ``change`` is
    entered once meanwhile."""

    def __init__(self, change: Callable[[], AbstractContextManager[None]]) -> None:
        self._make = change
        self._lock = threading.Lock()
        self._count = 0
        self._change: AbstractContextManager[None]

    @contextmanager
    def __call__(self) -> Iterator[None]:
        with self._lock:
            self._count += 1
            if self._count == 1:
                self._change = self._make()
                self._change.__enter__()
        try:
            yield
        finally:
            with self._lock:
                self._count -= 1
                if self._count == 0:
                    self._change.__exit__(None, None, None)


@contextmanager
def _raised_limit() -> Iterator[None]:
    # Each process takes three files. The warden runs already: its children keep the launcher's limit.
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


many_descriptors = Overlap(_raised_limit)
