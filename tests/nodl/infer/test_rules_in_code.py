"""Rules and parameters in code beside those of a launch: the permissions are for the names that real rclpy gives."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from enclave_launch.flow import resolve
from enclave_launch.options import ResolveOptions
from tests.dds.conftest import domain_id
from tests.recording.conftest import rclpy_python

__all__ = ["domain_id"]

PROGRAM = """#!/usr/bin/python3
import json
import sys
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Empty

rclpy.init({init})
topics = []
services = []

def use(node):
    for name in ('a', 'b', 'c', '~/d'):
        topics.append(node.create_publisher(String, name, 10).topic_name)
    for name in ('p', 'q'):
        value = node.declare_parameter(name, 'default_' + name).value
        topics.append(node.create_publisher(String, value, 10).topic_name)
    for name in ('a', 's'):
        node.create_service(Empty, name, lambda q, r: r)
        services.append(node.resolve_service_name(name))

{nodes}
json.dump([topics, services], sys.stdout)
"""
NODES = {
    "plain": "",
    "rule": "cli_args=['--ros-args', '-r', 'a:=b']",
    "chain": "cli_args=['--ros-args', '-r', 'a:=b', '-r', 'b:=c', '-r', 'c:=a']",
    "kinds": "cli_args=['--ros-args', '-r', 'rostopic://a:=only_topics', '-r', 'rosservice://s:=only_services']",
    "name": "cli_args=['--ros-args', '-r', '__node:=own', '-r', '__ns:=/deep', '-r', 'own:a:=x', '-r', 'name:b:=y']",
    "words": "cli_args=['-r', 'a:=b', '--ros-args', '-r', 'c:=d', '--', '-r', '__node:=x']",
    "parameter": "cli_args=['--ros-args', '-p', 'p:=p_of_code', '-r', '__node:=o', '-p', 'x:q:=no']",
    "override": "parameter_overrides=[Parameter('p', value='p_of_code')], cli_args=['--ros-args', '-p', 'p:=weaker']",
    "deaf": "use_global_arguments=False, cli_args=['--ros-args', '-r', 'a:=b', '-p', 'q:=r']",
}
INITS = {
    "the node listens to the launch": "",
    "the code has arguments for all nodes": "args=['--ros-args', '-r', 'a:=in', '-r', 'c:=code', '-p', 'q:=in_code']",
}
RULES = {
    "a": "launch_a", "b": "launch_b", "p_of_launch": "moved_p", "p_of_code": "moved_too", "s": "t", "in": "again",
}  # fmt: skip
PARAMETERS = {"p": "p_of_launch", "q": "q_of_launch"}
BUILT_IN = {
    "rosout", "parameter_events", "describe_parameters", "get_parameter_types", "get_parameters", "list_parameters",
    "set_parameters", "set_parameters_atomically", "get_type_description",
}  # fmt: skip


@pytest.fixture
def prefix(tmp_path: Path, init: str) -> Path:
    """An install prefix with ``demo/program``, in which each of ``NODES`` has a namespace of its own."""
    nodes = (
        f"use(Node({name!r}, namespace='/of_{name}'{', ' * bool(more)}{more}))"
        for name, more in NODES.items()
    )
    index = tmp_path / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "demo").touch()
    program = tmp_path / "lib/demo/program"
    program.parent.mkdir(parents=True)
    program.write_text(PROGRAM.replace("{init}", INITS[init]).replace("{nodes}", "\n".join(nodes)))
    program.chmod(0o755)
    return tmp_path


def real_names(prefix: Path, domain_id: int) -> tuple[set[str], set[str]]:
    """The topics and services that rclpy makes."""
    words = [word for pair in RULES.items() for word in ("-r", ":=".join(pair))]
    words += [word for pair in PARAMETERS.items() for word in ("-p", ":=".join(pair))]
    local = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(domain_id)}
    done = subprocess.run(
        [str(rclpy_python("jazzy")), str(prefix / "lib/demo/program"), "--ros-args", *words],
        env={**os.environ, **local, "ROS_LOG_DIR": str(prefix / "log")},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    topics, services = json.loads(done.stdout)
    return set(topics), set(services)


def granted_names(prefix: Path) -> tuple[set[str], set[str]]:
    """What the enclave may publish and serve, less what every node has."""
    rules = "".join(f'<remap from="{a}" to="{b}"/>' for a, b in RULES.items())
    parameters = "".join(f'<param name="{a}" value="{b}"/>' for a, b in PARAMETERS.items())
    file = prefix / "test.launch.xml"
    file.write_text(f'<launch><node pkg="demo" exec="program">{rules}{parameters}</node></launch>')
    plan = resolve(file, options=ResolveOptions(prefixes=(prefix,), distro="jazzy"))
    assert not plan.problems
    (enclave,) = plan.derived.reasons.values()
    found: dict[str, set[str]] = {"publish": set(), "reply": set()}
    for rule in enclave:
        if rule.expression.rpartition("/")[2] not in BUILT_IN:
            found.setdefault(rule.operation.value, set()).add(rule.expression)
    return found["publish"], found["reply"]


@pytest.mark.dds
@pytest.mark.parametrize("init", INITS)
def test_the_names_are_those_that_rclpy_gives(
    prefix: Path, domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("AMENT_PREFIX_PATH", "ROS_DISTRO", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)
    topics, services = real_names(prefix, domain_id)
    assert len(topics) > 40
    granted_topics, granted_services = granted_names(prefix)
    assert (granted_topics - topics, topics - granted_topics) == (set(), set())
    assert (granted_services - services, services - granted_services) == (set(), set())
