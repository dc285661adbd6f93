"""Compare, beside a launch, what runs in its DDS domains with the plan (``secure-launch --watch``).

A process of its own observes the domain (``graph.follow``), so that DDS stays out of the supervisor. That process
prints each graph as a line. Once a second the last graph is compared with the plan (``drift``).

What was announced is a fact at once. What discovery could still take back has to stand for ``settle`` seconds. What is
missing may still come: it is reported after ``absence`` seconds. As long as findings of one kind go by themselves the
system is still starting, and the time of those that are left begins again.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple

from enclave_addons.observation.drift.compare import Circumstances, Security, compare
from enclave_addons.observation.drift.expected import expected_in
from enclave_addons.observation.drift.finding import (
    DriftFinding,
    FindingCertainty,
    Level,
    finding_document,
    finding_text,
)
from enclave_addons.observation.graph.json_form import graph_from_document
from enclave_addons.observation.graph.model import Graph
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import RuntimeFailure
from enclave_launch.runtime.companion import LaunchCompanion, LaunchControl
from enclave_launch.runtime.run_events import ProcessStarted, RunEvent

Key = tuple[str, str, str, str]


class SettlingTimes(NamedTuple):
    """Seconds; ``longest``: reported then, whatever others of its kind do.

    50 secured processes that started at once on two cores with a load of 140 took more than two minutes to authenticate
    each other, one after another."""

    settle: float = 30.0
    absence: float = 120.0
    longest: float = 600.0

    def of(self, certainty: FindingCertainty) -> float:
        return {
            FindingCertainty.FACT: 0.0,
            FindingCertainty.WHEN_SETTLED: self.settle,
            FindingCertainty.ABSENCE: self.absence,
        }[certainty]


class Change(NamedTuple):
    """Differences that are new, and ``over``: those that were reported before and have ended."""

    new: tuple[DriftFinding, ...] = ()
    over: tuple[DriftFinding, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.new or self.over)


class Steady:
    """Takes all findings of each point in time, in order."""

    def __init__(self, patience: SettlingTimes | None = None) -> None:
        self._patience = patience or SettlingTimes()
        self._since: dict[Key, float] = {}
        self._reported: dict[Key, DriftFinding] = {}
        self._went: dict[str, float] = {}
        """Kind → when one of it was last over."""

    def at(self, now: float, findings: Iterable[DriftFinding]) -> Change:
        """Return what is to be reported at ``now``."""
        found = {each.key: each for each in findings}
        self._went.update({key[0]: now for key in self._since if key not in found})
        self._since = {key: self._since.get(key, now) for key in found}
        new = {
            key: each for key, each in found.items() if key not in self._reported and self._stands(now, each)
        }
        over = [self._reported.pop(key) for key in list(self._reported) if key not in found]
        self._reported.update(new)
        return Change(tuple(new.values()), tuple(over))

    def _stands(self, now: float, finding: DriftFinding) -> bool:
        wait, since = self._patience.of(finding.certainty), self._since[finding.key]
        begins = max(since, self._went.get(finding.kind.value, since))
        return now - begins >= wait or now - since >= max(wait, self._patience.longest)


# Ours first, before anything imports nodl (``enclave_common.own_packages``).
_FOLLOW = (
    "import sys, enclave_launch; from enclave_addons.observation.graph.follow import main; sys.exit(main())"
)
_INTERVAL = 1.0  # seconds between two comparisons
_LONGEST_START = 60.0  # of an observer, on a machine that does much else
_MOST_PARENTS = 64
_CANNOT_TELL = 4  # as secure-plan drift


class WatchOptions(NamedTuple):
    """Options of watching. ``security``, ``enclave_directory`` and ``enclaves_now`` (reads the keystore again): of a
    secured launch. ``report``: where findings go as JSON lines."""

    security: Security | None = None
    enclave_directory: Path | None = None
    accepted: tuple[str, ...] = ()
    report: Path | None = None
    patience: SettlingTimes = SettlingTimes()
    enclaves_now: Callable[[], Mapping[int, str]] | None = None


class DriftWatch(LaunchCompanion):
    """Compares the running domains with the plan during a launch. ``alarms``: how many there were; ``blind``: what was
    planned could not be seen at some time."""

    def __init__(self, plan: DryRun, options: WatchOptions) -> None:
        self._options = options
        self._domains = sorted({each.domain_id for each in plan.processes})
        self._expected = {domain: expected_in([plan], domain) for domain in self._domains}
        self._observers: dict[int, _Observer] = {}
        self._steady = {domain: Steady(options.patience) for domain in self._domains}
        self._launch: LaunchControl | None = None
        self._task: asyncio.Task[None] | None = None
        self._started: set[int] = set()
        self.alarms = 0
        self.blind = False

    def status(self, of_launch: int) -> int:
        """Return the launch's exit status; if that is 0, 1 after an alarm and 4 if the observer did not see enough."""
        return of_launch or (1 if self.alarms else _CANNOT_TELL if self.blind else 0)

    def opened(self, launch: LaunchControl) -> None:
        """Start observing; raises RuntimeFailure if the domain cannot be observed."""
        self._launch = launch
        try:
            for domain in self._domains:
                self._observers[domain] = _Observer(domain, self._options.enclave_directory)
        except RuntimeFailure:
            self._end_observers()
            raise
        self._task = asyncio.get_running_loop().create_task(self._watch())

    def happened(self, event: RunEvent) -> None:
        if isinstance(event, ProcessStarted):
            self._started.add(event.pid)

    async def closed(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        self._end_observers()

    async def _watch(self) -> None:
        while True:
            await asyncio.sleep(_INTERVAL)
            for domain in list(self._observers):
                self._compare(domain)

    def _compare(self, domain: int) -> None:
        observer = self._observers[domain]
        if observer.ended:
            del self._observers[domain]
            self._say(
                f"the observer of domain {domain} has exited, so drift is no longer seen: {observer.why}"
            )
            return
        graph, forged = observer.latest
        circumstances = Circumstances(
            self._options.security, self._options.accepted, _strangers(graph, self._started), forged
        )
        findings = compare(self._expected[domain], graph, circumstances, self._options.enclaves_now)
        change = self._steady[domain].at(time.monotonic(), findings)
        for each in change.new:
            self.alarms += each.level is Level.ALARM
            self.blind = self.blind or each.level is Level.CANNOT_TELL
            self._report("new", each)
        for each in change.over:
            self._report("over", each)

    def _report(self, event: str, finding: DriftFinding) -> None:
        self._say(f"drift{' is over' if event == 'over' else ''}: {finding_text(finding)}")
        if self._options.report is not None:
            row = {"time": f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}", "event": event}
            try:
                with self._options.report.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({**row, **finding_document(finding)}) + "\n")
            except OSError as error:
                self._say(f"--watch-report {self._options.report}: {error.strerror}")

    def _say(self, text: str) -> None:
        if self._launch is not None:
            self._launch.say("WARNING", text)

    def _end_observers(self) -> None:
        for observer in self._observers.values():
            observer.end()
        self._observers.clear()


class _Observer:
    """The process that observes, and its newest graph. :raises RuntimeFailure: it cannot observe."""

    def __init__(self, domain: int, enclave_directory: Path | None) -> None:
        directory = [f"--enclave-directory={enclave_directory}"] if enclave_directory else []
        # Its arguments name its enclave: no override may reach it.
        environment = {key: text for key, text in os.environ.items() if not key.startswith("ROS_SECURITY_")}
        self._process = subprocess.Popen(
            [sys.executable, "-c", _FOLLOW, str(domain), *directory],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the launch; it ends when we close its input
            env=environment,
        )
        self.latest: tuple[Graph, tuple[str, ...]] = (Graph(), ())
        self.ended = False
        self.why = ""
        self._first = threading.Event()
        self._errors: list[bytes] = []
        for work in (self._read, self._read_errors):
            threading.Thread(target=work, name="drift-watch", daemon=True).start()
        if not self._first.wait(_LONGEST_START) or self.ended:
            self.end()
            raise RuntimeFailure(f"--watch: domain {domain} cannot be observed: {self.why or 'no answer'}")

    def end(self) -> None:
        """Close the observer's input, which ends it; kill it after five seconds."""
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            fields = json.loads(line)
            self.latest = graph_from_document(fields["graph"]), tuple(fields["forged"])
            self._first.set()
        self._process.wait()
        self.why = b"".join(self._errors).decode(errors="replace").strip()
        self.ended = True
        self._first.set()

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._errors = [*self._errors[-20:], line]


def _strangers(graph: Graph, started: set[int]) -> frozenset[int]:
    """Return processes of this machine that are neither of the launch nor of a process that it started."""
    host = socket.gethostname()
    seen = {
        each.participant.pid
        for each in graph.processes
        if each.participant.pid is not None and each.participant.host == host
    }
    # A process that has ended has no lineage and belongs to no launch. A process of the launch has one of the launch's
    # processes as parent, or is in its session.
    lineages = {pid: set(_lineage(pid)) for pid in seen}
    ours = started | {os.getpid()}
    return frozenset(pid for pid, lineage in lineages.items() if lineage and not lineage & ours)


def _lineage(pid: int) -> Iterator[int]:
    """Yield the process, its session and its parents (``/proc/<pid>/stat``, proc(5))."""
    for _ in range(_MOST_PARENTS):
        try:
            fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
        except OSError:
            return
        parent, session = int(fields[1]), int(fields[3])
        yield pid
        yield session
        if parent <= 1:
            return
        pid = parent
