"""Listeners of a recording while it grows. One of them, used by every launch, publishes recorded endpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.runtime.companion import LaunchControl
from enclave_launch.runtime.run_events import EndpointCreated, EndpointRefused, EndpointRequested, RunEvent
from nodl.record.assembly import RecordedNode
from nodl.record.lines import EndpointMade, Line
from nodl.record.requested import RequestedEndpoint, requested_endpoint

if TYPE_CHECKING:
    from enclave_launch.recording.recording import Recording


class Listener:
    """Told in the event loop, ``opened`` first, and does nothing of it: each overrides what it is interested in."""

    _launch: LaunchControl
    _recording: Recording

    def opened(self, launch: LaunchControl, recording: Recording) -> None:
        self._launch, self._recording = launch, recording

    def added(self, line: Line) -> None:
        """Receive ``line``, which is in the record already."""

    def happened(self, event: RunEvent) -> None:
        """Receive an event of the launch."""

    def looked(self) -> None:
        """Receive notice that the record was read again."""

    def closed(self) -> None:
        """Receive notice that every process has ended and every line was added."""


class EndpointEvents(Listener):
    """Recorded endpoints as events of the launch, each with the process and component that requested it."""

    def added(self, line: Line) -> None:
        if not isinstance(line, EndpointMade):
            return
        process, node = self._recording.record.node_of(line)
        requested = requested_endpoint(process, node, line)
        if requested is None or process.started is None:
            return
        name, pid, endpoint = process.started.process, process.started.pid, _endpoint(requested, node, line)
        if requested.granted:
            self._launch.tell(EndpointCreated(name, pid, endpoint))
        else:
            self._launch.tell(EndpointRefused(name, pid, endpoint, requested.error))


def _endpoint(requested: RequestedEndpoint, node: RecordedNode, line: EndpointMade) -> EndpointRequested:
    component = f"{node.component.package}/{node.component.plugin}" if node.component else ""
    return EndpointRequested(
        node.fqn or line.fqn,
        requested.kind,
        requested.final or requested.written,
        requested.written,
        requested.type,
        component,
    )
