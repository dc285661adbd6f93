"""Asks a real DDS implementation who may do what: one process, many participants, one answer per attempt.

Two probes speak the same protocol: ``cyclone_probe.py`` (Cyclone DDS) and ``fastdds_probe/`` (Fast DDS).
A job is a file of tab-separated lines, carried out in order:

    domain N                        the DDS domain of the participants that follow
    participant LABEL DIRECTORY     with the six security files of DIRECTORY; "-": without security
    publish TOPIC, subscribe TOPIC  an endpoint of std_msgs/msg/String on the participant above
    run LONGEST QUIET               all publishers say their LABEL, all subscriptions listen, for LONGEST
                                    seconds or until nothing new was heard for QUIET (0: never)

and is answered with lines ``LABEL what detail result``: participant, publish and subscribe are
``allowed`` or ``refused``, ``heard`` tells the topic and what was said for the first time there.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

STARTUP_SECONDS = 60.0  # for a machine that does much else; only a hanging probe ever takes so long


@dataclass(frozen=True)
class Participant:
    """``directory`` is an enclave directory, ``None`` for a participant without security."""

    label: str
    directory: Path | None
    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        head = f"participant\t{self.label}\t{self.directory or '-'}"
        return [
            head,
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
    def parse(cls, output: str, log: str) -> Answers:
        participants: dict[str, bool] = {}
        endpoints: dict[tuple[str, str, str], bool] = {}
        heard = set()
        for line in output.splitlines():
            words = line.split("\t")
            if len(words) != 4:
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

    def speakers(self, listener: str, topic: str) -> set[str]:
        return {said for label, where, said in self.heard if label == listener and where == topic}


@dataclass(frozen=True)
class Probe:
    """One DDS implementation. ``environment`` is added to that of the test."""

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)

    def try_endpoints(self, domain: int, participants: Iterable[Participant]) -> Answers:
        """Create everything, talk to nobody."""
        with self._start(domain, participants, None) as process:
            output, log = process.communicate(timeout=STARTUP_SECONDS)
        assert process.returncode == 0, f"{self.name} probe ended with {process.returncode}\n{log}"
        return Answers.parse(output, log)

    def talk(
        self,
        domain: int,
        listener: Participant,
        talkers: Sequence[Participant],
        longest: float = 15.0,
        quiet: float = 2.0,
    ) -> tuple[Answers, Answers]:
        """Talkers in one process, the listener in another: answers of the listener, then of the talkers.

        ``quiet`` is how long the listener stays on after the last new voice. Let one of the talkers be
        honest: when that one is heard, silence of the others means something.
        """
        with (
            self._start(domain, talkers, (longest + STARTUP_SECONDS, 0.0)) as speaking,
            self._start(domain, [listener], (longest, quiet)) as listening,
        ):
            try:
                output, log = listening.communicate(timeout=longest + STARTUP_SECONDS)
            finally:
                _end(listening)
                _end(speaking)
            speaking_output, speaking_log = speaking.communicate(timeout=STARTUP_SECONDS)
        return Answers.parse(output, log), Answers.parse(speaking_output, speaking_log)

    def _start(
        self, domain: int, participants: Iterable[Participant], run: tuple[float, float] | None
    ) -> subprocess.Popen[str]:
        lines = [f"domain\t{domain}", *(line for participant in participants for line in participant.lines())]
        if run is not None:
            lines.append(f"run\t{run[0]}\t{run[1]}")
        with tempfile.NamedTemporaryFile("w", suffix=".job", delete=False) as job:
            job.write("\n".join(lines) + "\n")
        return subprocess.Popen(
            [*self.command, job.name],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **self.environment},
            start_new_session=True,
        )


def _end(process: subprocess.Popen[str]) -> None:
    """The probe and all it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
