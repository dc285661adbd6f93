"""A refused endpoint or node, explained within a second: who, in which enclave, what, why, and the patch that cures.

Name, kind and node come from the arguments of the refused call, never from a text. Containers and lifecycle nodes live
on after a refusal and nothing exits: explanations do not depend on how a process ends. Listens to a recording; reads
the manifest that it would patch.
"""

from __future__ import annotations

import time
from collections import deque
from typing import NamedTuple

from enclave_addons.recording.grants import WORDS, Description, Need, PlannedGrants
from enclave_addons.recording.learning import new_run
from enclave_addons.recording.reasons import MIXED_MIDDLEWARES, NOT_AS_PLANNED, Cause, cause_of
from enclave_addons.recording.record.assembly import RecordedNode, RecordedProcess
from enclave_addons.recording.record.lines import EndpointMade, Initialised, Line, NodeMade
from enclave_addons.recording.record.requested import REFUSED, EndpointRole, RequestedEndpoint, role_of
from enclave_addons.recording.recording import Listener, Recording
from enclave_addons.recording.remedies import Patch, Remedies
from enclave_common.files import text_or_nothing
from enclave_common.terminal import printable
from enclave_common.words import some_of
from enclave_launch.admission.middleware import ZENOH
from enclave_launch.plan import LaunchPlan
from enclave_launch.runtime.run_events import ProcessOutput, RunEvent

_PATIENCE = 0.3
"""Seconds to wait for what a middleware prints about a participant that was not made: it goes another way."""
_LAST_LINES = 40
_NAMES = 12  # named in an explanation


class Denial(NamedTuple):
    """One endpoint that was refused. ``granted``: the plan allows it all the same, so the reason is elsewhere."""

    process: str
    need: Need
    endpoint: RequestedEndpoint
    described: Description
    granted: bool
    patch: Patch | None
    cause: Cause | None = None
    silent: bool = False
    """On Zenoh: the node got no error, its messages are dropped."""
    unseen: tuple[str, ...] = ()
    """All that ``--also unseen`` grants, this endpoint among it."""
    denied: bool = False
    """The policy file forbids it."""

    @property
    def text(self) -> str:
        return "\n".join(printable(line) for line in self._lines())

    def _lines(self) -> list[str]:
        need, endpoint = self.need, self.endpoint
        head = (
            f"refused: node {need.node} may not {WORDS[need.operation]} {need.name} (enclave {need.enclave})"
        )
        lines = [head, f"  requested as '{endpoint.written}', type {endpoint.type or 'not known'}"]
        if self.granted:
            why = "; ".join(endpoint.error) or "no reason was given"
            lines.append(f"  the plan grants it, so that it is refused for another reason: {why}")
            cause = self.cause or NOT_AS_PLANNED
            lines.append(f"  {'' if self.cause else 'it may be that '}{cause.what}; {cause.remedy}")
            return lines
        if self.silent:
            lines.append("  on Zenoh nothing fails: the router drops all of it without an error")
        lines.append(f"  the node is described by {self.described.text}; which does not request it")
        if self.unseen:
            lines.append(
                f"  other descriptions of the node have it; --also unseen grants {some_of(self.unseen, _NAMES)}"
            )
        if self.denied:
            lines.append("  a DENY of the policy file removes it; remove that first")
        elif self.patch is None:
            lines.append("  no single change was found that allows it; describe it in a manifest of the node")
        else:
            lines.append(f"  this allows it, and nothing else; {self.patch.use}:")
            lines += [f"    {line}" for line in self.patch.diff.splitlines()]
        return lines


class NotJoined(NamedTuple):
    """A process or node that could not take part in DDS at all."""

    process: str
    node: str
    enclave: str
    cause: Cause | None
    texts: tuple[str, ...]

    @property
    def text(self) -> str:
        who = f"node {self.node} of {self.process}" if self.node else self.process
        head = f"{who} (enclave {self.enclave}) could not join DDS"
        if self.cause is not None:
            return printable(f"{head}: {self.cause.what}; {self.cause.remedy} (said: {self.cause.said})")
        said = "; ".join(self.texts) or "no reason was given; see its output"
        return printable(f"{head}: {said}")


def explaining(launch_file: str, distro: str, plan: LaunchPlan | None, *, optional: bool) -> Recording:
    """Return a recording of a launch that explains what DDS refuses.

    Args:
        launch_file: The launch file, for the record.
        distro: The ROS distribution, for the record.
        plan: The plan of a secured launch. Without one every endpoint is an event, and nothing is explained.
        optional: The launch goes on if it cannot be recorded, and reports that.
    """
    run = new_run(launch_file, distro, "none", secured=plan is not None)
    return Recording(run, [] if plan is None else [Explainer(plan)], optional=optional)


class Explainer(Listener):
    """Follows one recording of a secured launch; ``denials`` and ``not_joined`` are what it reported."""

    def __init__(self, plan: LaunchPlan) -> None:
        self.denials: list[Denial] = []
        self.not_joined: list[NotJoined] = []
        self._grants = PlannedGrants(plan)
        self._remedies = Remedies(plan, self._grants)
        self._on_zenoh = {item.process.process_name for item in plan.processes if item.middleware == ZENOH}
        self._printed: dict[str, deque[str]] = {}
        self._waiting: list[tuple[float, RecordedProcess, str, tuple[str, ...]]] = []
        self._explained_already: set[Need] = set()
        self._middlewares: set[str] = set()

    def added(self, line: Line) -> None:
        if isinstance(line, EndpointMade) and (line.rc == REFUSED or (line.rc == 0 and self._on_zenoh)):
            self._endpoint(line, *self._recording.record.node_of(line))
        elif isinstance(line, NodeMade) and line.rc == REFUSED:
            process, _ = self._recording.record.node_of(line)
            # One that fails because one of its own endpoints was refused has been explained by that.
            if not any(endpoint.rc == REFUSED for endpoint in process.node(line.node).endpoints):
                self._waiting.append((time.monotonic() + _PATIENCE, process, line.name, line.error))
        elif isinstance(line, Initialised) and line.rc == 0:
            self._middleware(line)
        elif isinstance(line, Initialised) and line.rc == REFUSED:
            joining = self._recording.record.process_of(line.pid)
            if joining is not None:
                self._waiting.append((time.monotonic() + _PATIENCE, joining, "", line.error))

    def happened(self, event: RunEvent) -> None:
        if isinstance(event, ProcessOutput):
            kept = self._printed.setdefault(event.name, deque(maxlen=_LAST_LINES))
            kept.extend(event.data.decode(errors="replace").splitlines())

    def _said(self, process: str) -> list[str]:
        """Return the last lines of a process: of its security log, if it writes one, and of its output."""
        log = self._recording.security_logs.get(process)
        written = text_or_nothing(log).splitlines()[-_LAST_LINES:] if log is not None else []
        return [*written, *self._printed.get(process, ())]

    def record_read(self) -> None:
        self._report_waiting(time.monotonic())

    def closed(self) -> None:
        self._report_waiting(float("inf"))

    def _middleware(self, line: Initialised) -> None:
        """Warn once of two middlewares: what they cannot say to each other shows as silence, not as an error."""
        known = set(self._middlewares)
        self._middlewares.add(line.middleware)
        if line.middleware and known and line.middleware not in known and len(self._middlewares) == 2:
            said, why = " and ".join(sorted(self._middlewares)), MIXED_MIDDLEWARES
            self._launch.say("WARNING", f"processes of this launch use {said}: {why.what}; {why.remedy}")

    def _endpoint(self, line: EndpointMade, process: RecordedProcess, node: RecordedNode) -> None:
        """Explain one that was refused, or made (``rc`` 0) and refused by a Zenoh router without a word to the node."""
        silent, name = line.rc == 0, _name(process)
        if role_of(line) is EndpointRole.PART_OF_ACTION or (silent and name not in self._on_zenoh):
            return  # of an action: its own line follows
        found = self._grants.need(process, node, line)
        if found is None or found[0] in self._explained_already:
            return
        need, endpoint = found
        granted = bool(self._grants.granted(node, line, need))
        described = self._grants.described(process, node)
        if silent and granted:
            return
        self._explained_already.add(need)
        patch = None if granted else self._remedies.patch(need, endpoint, described)
        cause = cause_of((*endpoint.error, *self._said(name))) if granted else None
        unseen = () if granted else self._remedies.unseen(need, described)
        denied = self._grants.denied(need)
        self._report(Denial(name, need, endpoint, described, granted, patch, cause, silent, unseen, denied))

    def _report_waiting(self, now: float) -> None:
        due = [each for each in self._waiting if each[0] <= now]
        self._waiting = [each for each in self._waiting if each[0] > now]
        for _, process, node, error in due:
            name = _name(process)
            cause = cause_of((*error, *reversed(self._said(name))))
            self._report(NotJoined(name, node, self._grants.enclave_of(process) or "none", cause, error))

    def _report(self, what: Denial | NotJoined) -> None:
        if isinstance(what, Denial):
            self.denials.append(what)
        else:
            self.not_joined.append(what)
        self._launch.say("ERROR", what.text)


def _name(process: RecordedProcess) -> str:
    return process.started.process if process.started else f"process {process.pid}"
