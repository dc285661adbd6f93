"""The examples of the design articles, from NoDL manifests to policies: "Security usage of NoDL" and
"ROS 2 Security Enclaves" (whose keystore trees are tested with the assignment of enclaves)."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import EnclaveScope
from enclave_launch.enclave import assign_enclave
from enclave_launch.policy import DerivedPolicy, derive_policy
from enclave_launch.policy.running_node import node_of_process
from enclave_launch.process import (
    UNSPECIFIED_NODE_NAME,
    EnclaveRequest,
    RemapRule,
    ResolvedProcess,
)
from keystore.formats.policy_xml import policy_xml
from nodl.lookup import ManifestLookup
from tests.programs import install_package

MANIFEST = """\
<interface version="1">
  <node name="/talker" executable="talker">
    <topic name="chatter" type="std_msgs/msg/String" role="publisher"/>
  </node>
  <node name="/listener" executable="listener">
    <topic name="chatter" type="std_msgs/msg/String" role="subscription"/>
  </node>
</interface>
"""


@pytest.fixture
def prefix(tmp_path: Path) -> str:
    share = install_package(tmp_path, "demo_nodes_cpp")
    (share / "demo_nodes_cpp.nodl.xml").write_text(MANIFEST)
    return str(tmp_path)


def process(
    executable: str,
    *,
    name: str | None = None,
    namespace: str | None = None,
    remap: tuple[str, str] | None = None,
    enclave: EnclaveRequest | None = None,
) -> ResolvedProcess:
    """As evaluation would give it for a node of demo_nodes_cpp."""
    location = SourceLocation("example.launch.py", 7, "node")
    cmd = [executable, "--ros-args"]
    cmd += ["-r", f"__node:={name}"] if name else []
    cmd += ["-r", f"__ns:={namespace}"] if namespace else []
    cmd += ["-r", ":=".join(remap)] if remap else []
    return ResolvedProcess(
        number=1,
        kind="node",
        package="demo_nodes_cpp",
        executable=executable,
        process_name=f"{executable}-1",
        name=name or UNSPECIFIED_NODE_NAME,
        namespace=namespace,
        fqn=f"{namespace or ''}/{name or UNSPECIFIED_NODE_NAME}",
        cmd=tuple(cmd),
        remaps=(RemapRule(*remap, location, len(cmd) - 1),) if remap else (),
        parameters={},
        environment={},
        enclave=enclave or EnclaveRequest(),
        location=location,
    )


def derive(
    prefix: str, *processes: ResolvedProcess, scope: EnclaveScope = EnclaveScope.NAMESPACE
) -> DerivedPolicy:
    nodes = []
    for each in processes:
        (interface,) = ManifestLookup([prefix]).find("demo_nodes_cpp", executable=each.executable).found
        assignment = assign_enclave(each, scope, interface.name)
        assert assignment
        nodes.append(node_of_process(each, interface, assignment.path, "node"))
    return derive_policy(nodes, distro="humble")


def declared(derived: DerivedPolicy) -> dict[str, list[str]]:
    return {
        path: [
            f"{rule.operation.value} {rule.expression}"
            for rule, reasons in rules.items()
            if any(reason.origin == "declared" for reason in reasons)
        ]
        for path, rules in derived.reasons.items()
    }


def test_the_launch_file_of_the_nodl_article(prefix: str) -> None:
    """talker as mouth and listener as ear in namespace tester, chatter remapped to blather."""
    blather = ("chatter", "blather")
    mouth = process("talker", name="mouth", namespace="/tester", remap=blather)
    ear = process("listener", name="ear", namespace="/tester", remap=blather)
    derived = derive(prefix, mouth, ear, scope=EnclaveScope.NODE)
    assert declared(derived) == {
        "/tester/mouth": ["publish /tester/blather"],
        "/tester/ear": ["subscribe /tester/blather"],
    }
    assert derived.problems == ()


def test_a_name_that_launch_does_not_know_comes_from_the_manifest(prefix: str) -> None:
    """``/foo/<node_name_unspecified>`` and ``/<node_name_unspecified>`` of the article."""
    derived = derive(prefix, process("talker", namespace="/foo"), process("listener"))
    fqns = {path: [node.fqn for node in nodes] for path, nodes in derived.nodes.items()}
    assert fqns == {"/": ["/foo/talker", "/listener"]}
    assert declared(derived) == {"/": ["publish /foo/chatter", "subscribe /chatter"]}


ENCLAVES = {
    "unqualified enclave path": (
        (process("talker"), process("listener")),
        {"/": ["publish /chatter", "subscribe /chatter"]},
    ),
    "pushed unqualified enclave path": (
        (process("talker"), process("listener", namespace="/foo", enclave=EnclaveRequest(scope="/foo"))),
        {"/": ["publish /chatter"], "/foo": ["subscribe /foo/chatter"]},
    ),
    "relatively pushed qualified enclave path": (
        (process("listener", namespace="/foo", enclave=EnclaveRequest("bar", "/foo")),),
        {"/foo/bar": ["subscribe /foo/chatter"]},
    ),
    "fully qualified enclave path": (
        (process("listener", namespace="/foo", enclave=EnclaveRequest("/bar", "/foo")),),
        {"/bar": ["subscribe /foo/chatter"]},
    ),
}


@pytest.mark.parametrize("example", ENCLAVES)
def test_the_four_examples_of_the_enclaves_article(prefix: str, example: str) -> None:
    processes, expected = ENCLAVES[example]
    assert declared(derive(prefix, *processes)) == expected


def test_the_policy_of_the_nodl_article_as_it_is_written(prefix: str) -> None:
    mouth = process("talker", name="mouth", namespace="/tester", remap=("chatter", "blather"))
    text = policy_xml(derive(prefix, mouth, scope=EnclaveScope.NODE).policy).decode()
    services = "\n".join(
        f"            <service>/tester/mouth/{name}</service>"
        for name in (
            *("describe_parameters", "get_parameter_types", "get_parameters"),
            *("list_parameters", "set_parameters", "set_parameters_atomically"),
        )
    )
    assert (
        text
        == f"""\
<?xml version="1.0" encoding="UTF-8"?>
<policy version="0.2.0">
  <enclaves>
    <enclave path="/tester/mouth">
      <profiles>
        <profile ns="/tester" node="mouth">
          <topics publish="ALLOW">
            <topic>/parameter_events</topic>
            <topic>/rosout</topic>
            <topic>/tester/blather</topic>
          </topics>
          <topics subscribe="ALLOW">
            <topic>/parameter_events</topic>
          </topics>
          <services reply="ALLOW">
{services}
          </services>
        </profile>
      </profiles>
    </enclave>
  </enclaves>
</policy>
"""
    )
