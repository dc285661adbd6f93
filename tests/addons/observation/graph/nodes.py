"""Programs written for the purpose, on each DDS implementation, that make what they are told to.

``cyclone_nodes.py`` and ``fastdds_nodes.cpp`` read commands from standard input and answer each with ``ok`` and the
GUID of their participant:

    node FQN                        what follows belongs to this node
    writer TOPIC TYPE [QUALITY]     DDS names; ``best_effort``, ``transient_local``
    reader TOPIC TYPE [QUALITY]
    remove writer|reader TOPIC
    list                            publish the list of nodes on ``ros_discovery_info``, as rmw does after a change
    end
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple

from enclave_addons.observation.graph.cyclone import CycloneObserver
from enclave_addons.observation.graph.model import Graph

LONGEST_SECONDS = 60.0  # for a machine that does much else
LOOPBACK = {"ROS_LOCALHOST_ONLY": "1"}

STRING = "std_msgs::msg::dds_::String_"


def topic(name: str, *, writes: bool, type_name: str = STRING, quality: str = "") -> list[str]:
    return [f"{'writer' if writes else 'reader'} rt{name} {type_name} {quality}"]


def service(name: str, *, serves: bool, type_name: str = "std_srvs::srv::dds_::Trigger") -> list[str]:
    request, reply = ("reader", "writer") if serves else ("writer", "reader")
    return [f"{request} rq{name}Request {type_name}_Request_", f"{reply} rr{name}Reply {type_name}_Response_"]


def action(name: str, *, serves: bool) -> list[str]:
    own = "example_interfaces::action::dds_::Fibonacci"
    below = f"{name}/_action"
    sends = "writer" if serves else "reader"
    return [
        *service(f"{below}/send_goal", serves=serves, type_name=f"{own}_SendGoal"),
        *service(f"{below}/get_result", serves=serves, type_name=f"{own}_GetResult"),
        *service(f"{below}/cancel_goal", serves=serves, type_name="action_msgs::srv::dds_::CancelGoal"),
        f"{sends} rt{below}/feedback {own}_FeedbackMessage_",
        f"{sends} rt{below}/status action_msgs::msg::dds_::GoalStatusArray_ transient_local",
    ]


class Program:
    """One process. ``tell`` returns when all commands are carried out; ``guid`` is known then."""

    def __init__(
        self, command: tuple[str, ...], domain: int, enclave: str, gid_size: int, *more: str
    ) -> None:
        self.process = subprocess.Popen(
            [*command, str(domain), enclave, str(gid_size), *more],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ},
        )
        self.guid = ""

    @property
    def pid(self) -> int:
        return self.process.pid

    def tell(self, *commands: str) -> Program:
        assert self.process.stdin is not None and self.process.stdout is not None
        for line in commands:
            self.process.stdin.write(f"{line}\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline().split()
            assert answer[:1] == ["ok"], f"{line}: the program ended"
            self.guid = answer[1]
        return self

    def end(self) -> None:
        if self.process.stdin is not None and not self.process.stdin.closed:
            self.process.stdin.close()  # the program reads to its end
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Implementation(NamedTuple):
    name: str
    command: tuple[str, ...]


def wait_for(observer: CycloneObserver, expected: Callable[[Graph], bool], *, past: bool = False) -> Graph:
    """The first graph that is as ``expected``; after a minute the last one, for the test to say what is wrong."""
    end = time.monotonic() + LONGEST_SECONDS
    while True:
        observer.poll()
        graph = observer.graph(past=past)
        if expected(graph) or time.monotonic() > end:
            return graph
        time.sleep(0.05)
