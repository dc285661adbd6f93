"""The Cyclone DDS half of the probe; the job and its answers are described in ``probe.py``.

Run by path, as a process of its own: ``python cyclone_probe.py JOBFILE``. Each participant lives in a
forked process; together they would not do: Cyclone DDS 0.10 judges the endpoints of all participants of
one process by the permissions of the first.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

DEMO_NODES = Path(__file__).parents[2] / "fixtures" / "demo_ws" / "lib" / "demo_nodes"
sys.path.insert(0, str(DEMO_NODES))

from cyclonedds.core import DDSException  # noqa: E402
from cyclonedds.domain import Domain, DomainParticipant  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.qos import Policy, Qos  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from demo_rcl.messages import String  # noqa: E402
from demo_rcl.node import LOOPBACK_ONLY, RELIABLE  # noqa: E402
from demo_rcl.security import SecurityOptions  # noqa: E402


def answer(label: str, what: str, detail: str, result: str) -> None:
    """One write: the processes of a probe share their output."""
    os.write(sys.stdout.fileno(), f"{label}\t{what}\t{detail}\t{result}\n".encode())


class Participant:
    """Raises ``DDSException`` when DDS refuses it."""

    def __init__(self, label: str, directory: str, domain: int):
        self.label = label
        self._topics: dict[str, Topic[String]] = {}
        self._writers: list[DataWriter[String]] = []
        self._readers: dict[str, DataReader[String]] = {}
        self._heard: set[tuple[str, str]] = set()
        options = SecurityOptions(label, None if directory == "-" else Path(directory), "")
        properties = (Policy.Property(key, value) for key, value in options.properties().items())
        self.entity = DomainParticipant(domain, Qos(*properties))

    def publish(self, topic: str) -> bool:
        return self._try(topic, self._add_writer)

    def subscribe(self, topic: str) -> bool:
        return self._try(topic, self._add_reader)

    def _add_writer(self, topic: Topic[String]) -> None:
        self._writers.append(DataWriter(self.entity, topic, RELIABLE))

    def _add_reader(self, topic: Topic[String]) -> None:
        self._readers[topic.name] = DataReader(self.entity, topic, RELIABLE)

    def _try(self, name: str, create: Callable[[Topic[String]], None]) -> bool:
        try:
            topic = self._topics.get(name) or Topic(self.entity, name, String)
            self._topics[name] = topic
            create(topic)
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_NOT_ALLOWED_BY_SECURITY:
                raise
            return False
        return True

    def talk(self) -> None:
        for writer in self._writers:
            writer.write(String(self.label))

    def listen(self) -> list[tuple[str, str]]:
        """(topic, text) of what was heard for the first time."""
        said = {
            (topic, sample.data)
            for topic, reader in self._readers.items()
            for sample in reader.take(N=1000)
            if isinstance(sample, String)  # not the notice that a writer has gone
        }
        fresh = sorted(said - self._heard)
        self._heard |= said
        return fresh


def run(participant: Participant, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        participant.talk()
        for topic, text in participant.listen():
            answer(participant.label, "heard", topic, text)
        time.sleep(0.1)


@dataclass
class Job:
    """One participant and what it shall try."""

    label: str
    directory: str
    environment: dict[str, str]
    attempts: list[list[str]]


def carry_out(job: Job, domain: int) -> None:
    """In a process of its own."""
    os.environ.update(job.environment)
    keep = Domain(domain, LOOPBACK_ONLY)
    label = job.label
    try:
        participant = Participant(label, job.directory, domain)
    except DDSException as error:
        print(f"{label}: {error}", file=sys.stderr)
        answer(label, "participant", "-", "refused")
        return
    answer(label, "participant", "-", "allowed")
    for verb, *words in job.attempts:
        if verb == "run":
            run(participant, float(words[0]))
        else:
            allowed = participant.publish(*words) if verb == "publish" else participant.subscribe(*words)
            answer(label, verb, words[0], "allowed" if allowed else "refused")
    del keep


def split(lines: list[list[str]]) -> tuple[int, list[Job]]:
    """The domain, and a job for each participant; ``run`` is for all."""
    domain, jobs, environment = 0, list[Job](), dict[str, str]()
    for line in lines:
        if line[0] == "domain":
            domain = int(line[1])
        elif line[0] == "environment":
            environment[line[1]] = line[2]
        elif line[0] == "participant":
            jobs.append(Job(line[1], line[2], environment, []))
            environment = {}
        else:
            for job in jobs if line[0] == "run" else jobs[-1:]:
                job.attempts.append(line)
    return domain, jobs


def main(job_file: str) -> int:
    domain, jobs = split([line.split("\t") for line in Path(job_file).read_text().splitlines() if line])
    children = []
    for job in jobs:
        children.append(os.fork())
        if children[-1] == 0:
            carry_out(job, domain)
            os._exit(0)
    return max((os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0 for child in children), default=0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
