"""The dry run's world, and its event loop without time."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from enclave_launch.host.host import Completion, Host, HostOptions

if TYPE_CHECKING:
    from enclave_launch.host.host import (
        ExecuteLocal,
        LaunchContext,
        LifecycleComponent,
        LifecycleNode,
        UserCodeResults,
    )
    from enclave_launch.process import (
        LauncherCall,
        Reaction,
        ResolvedComponent,
        ResolvedProcess,
        Unforeseeable,
    )


class PlanHost(Host):
    """The dry run's world: everything is recorded, nothing is started or written."""

    loop: VirtualLoop

    def __init__(
        self,
        options: HostOptions | None = None,
        *,
        user_code_results: UserCodeResults | None = None,
        **given: Any,
    ) -> None:
        """Create a host that records instead of acting; ``given``: fields of ``HostOptions``."""
        super().__init__(options or HostOptions(**given), user_code_results)
        self.processes: list[ResolvedProcess] = []
        self.started: list[ExecuteLocal] = []  # action of each process, same order
        self.components: list[ResolvedComponent] = []
        self.written_in: dict[int, tuple[object, str]] = {}  # of handlers and timers, by id
        self.lifecycle_components: list[LifecycleComponent] = []
        self.calls: list[LauncherCall] = []
        self.unforeseen: list[Unforeseeable] = []
        self.reactions: list[Reaction] = []
        self.parameter_files: dict[str, str] = {}
        self.loop = VirtualLoop()

    def note_namespace(self, later: object, context: LaunchContext) -> None:
        namespace = context.launch_configurations.get("ros_namespace")
        if namespace:
            self.written_in[id(later)] = (later, str(namespace))

    def started_so_far(self) -> int:
        return len(self.processes) + len(self.components) + len(self.calls) + self.loop.used

    def write_parameter_file(self, text: str) -> str:
        path = f"<params:{len(self.parameter_files) + 1}>"
        self.parameter_files[path] = text
        return path

    def parameter_file(self, path: str) -> str | None:
        return self.parameter_files.get(path)

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        self.processes.append(process)
        self.started.append(action)
        return self.loop.create_future()

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        self.components.extend(components)

    def launcher_call(self, call: LauncherCall) -> None:
        self.calls.append(call)

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Do nothing: a dry run starts nothing that could change its state."""

    def watch_states(self, component: LifecycleComponent, context: LaunchContext) -> None:
        self.lifecycle_components.append(component)

    def unforeseeable(self, item: Unforeseeable) -> None:
        self.unforeseen.append(item)


class VirtualFuture:
    """The part of ``asyncio.Future`` that launch code uses, without a loop behind it."""

    def __init__(self) -> None:
        self._done = False
        self._cancelled = False
        self._result: Any = None
        self._callbacks: list[Callable[[Any], object]] = []

    def done(self) -> bool:
        return self._done

    def cancelled(self) -> bool:
        return self._cancelled

    def result(self) -> Any:
        return self._result

    def exception(self) -> None:
        return None

    def set_result(self, result: Any) -> None:
        self._result = result
        self._finish()

    def cancel(self, msg: object = None) -> bool:
        if self._done:
            return False
        self._cancelled = True
        self._finish()
        return True

    def add_done_callback(self, callback: Callable[[Any], object], *, context: object = None) -> None:
        if self._done:
            callback(self)
        else:
            self._callbacks.append(callback)

    def _finish(self) -> None:
        self._done = True
        callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback(self)


class VirtualTimer:
    """A scheduled call; ``cancel()`` as asyncio's handle."""

    __slots__ = ("args", "callback", "cancelled_", "when")

    def __init__(self, when: float, callback: Callable[..., object], args: tuple[Any, ...]) -> None:
        self.when = when
        self.callback = callback
        self.args = args
        self.cancelled_ = False

    def cancel(self) -> None:
        self.cancelled_ = True

    def cancelled(self) -> bool:
        return self.cancelled_


class VirtualLoop:
    """A clock that jumps from timer to timer."""

    def __init__(self) -> None:
        self._now = 0.0
        self._timers: list[tuple[float, int, VirtualTimer]] = []
        self._count = 0
        self.used = 0  # how often it was called: what a live loop would have done

    def time(self) -> float:
        return self._now

    def create_future(self) -> VirtualFuture:
        self.used += 1
        return VirtualFuture()

    def create_task(self, coroutine: Coroutine[Any, Any, Any], **_: Any) -> VirtualFuture:
        self.used += 1
        coroutine.close()
        return VirtualFuture()

    def call_soon(self, callback: Callable[..., object], *args: Any, **_: Any) -> VirtualTimer:
        return self.call_later(0, callback, *args)

    call_soon_threadsafe = call_soon

    def call_later(self, delay: float, callback: Callable[..., object], *args: Any, **_: Any) -> VirtualTimer:
        self.used += 1
        timer = VirtualTimer(self._now + max(delay, 0.0), callback, args)
        self._count += 1
        heapq.heappush(self._timers, (timer.when, self._count, timer))
        return timer

    def run_in_executor(self, executor: object, function: Callable[..., object], *args: Any) -> VirtualFuture:
        self.used += 1
        return VirtualFuture()

    def run_until_complete(self, future: object) -> NoReturn:
        raise RuntimeError("a dry run cannot wait for a coroutine")

    def is_running(self) -> bool:
        return True

    def fire_next(self) -> bool:
        """Call the next timer that is due; ``False`` when there is none."""
        while self._timers:
            when, _, timer = heapq.heappop(self._timers)
            if timer.cancelled_:
                continue
            self._now = max(self._now, when)
            timer.callback(*timer.args)
            return True
        return False

    def fire_due(self) -> bool:
        """Call the next timer if it is due by now, without moving the clock."""
        while self._timers and self._timers[0][2].cancelled_:
            heapq.heappop(self._timers)
        if self._timers and self._timers[0][0] <= self._now:
            return self.fire_next()
        return False

    def save(self) -> tuple[float, list[tuple[float, int, VirtualTimer]]]:
        return self._now, list(self._timers)

    def restore(self, saved: tuple[float, list[tuple[float, int, VirtualTimer]]]) -> None:
        self._now, self._timers = saved[0], list(saved[1])
