"""The Cyclone DDS half of the probe; the job and its answers are described in ``probe.py``.

Run by path, as a process of its own: ``python cyclone_probe.py JOBFILE``. Each participant lives in a
forked process: Cyclone DDS 0.10 judges the endpoints of all participants of one process by the
permissions of the first.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
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
    print(label, what, detail, result, sep="\t", flush=True)


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


def run(participant: Participant, longest: float, quiet: float) -> None:
    start = last_news = time.monotonic()
    any_news = False
    while time.monotonic() - start < longest:
        participant.talk()
        for topic, text in participant.listen():
            answer(participant.label, "heard", topic, text)
            last_news, any_news = time.monotonic(), True
        if quiet and any_news and time.monotonic() - last_news > quiet:
            return
        time.sleep(0.1)


def carry_out(lines: list[list[str]], domain: int) -> None:
    """One participant, alone in its process."""
    keep = Domain(domain, LOOPBACK_ONLY)
    (_, label, directory), *rest = lines
    try:
        participant = Participant(label, directory, domain)
    except DDSException as error:
        print(f"{label}: {error}", file=sys.stderr)
        answer(label, "participant", "-", "refused")
        return
    answer(label, "participant", "-", "allowed")
    for verb, *words in rest:
        if verb == "run":
            run(participant, float(words[0]), float(words[1]))
        else:
            allowed = participant.publish(*words) if verb == "publish" else participant.subscribe(*words)
            answer(label, verb, words[0], "allowed" if allowed else "refused")
    del keep


def split(job: list[list[str]]) -> tuple[int, list[list[list[str]]]]:
    """The domain, and for each participant its lines; ``run`` is for all."""
    domain, groups = 0, list[list[list[str]]]()
    for line in job:
        if line[0] == "domain":
            domain = int(line[1])
        elif line[0] == "participant":
            groups.append([line])
        elif line[0] == "run":
            groups = [[*group, line] for group in groups]
        else:
            groups[-1].append(line)
    return domain, groups


def main(job_file: str) -> int:
    domain, groups = split([line.split("\t") for line in Path(job_file).read_text().splitlines() if line])
    children = []
    for lines in groups:
        children.append(os.fork())
        if children[-1] == 0:
            carry_out(lines, domain)
            sys.stdout.flush()
            os._exit(0)
    return max((os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0 for child in children), default=0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
