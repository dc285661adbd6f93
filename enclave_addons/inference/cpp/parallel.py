"""Independent pieces of work over all processors. Starts processes, by ``fork``: they have what this one has read."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

FEWEST = 3
"""Fewer pieces are not worth a process."""

Piece = TypeVar("Piece")
Result = TypeVar("Result")
_work: Callable[[Any], Any] | None = None  # of a worker process


def each_in_parallel(work: Callable[[Piece], Result], pieces: Sequence[Piece]) -> Iterator[Result]:
    """Return ``work`` of each piece, in their order; one after the other if processes cannot be had.

    Raises what ``work`` raises.
    """
    workers = min(_processors(), len(pieces))
    if len(pieces) < FEWEST or workers < 2 or not _may_fork():
        yield from map(work, pieces)
        return
    yield from _forked(work, pieces, workers)


def _forked(work: Callable[[Piece], Result], pieces: Sequence[Piece], workers: int) -> Iterator[Result]:
    done = 0
    context = multiprocessing.get_context("fork")
    try:
        with ProcessPoolExecutor(workers, context, _become_worker, (work,)) as pool:
            for result in pool.map(_worked, pieces):
                done += 1
                yield result
    except BrokenProcessPool:  # one was killed, perhaps for want of memory
        yield from map(work, pieces[done:])


def _become_worker(work: Callable[[Any], Any]) -> None:
    global _work
    _work = work


def _worked(piece: Any) -> Any:
    assert _work is not None
    return _work(piece)


def _processors() -> int:
    """Return those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _may_fork() -> bool:
    """Return whether this process may fork: one with threads must not, and a daemonic one has no children."""
    possible = "fork" in multiprocessing.get_all_start_methods()
    return possible and threading.active_count() == 1 and not multiprocessing.current_process().daemon
