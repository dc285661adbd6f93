"""The enclave vocabulary in real launch: XML, YAML and Python, with nobody else disturbed."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.addons.ros2.conftest import Workspace

pytestmark = pytest.mark.real_launch

# Visits a launch file with upstream's engine up to the start of each process, and prints what our extension
# sees.
VISIT = """
import json, os, sys
import stand_ins
stand_ins.install()
import launch, launch.actions
from launch.launch_description_sources import AnyLaunchDescriptionSource
import enclave_addons.ros2.attributes as attributes
from enclave_addons.ros2.session import KEY
from enclave_addons.ros2.node_action import EnclaveNodeActionExtension
from enclave_addons.ros2.observation import observe_node
from enclave_launch.runtime.gate import StartAdditions

seen = []
def look(self, context, ros_specific_arguments, node_action):
    process = observe_node(node_action, context, ros_specific_arguments)
    seen.append({"fqn": process.fqn, "kind": process.kind, "attribute": process.enclave.attribute,
                 "scope": process.enclave.scope, "argument": process.enclave.argument,
                 "remaps": [[rule.source, rule.target] for rule in process.remaps],
                 "cmd": process.cmd, "parameters": dict(process.parameters), "name": process.process_name})
    return [], ros_specific_arguments
EnclaveNodeActionExtension.prepare_for_execute = look

service = launch.LaunchService(noninteractive=True)
class Session:
    enter = staticmethod(lambda process: StartAdditions())
service.context.extend_globals({KEY: Session()})
service.include_launch_description(launch.LaunchDescription([
    launch.actions.IncludeLaunchDescription(AnyLaunchDescriptionSource(sys.argv[1]))]))
status = service.run()
print(json.dumps({"status": status, "seen": seen}))
"""


def visited(workspace: Workspace, name: str, text: str) -> list[dict[str, Any]]:
    result = workspace.python(VISIT, str(workspace.add(name, text)))
    told = json.loads(result.stdout.splitlines()[-1])
    assert told["status"] == 0, result.stdout
    seen: list[dict[str, Any]] = told["seen"]
    return seen


def enclaves(seen: list[dict[str, Any]]) -> list[tuple[str, str | None, str | None]]:
    return [(item["fqn"], item["attribute"], item["scope"]) for item in seen]


XML = """
<launch>
  <arg name="where" default="deep"/>
  <node exec="/bin/true" name="a"/>
  <node exec="/bin/true" name="b" enclave="$(var where)/b"/>
  <group>
    <push_ros_namespace namespace="robot"/>
    <node exec="/bin/true" name="c"/>
    <node_container exec="/bin/true" name="d" namespace="" enclave="/box"/>
    <executable cmd="/bin/true" enclave="/tool"/>
    <group>
      <push_ros_enclave enclave="arm"/>
      <node exec="/bin/true" name="e"/>
    </group>
    <group>
      <push_ros_namespace namespace="left" enclave="sinister"/>
      <node exec="/bin/true" name="f" ros_args="--enclave /mine"/>
    </group>
  </group>
  <node exec="/bin/true" name="g"/>
</launch>
"""

YAML = """
launch:
- arg: {name: where, default: deep}
- node: {exec: /bin/true, name: a}
- node: {exec: /bin/true, name: b, enclave: $(var where)/b}
- group:
  - push_ros_namespace: {namespace: robot}
  - node: {exec: /bin/true, name: c}
  - node_container: {exec: /bin/true, name: d, namespace: '', enclave: /box}
  - executable: {cmd: /bin/true, enclave: /tool}
  - group:
    - push_ros_enclave: {enclave: arm}
    - node: {exec: /bin/true, name: e}
  - group:
    - push_ros_namespace: {namespace: left, enclave: sinister}
    - node: {exec: /bin/true, name: f, ros_args: --enclave /mine}
- node: {exec: /bin/true, name: g}
"""

PYTHON = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import ComposableNodeContainer, Node, PushRosEnclave, PushRosNamespace

def node(name, **options):
    return Node(executable="/bin/true", name=name, **options)

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("where", default_value="deep"),
        node("a"),
        node("b", enclave=[LaunchConfiguration("where"), "/b"]),
        GroupAction([
            PushRosNamespace("robot"),
            node("c"),
            ComposableNodeContainer(executable="/bin/true", name="d", namespace="", enclave="/box"),
            ExecuteProcess(cmd=["/bin/true"], enclave="/tool"),
            GroupAction([PushRosEnclave("arm"), node("e")]),
            GroupAction([PushRosNamespace("left", enclave="sinister"), node("f", ros_arguments=["--enclave",
            "/mine"])]),
        ]),
        node("g"),
    ])
"""

EXPECTED = [
    ("<node_namespace_unspecified>/a", None, None),
    ("<node_namespace_unspecified>/b", "deep/b", None),
    ("/robot/c", None, "/robot"),
    ("/robot/d", "/box", "/robot"),
    ("/robot/e", None, "/robot/arm"),
    ("/robot/left/f", None, "/robot/sinister"),
    ("<node_namespace_unspecified>/g", None, None),
]


@pytest.mark.parametrize(
    ("name", "text"),
    [("t.launch.xml", XML), ("t.launch.yaml", YAML), ("t.launch.py", PYTHON)],
    ids=["XML", "YAML", "Python"],
)
def test_attribute_and_scope(name: str, text: str, workspace: Workspace) -> None:
    seen = visited(workspace, name, text)
    assert enclaves(seen) == EXPECTED
    assert [item["argument"] for item in seen] == [None] * 5 + ["/mine", None]
    assert [item["kind"] for item in seen if item["kind"] != "node"] == ["container"]


def test_what_is_observed_of_a_node(workspace: Workspace) -> None:
    (seen,) = visited(
        workspace,
        "t.launch.xml",
        """<launch>
          <set_remap from="/global" to="/g"/>
          <node exec="/bin/true" name="n" namespace="/ns" args="plain">
            <remap from="chatter" to="news"/>
            <param name="use_sim_time" value="true"/>
          </node>
        </launch>""",
    )
    assert seen["remaps"] == [["/global", "/g"], ["chatter", "news"]]
    assert seen["parameters"] == {"use_sim_time": True}
    assert seen["cmd"][:6] == ["/bin/true", "plain", "--ros-args", "-r", "__node:=n", "-r"]
    assert seen["name"] == "true-1"


def test_other_unknown_attributes_are_still_refused(workspace: Workspace) -> None:
    file = workspace.add("t.launch.xml", '<launch><node exec="/bin/true" enklave="/x"/></launch>')
    result = workspace.python(VISIT, str(file))
    assert "Unexpected attribute(s) found in `node`: {'enklave'}" in result.stdout
    assert json.loads(result.stdout.splitlines()[-1])["status"] == 1


UNSECURED = """
import sys
import stand_ins
stand_ins.install()
import launch
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.actions import IncludeLaunchDescription, OpaqueFunction
import ros2launch.api.api
import enclave_addons.ros2.option, enclave_addons.ros2.node_action

def configurations(context):
    print("CONFIGURATIONS", sorted(context.launch_configurations), sorted(context.get_locals_as_dict()))

service = launch.LaunchService(noninteractive=True)
include = IncludeLaunchDescription(AnyLaunchDescriptionSource(sys.argv[1]))
service.include_launch_description(launch.LaunchDescription([include, OpaqueFunction(function=configurations)]))
assert service.run() == 0
ours = {name for name in sys.modules if name.split(".")[0] in ("enclave_launch", "nodl", "keystore")}
heavy = {"enclave_launch.plan", "enclave_launch.flow", "enclave_launch.secured", "nodl.lookup", "cryptography"}
print("HEAVY", sorted(ours & heavy))
"""


def test_a_launch_without_secure_neither_computes_nor_imports_anything_of_ours(workspace: Workspace) -> None:
    """The namespace is performed once, as upstream does: a command in it has effects."""
    count = workspace.directory / "count"
    file = workspace.add(
        "plain.launch.xml",
        f"""<launch>
          <push_ros_namespace namespace="$(command 'sh -c &quot;echo x &gt;&gt; {count}; printf pushed&quot;')"/>
          <node exec="/bin/true" name="a"/>
        </launch>""",
    )
    result = workspace.python(UNSECURED, str(file))
    assert result.returncode == 0, result.stdout
    assert "HEAVY []" in result.stdout
    assert "enclave" not in next(line for line in result.stdout.splitlines() if "CONFIGURATIONS" in line)
    assert count.read_text() == "x\n"


COMPONENTS = """
import sys
import stand_ins
stand_ins.install()
import launch
from launch_ros.actions import ComposableNodeContainer
from launch_ros.descriptions import ComposableNode
import enclave_addons.ros2.attributes
from enclave_addons.ros2.session import KEY
from enclave_addons.ros2.node_action import EnclaveNodeActionExtension
from enclave_launch.runtime.gate import StartAdditions

told = []
class Session:
    def enter(self, process, *, loads_components=False):
        told.append(loads_components)
        return StartAdditions()

node = ComposableNode(package="p", plugin="P", name="n", remappings=[("chatter", "news"), ("a", "b")],
                      parameters=[{"x": 1}], extra_arguments=[{"use_intra_process_comms": True}])
box = ComposableNodeContainer(package=None, executable="/bin/true", name="box", namespace="",
                              composable_node_descriptions=[node])
context = launch.LaunchContext()
context.extend_globals({KEY: Session()})
box._perform_substitutions(context)
EnclaveNodeActionExtension().prepare_for_execute(context, {"name": "__node:=box", "ns": "__ns:=/"}, box)
print(told, len(list(node.remappings)), len(list(node.parameters)), len(list(node.extra_arguments)))
"""


def test_looking_at_a_container_leaves_its_components_as_they_are(workspace: Workspace) -> None:
    """Upstream keeps remap rules as a generator: who reads them takes them from the real load."""
    assert workspace.python(COMPONENTS).stdout.splitlines()[-1] == "[True] 2 1 1"
