"""The evaluation's seam to the world, live: each process starts in a task of its own, once its enclave is complete."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from enclave_launch.description.actions.lifecycle import LifecycleComponent, LifecycleNode
from enclave_launch.description.actions.processes import ExecuteLocal
from enclave_launch.description.events.lifecycle import StateTransition
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.errors import EnclaveLaunchError, RuntimeFailure
from enclave_launch.host.host import Host, HostOptions
from enclave_launch.host.user_code_results import RecordedResults
from enclave_launch.process import LauncherCall, ResolvedComponent, ResolvedProcess, Unforeseeable
from enclave_launch.runtime.companion import LaunchCompanion
from enclave_launch.runtime.environment_watch import EnvironmentWatch, Unplanned, Watched
from enclave_launch.runtime.gate import EnclaveGate, StartAdditions
from enclave_launch.runtime.launch_log import LaunchLog
from enclave_launch.runtime.live_process import LiveProcess
from enclave_launch.runtime.process_tree import ProcessSpec, ProcessTree
from enclave_launch.runtime.ros_services import ALTERNATIVE, RosServices
from enclave_launch.runtime.run_events import Observer, ProcessOver, ProcessPlanned


class LiveHost(Host):
    """The host of a live launch. ``secrets``: variables that no child may see. ``fail`` is called with why the launch
    cannot go on. ``services`` raises ``RuntimeFailure`` if a launch that was not evaluated before needs rclpy, and
    there is none."""

    loop: asyncio.AbstractEventLoop

    def __init__(
        self,
        tree: ProcessTree,
        log: LaunchLog,
        gate: EnclaveGate | None,
        *,
        secrets: frozenset[str],
        fail: Callable[[EnclaveLaunchError], None],
        services: Callable[[], RosServices | None],
        observe: Observer,
        companion: LaunchCompanion | None,
        options: HostOptions,
        user_code_results: RecordedResults | None,
    ) -> None:
        super().__init__(options, user_code_results)
        self._observe = observe
        self.loop = asyncio.get_running_loop()
        self._tree = tree
        self._log = log
        self._gate = gate
        self._at_the_gate = ThreadPoolExecutor(1, "gate")  # one call at a time, in the order of the starts
        self._waiting_at_the_gate = 0
        self._secrets = secrets
        self._fail = fail
        self._services = services
        self._companion = companion
        self._parameter_directory: Path | None = None
        self._parameter_files: dict[str, str] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._planned: dict[str, Mapping[str, str]] = {}  # security variables by process name
        self._watch = EnvironmentWatch(self._watched, self._on_unplanned)
        if gate is None:  # of a secured launch the plan has told them
            for warning in self.warnings:
                self._log.log("WARNING", "launch", str(warning))
        if gate is not None:
            self._tasks.add(self.loop.create_task(self._watch.run(), name="environment watch"))
        self.processes: list[LiveProcess] = []
        self.failed: list[str] = []  # names of processes that ended badly on their own

    def started_so_far(self) -> int:
        return len(self._tasks)

    def write_parameter_file(self, text: str) -> str:
        """Write it readable by us alone, and keep it until the launch ends: a respawned node reads it again."""
        if self._parameter_directory is None:
            self._parameter_directory = Path(tempfile.mkdtemp(prefix="launch_params_"))
            self._tree.send("remove_at_end", 0, str(self._parameter_directory))
        path = self._parameter_directory / f"{len(self._parameter_files) + 1}.yaml"
        path.write_text(text, encoding="utf-8")
        self._parameter_files[str(path)] = text
        return str(path)

    def parameter_file(self, path: str) -> str | None:
        return self._parameter_files.get(path)

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> asyncio.Future[None]:
        base = dict((action.process_details or {}).get("env") or {})
        prepare = partial(self._prepare, process, base)
        live = LiveProcess(action, process, context, self._tree, self._log, prepare, self._observe)
        self._observe(ProcessPlanned(process))
        self._watch_state(action, process, context)
        self.processes.append(live)
        completed: asyncio.Future[None] = self.loop.create_future()
        task = self.loop.create_task(self._run(live, completed), name=process.process_name)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return completed

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        if not components:
            return
        if self._gate is not None:
            self._gate.ensure_components(components)
        if self._companion is not None:
            self._companion.loading(components)
        services = self._services()
        assert services is not None  # the service refuses to start without, where the plan has components
        context.add_completion_future(services.load(components))

    def launcher_call(self, call: LauncherCall) -> None:
        """Ignore the call: the plan has it, ``ros_services`` makes it."""

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        services = self._services()
        if services is None:
            self._log.log("ERROR", "launch", f"no lifecycle transition of '{node.node_name}': {ALTERNATIVE}")
            return
        context.add_completion_future(services.change_state(node.node_name, transition_id))

    def _watch_state(self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext) -> None:
        if process.kind != "lifecycle_node" or process.fqn is None:
            return
        services = self._services()
        if services is None:
            return

        node: Any = action
        services.watch_state(
            process.fqn, lambda message: context.emit_event_sync(StateTransition(action=node, msg=message))
        )

    def watch_states(self, component: LifecycleComponent, context: LaunchContext) -> None:
        services = self._services()
        if services is not None:
            services.watch_state(
                component.node_name,
                lambda message: context.emit_event_sync(StateTransition(action=component, msg=message)),
            )

    def note_namespace(self, later: object, context: LaunchContext) -> None:
        """Do nothing: only a plan compares it with where the event starts something."""

    def unforeseeable(self, item: Unforeseeable) -> None:
        """Do nothing: only a plan has to say so, here it simply happens."""

    def warn(self, warning: Diagnostic) -> None:
        if warning not in self.warnings:
            super().warn(warning)
            self._log.log("WARNING", "launch", str(warning))

    def log_directory(self) -> str:
        return str(self._log.directory)

    async def close(self) -> None:
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._gate is not None:  # it may wait for a keystore's lock
            await asyncio.to_thread(self._at_the_gate.shutdown, cancel_futures=True)
        if self._parameter_directory is not None:
            shutil.rmtree(self._parameter_directory, ignore_errors=True)

    async def _run(self, live: LiveProcess, completed: asyncio.Future[None]) -> None:
        name = live.process.process_name
        failed = True
        try:
            outcome = await live.run()
            failed = outcome.returncode != 0 and not outcome.requested_to_end
            if failed:
                self.failed.append(name)
        except EnclaveLaunchError as error:
            self._fail(error)
        except Exception as error:
            # Whatever it is: a process that did not run must not pass for one that did.
            self._fail(RuntimeFailure(f"{name}: {type(error).__name__}: {error}"))
        finally:
            self._observe(ProcessOver(name, failed))
            self.processes.remove(live)
            if not completed.done():
                completed.set_result(None)

    async def _prepare(
        self, process: ResolvedProcess, base: Mapping[str, str], emulate_tty: bool
    ) -> ProcessSpec:
        grant = await self._granted(process)
        self._planned[process.process_name] = grant.environment
        self._watch.process_started()
        environment = {name: value for name, value in base.items() if name not in self._secrets}
        spec = ProcessSpec(
            cmd=(*process.cmd, *grant.arguments),
            environment={**environment, **grant.environment},
            cwd=process.cwd,
            shell=process.shell,
            emulate_tty=emulate_tty,
        )
        return self._companion.prepared(process, spec) if self._companion is not None else spec

    def _watched(self) -> list[Watched]:
        running = ((live.process.process_name, live.pid) for live in self.processes)
        return [Watched(name, pid, self._planned.get(name, {})) for name, pid in running if pid is not None]

    def _on_unplanned(self, found: Unplanned) -> None:
        self.failed.append(found.watched.name)
        self._log.log("ERROR", found.watched.name, str(found))

    async def _granted(self, process: ResolvedProcess) -> StartAdditions:
        if self._gate is None:
            return StartAdditions()
        if not self._waiting_at_the_gate and (grant := self._gate.granted(process)) is not None:
            return grant
        self._waiting_at_the_gate += 1
        try:
            return await self.loop.run_in_executor(self._at_the_gate, self._gate.ensure, process)
        finally:
            self._waiting_at_the_gate -= 1
