"""Refusals explained within ``ros2 launch --secure``: the recorder goes along with upstream's engine.

What upstream starts gets the recorder when its environment is final, and what happens to it is passed on. The record is
closed when the last process has ended.
"""

from __future__ import annotations

import asyncio
from typing import Any

from enclave_launch.plan import LaunchPlan
from enclave_launch.process import ResolvedProcess
from enclave_launch.recording.denials import Explainer
from enclave_launch.recording.learning import new_run
from enclave_launch.recording.recording import INTERVAL, Recording
from enclave_launch.ros2.context import EXPLAINED
from enclave_launch.runtime.process_tree import ProcessSpec
from enclave_launch.runtime.run_events import ProcessExited, ProcessOutput, ProcessStarted, RunEvent

_LONGEST_END = 60.0
"""Seconds after which the record is closed though a process has not ended."""


class ExplainedLaunch:
    """The recording of one launch of ``plan``. Where nothing can be recorded the launch says so and goes on."""

    def __init__(self, plan: LaunchPlan) -> None:
        run = new_run(plan.launch_file, plan.distro, "none", secured=True)
        self._recording = Recording(run, [Explainer(plan)], optional=True)
        self._components = plan.evaluation.components

    def install(self, context: Any) -> None:
        """In launch's loop, before the first process."""
        from launch.actions import OpaqueFunction
        from launch.event_handlers import OnProcessExit, OnProcessIO, OnProcessStart, OnShutdown

        context.extend_globals({EXPLAINED: self})
        self._recording.opened(_Control())
        self._recording.loading(self._components)
        for handler in (
            OnProcessStart(on_start=lambda event, _: self._started(event)),
            OnProcessIO(on_stdout=self._printed, on_stderr=self._printed),
            OnProcessExit(on_exit=lambda event, _: self._ended(event)),
            OnShutdown(on_shutdown=[OpaqueFunction(function=self._close_at_the_end)]),
        ):
            context.register_event_handler(handler)

    def prepare(self, process: ResolvedProcess, description: Any) -> None:
        """``description``: upstream's, whose command and environment are final."""
        named = process._replace(process_name=description.final_name)
        spec = ProcessSpec(tuple(description.final_cmd), description.final_env)
        description.final_env.update(self._recording.prepared(named, spec).environment)

    def _started(self, event: Any) -> None:
        self._happened(ProcessStarted(event.process_name, event.pid))

    def _printed(self, event: Any) -> None:
        stream = "stderr" if event.from_stderr else "stdout"
        self._happened(ProcessOutput(event.process_name, stream, bytes(event.text)))  # type: ignore[arg-type]

    def _ended(self, event: Any) -> None:
        self._happened(ProcessExited(event.process_name, event.pid, event.returncode))

    def _happened(self, event: RunEvent) -> None:
        self._recording.happened(event)

    def _close_at_the_end(self, context: Any) -> None:
        context.add_completion_future(asyncio.get_running_loop().create_task(self._close()))

    async def _close(self) -> None:
        waited = 0.0
        while self._recording.running and waited < _LONGEST_END:
            await asyncio.sleep(INTERVAL)
            waited += INTERVAL
        await self._recording.closed()


class _Control:
    """What a recording may do to a launch of upstream's: say something."""

    def say(self, level: str, message: str) -> None:
        import logging

        from launch.logging import get_logger

        get_logger("launch").log(logging.getLevelName(level), message)

    def tell(self, event: RunEvent) -> None:
        """Nobody else watches."""

    def shut_down(self, reason: str) -> None:
        """A launch that explains refusals is ended by nobody but the user."""
