"""Choose an observer, and how long it observes."""

from __future__ import annotations

import importlib.util
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

from enclave_addons.observation.graph.cyclone import CycloneObserver, ObserverError
from enclave_addons.observation.graph.model import Graph
from enclave_addons.observation.graph.rclpy_graph import RclpyObserver
from enclave_common.dependencies import ros_import_failure
from enclave_common.environment import environment_with

INTERVAL = 0.1  # seconds between two polls: clients that call once and leave are there for about that long
SOURCES = ("auto", "cyclonedds", "rclpy")  # all but the first are packages
_MOST_CRASHES = 10
_AFTER_CRASH = 1.0  # seconds: the nodes whose start made DDS crash are then known to each other
_CRASHED = (
    f"DDS crashed {_MOST_CRASHES} times while it observed. Cyclone DDS 0.10 does when nodes with Fast DDS 3 (ROS 2 "
    "kilted and later) start: observe again when they have started, or with rclpy (--with rclpy)"
)
_Result = TypeVar("_Result")


_OF_RCLPY = (
    "on a secured system it needs an enclave that ROS nodes can start in: secure-keystore tool-enclave KEYSTORE "
    "--for list"
)


class Observer(Protocol):
    """Common parts of both observers."""

    def poll(self) -> int: ...

    def graph(self, *, past: bool = False) -> Graph: ...

    @property
    def forged(self) -> tuple[str, ...]: ...

    def close(self) -> None: ...


class Where(NamedTuple):
    """Subject and manner of an observation. ``enclave_directory`` is ``None`` without security."""

    domain_id: int = 0
    source: str = "auto"
    enclave_directory: Path | None = None


def chosen_source(wanted: str) -> str:
    """Return what to observe with: for ``auto`` Cyclone DDS's binding, else rclpy; raises ``ObserverError``."""
    for package in (wanted,) if wanted != "auto" else SOURCES[1:]:
        if importlib.util.find_spec(package) is not None:
            why = ros_import_failure() if package == "rclpy" else ""
            if why:
                raise ObserverError(f"nothing to observe with ({wanted}): {why}")
            return package
    raise ObserverError(
        f"nothing to observe with ({wanted}): install the Python binding of Cyclone DDS (pip install "
        "'enclave-launch[observe]'; it is built against an installed Cyclone DDS 0.10), or source a ROS 2 workspace, "
        "which has rclpy"
    )


@contextmanager
def observer(where: Where, environment: Mapping[str, str]) -> Iterator[Observer]:
    """Observe inside the block. Raises ``ObserverError``."""
    source = chosen_source(where.source)
    up: Observer
    if source == "rclpy":
        with environment_with(_ros_variables(where)):
            try:
                up = RclpyObserver()
            except Exception as error:
                # A half installed ROS, a middleware that refuses: rclpy has no common class.
                raise ObserverError(f"rclpy cannot observe the domain: {error}; {_OF_RCLPY}") from error
    else:
        up = CycloneObserver(where.domain_id, environment, where.enclave_directory)
    try:
        yield up
    finally:
        up.close()


def in_own_process(observe: Callable[[], _Result]) -> _Result:
    """Call ``observe`` in a process of its own, and again if DDS crashes that.

    Cyclone DDS 0.10 does not survive the type descriptions with 8-bit integers that nodes with Fast DDS 3 send each
    other while they start, and every participant of the domain receives.

    Returns what ``observe`` returns and raises what it raises; both must be picklable. Raises ``ObserverError`` if it
    crashes again and again.
    """
    forked = multiprocessing.get_context("fork")
    for _ in range(_MOST_CRASHES):
        answers, answer = forked.Pipe(duplex=False)
        process = forked.Process(target=_answered, args=(observe, answer))
        process.start()
        answer.close()
        try:
            value = answers.recv()
        except EOFError:
            time.sleep(_AFTER_CRASH)
            continue
        finally:
            process.terminate()
            process.join()
        if isinstance(value, Exception):
            raise value
        result: _Result = value
        return result
    raise ObserverError(_CRASHED)


def _answered(observe: Callable[[], Any], answer: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    value: Any
    try:
        value = observe()
    except Exception as error:  # whatever it is, the parent raises it
        value = error
    answer.send(value)


def observe_until(up: Observer, done: Callable[[], bool]) -> None:
    """Poll until ``done`` returns True, which is called after each poll."""
    up.poll()
    while not done():
        time.sleep(INTERVAL)
        up.poll()


class Quiet:
    """Done when nothing has changed, and nothing is half open, for ``settle`` seconds; at the latest after
    ``longest``. An empty domain is not quiet: a participant may be about to be discovered."""

    def __init__(self, up: Observer, settle: float, longest: float) -> None:
        self._up, self._settle = up, settle
        self._since = time.monotonic()
        self._end = self._since + longest
        self._changes = -1

    def __call__(self) -> bool:
        now, changes = time.monotonic(), self._up.poll()
        graph = self._up.graph()
        if changes != self._changes or graph.half_open or not graph.processes:
            self._changes = changes
            self._since = now
        return now >= self._end or now - self._since >= self._settle


def _ros_variables(where: Where) -> dict[str, str]:
    wanted = {"ROS_DOMAIN_ID": str(where.domain_id)}
    if where.enclave_directory is not None:
        keystore, slash, enclave = str(where.enclave_directory.resolve()).rpartition("/enclaves/")
        if not slash:
            raise ObserverError(f"{where.enclave_directory} is not below the enclaves of a keystore")
        wanted |= {
            "ROS_SECURITY_ENABLE": "true",
            "ROS_SECURITY_STRATEGY": "Enforce",
            "ROS_SECURITY_KEYSTORE": keystore,
            "ROS_SECURITY_ENCLAVE_OVERRIDE": f"/{enclave}",
        }
    return wanted
