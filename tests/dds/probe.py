"""Asks a real DDS implementation who may do what: many participants, one answer per attempt.

Two probes speak the same protocol: ``cyclone_probe.py`` (Cyclone DDS) and ``fastdds_probe/`` (Fast DDS).
A job is a file of tab-separated lines:

    domain N                        the DDS domain of all participants
    environment NAME VALUE          for the process of the next participant
    participant LABEL DIRECTORY     with the six security files of DIRECTORY; "-": without security
    publish TOPIC, subscribe TOPIC  an endpoint of std_msgs/msg/String on the participant above
    run SECONDS                     all publishers say their LABEL, all subscriptions listen

and is answered with lines ``LABEL what detail result``: participant, publish and subscribe are
``allowed`` or ``refused``, ``heard`` tells the topic and what was said for the first time there.
Each participant lives in a process of its own, as ROS processes do.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

LONGEST_SECONDS = 60.0  # for a machine that does much else; only a hanging probe ever takes so long


@dataclass(frozen=True)
class Participant:
    """``directory`` is an enclave directory, ``None`` for a participant without security."""

    label: str
    directory: Path | None
    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    environment: tuple[tuple[str, str], ...] = ()

    def lines(self) -> list[str]:
        return [
            *(f"environment\t{name}\t{value}" for name, value in self.environment),
            f"participant\t{self.label}\t{self.directory or '-'}",
            *(f"publish\t{topic}" for topic in self.publish),
            *(f"subscribe\t{topic}" for topic in self.subscribe),
        ]


@dataclass(frozen=True)
class Answers:
    """What DDS said. ``log`` is everything it wrote besides, for a failing test."""

    participants: Mapping[str, bool]
    endpoints: Mapping[tuple[str, str, str], bool]  # (label, "publish" or "subscribe", topic)
    heard: frozenset[tuple[str, str, str]]  # (label, topic, what was said)
    log: str = field(repr=False)

    @classmethod
    def parse(cls, output: str, log: str = "") -> Answers:
        participants: dict[str, bool] = {}
        endpoints: dict[tuple[str, str, str], bool] = {}
        heard = set()
        for line in output.splitlines(keepends=True):
            words = line.rstrip("\n").split("\t")
            if len(words) != 4 or not line.endswith("\n"):
                continue
            label, what, detail, result = words
            if what == "participant":
                participants[label] = result == "allowed"
            elif what in ("publish", "subscribe"):
                endpoints[label, what, detail] = result == "allowed"
            elif what == "heard":
                heard.add((label, detail, result))
        return cls(participants, endpoints, frozenset(heard), log)

    def may(self, label: str, verb: str, topic: str) -> bool:
        """An endpoint that could not even be tried, for want of a participant, was refused."""
        return self.endpoints.get((label, verb, topic), False)

    @property
    def voices(self) -> set[str]:
        """Everybody who was heard."""
        return {said for _, _, said in self.heard}


_ASSERTION_OF_FAST_DDS = "Assertion `receiving_list.size() > 0' failed"
"""In SecurityManager::encode_rtps_message of 2.9.1; seen on a busy machine after all answers were given."""


@dataclass(frozen=True)
class Probe:
    """One DDS implementation. ``crowd``: how many talkers beside an honest one it authenticates promptly."""

    name: str
    command: tuple[str, ...]
    crowd: int

    def try_endpoints(self, domain: int, participants: Iterable[Participant]) -> Answers:
        """Create everything, talk to nobody. Again where Fast DDS aborts on an assertion of its own."""
        everybody = tuple(participants)
        for _ in range(3):
            with self._running(domain, everybody) as run:
                run.process.wait(LONGEST_SECONDS)
                answers = run.answers()
            if _ASSERTION_OF_FAST_DDS not in answers.log:
                break
        assert run.process.returncode == 0, f"{self.name} probe ended badly\n{answers.log}"
        return answers

    def talk(
        self,
        domain: int,
        listener: Participant,
        talkers: Sequence[Participant],
        expected: Collection[str],
        settle: float = 2.0,
        environment: Mapping[str, str] | None = None,
    ) -> tuple[Answers, Answers]:
        """Let all talk: answers of the listener, then of the talkers.

        Ends ``settle`` seconds after all ``expected`` voices were heard, at the latest after a minute. Let
        one of the talkers be honest and expected: then the silence of the others means something.
        ``environment`` is added to the talkers' environment.
        """
        with (
            self._running(domain, talkers, LONGEST_SECONDS, environment) as talking,
            self._running(domain, [listener], LONGEST_SECONDS) as listening,
        ):
            listening.wait_for_voices(expected)
            time.sleep(settle)
            return listening.answers(), talking.answers()

    @contextlib.contextmanager
    def _running(
        self,
        domain: int,
        participants: Iterable[Participant],
        seconds: float | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> Iterator[_Run]:
        lines = [f"domain\t{domain}", *(line for participant in participants for line in participant.lines())]
        if seconds is not None:
            lines.append(f"run\t{seconds}")
        with TemporaryDirectory(prefix="dds-probe-") as name:
            folder = Path(name)
            (folder / "job").write_text("\n".join(lines) + "\n", encoding="utf-8")
            run = _Run.start([*self.command, str(folder / "job")], folder, environment or {})
            try:
                yield run
            finally:
                run.end()


@dataclass(frozen=True)
class _Run:
    """A probe at work; what it says goes to files, which can be read at any time."""

    process: subprocess.Popen[bytes]
    folder: Path

    @classmethod
    def start(cls, command: list[str], folder: Path, environment: Mapping[str, str]) -> _Run:
        with open(folder / "output", "wb") as output, open(folder / "log", "wb") as log:
            process = subprocess.Popen(
                command,
                stdout=output,
                stderr=log,
                env={**os.environ, **environment},
                start_new_session=True,
            )
        return cls(process, folder)

    def answers(self) -> Answers:
        output, log = (
            (self.folder / name).read_text(encoding="utf-8", errors="replace") for name in ("output", "log")
        )
        return Answers.parse(output, log)

    def wait_for_voices(self, expected: Collection[str]) -> None:
        end = time.monotonic() + LONGEST_SECONDS
        while time.monotonic() < end and not set(expected) <= self.answers().voices:
            time.sleep(0.1)

    def end(self) -> None:
        """The probe and all it started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
