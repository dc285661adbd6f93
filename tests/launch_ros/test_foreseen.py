"""What a dry run cannot tell, and what the launcher itself must be allowed to do."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from enclave_launch.diagnostics import Code
from enclave_launch.policy.launcher import launcher_node
from enclave_launch.process import Evaluation

Evaluate = Callable[..., Evaluation]

PRELUDE = """
from launch import LaunchDescription
from launch.actions import *
from launch.event_handlers import *
from launch_ros.actions import *
from launch_ros.descriptions import *
from launch_ros.event_handlers import OnStateTransition

def generate_launch_description():
"""


def in_python(entities: str) -> str:
    return f"{PRELUDE}    return LaunchDescription([{entities}])\n"


def test_calls_of_the_launcher(launched: Evaluate) -> None:
    text = in_python("""
        LifecycleNode(package="pk", executable="e", name="n", namespace="ns"),
        ComposableNodeContainer(package="rc", executable="cc", name="c", namespace="/k", composable_node_descriptions=[
            ComposableNode(package="pk", plugin="P", name="a"), ComposableNode(package="pk", plugin="P", name="b")]),
        LoadComposableNodes(target_container="other", composable_node_descriptions=[]),
    """)
    calls = [(call.service, call.type) for call in launched(text, syntax="py").launcher_calls]
    assert calls == [
        ("/ns/n/change_state", "lifecycle_msgs/srv/ChangeState"),
        ("/k/c/_container/load_node", "composition_interfaces/srv/LoadNode"),
        ("other/_container/load_node", "composition_interfaces/srv/LoadNode"),
    ]


def test_a_sequence_of_transitions_is_followed_and_leaves_no_gap(launched: Evaluate) -> None:
    text = in_python("""
        LifecycleNode(package="pk", executable="e", name="n", namespace=""),
        LifecycleTransition(lifecycle_node_names=["/n"], transition_ids=[1, 3]),
    """)
    result = launched(text, syntax="py")
    assert (len(result.processes), result.unforeseeable) == (1, ())


def test_a_transition_of_a_node_that_never_starts_is_reported(launched: Evaluate) -> None:
    text = in_python("""
        RegisterEventHandler(OnStateTransition(goal_state="inactive", entities=[ExecuteProcess(cmd=["x"])]))
    """)
    result = launched(text, syntax="py")
    assert result.processes == ()
    assert "OnStateTransition" in result.unforeseeable[0].what


def test_autostart_where_the_release_has_it(launched: Evaluate) -> None:
    text = in_python('LifecycleNode(package="pk", executable="e", name="n", namespace="", autostart=True)')
    (process,) = launched(text, syntax="py", distro="kilted").processes
    assert process.kind == "lifecycle_node"
    with pytest.raises(Exception, match="unexpected keyword argument 'autostart'"):
        launched(text, syntax="py", distro="humble")


def test_lifecycle_tags_where_the_release_has_them(launched: Evaluate) -> None:
    text = """
    <lifecycle_node pkg="pk" exec="e" name="n" namespace="" autostart="true"/>
    <load_composable_node target="c"><composable_lifecycle_node pkg="pk" plugin="P" name="m" autostart="true"/>
    </load_composable_node>"""
    result = launched(text, distro="lyrical")
    assert [process.kind for process in result.processes] == ["lifecycle_node"]
    assert [component.fqn for component in result.components] == ["/m"]
    with pytest.raises(Exception, match="Unrecognized entity of the type: lifecycle_node"):
        launched(text, distro="jazzy@2026-06")


SCOPES = """
from launch import LaunchDescription
from launch.actions import GroupAction, RegisterEventHandler, TimerAction
from launch.event_handlers import OnProcessExit
from launch_ros.actions import Node, PushRosNamespace

def generate_launch_description():
    first = Node(package="pk", executable="e", name="first")
    next = Node(package="pk", executable="e", name="next", namespace="{namespace}")
    handler = RegisterEventHandler(OnProcessExit(target_action=first, on_exit=[next]))
    timer = TimerAction(period=1.0, actions=[next])
    return LaunchDescription([first, {group}])
"""


@pytest.mark.parametrize(
    ("group", "namespace", "distro", "is_reported"),
    [
        ("GroupAction([PushRosNamespace('r1'), handler])", "", "lyrical", True),
        ("GroupAction([PushRosNamespace('r1'), handler])", "/r1", "lyrical", False),
        ("GroupAction([PushRosNamespace('r1'), handler])", "/r1/arm", "lyrical", False),
        ("GroupAction([PushRosNamespace('r1'), handler])", "/r12", "lyrical", True),
        ("PushRosNamespace('r1'), handler", "", "lyrical", False),
        ("handler", "", "lyrical", False),
        ("GroupAction([PushRosNamespace('r1'), timer])", "", "humble", True),
        ("GroupAction([PushRosNamespace('r1'), timer])", "", "lyrical", False),
    ],
)
def test_what_an_event_starts_outside_of_the_group_of_its_handler_is_reported(
    launched: Evaluate, group: str, namespace: str, distro: str, is_reported: bool
) -> None:
    found = launched(SCOPES.format(group=group, namespace=namespace), syntax="py", distro=distro)
    (*_, process) = found.processes
    assert process.name == "next"
    told = [warning.text for warning in found.warnings if warning.code is Code.SCOPE_ENDED]
    assert bool(told) == is_reported
    if told:
        assert told[0].startswith("next is not in /r1: ")


COMPONENTS = """
from launch import LaunchDescription
from launch.actions import LogInfo, RegisterEventHandler
from launch_ros.actions import ComposableNodeContainer, Node
from launch_ros.descriptions import ComposableLifecycleNode
from launch_ros.event_handlers import OnStateTransition

def generate_launch_description():
    component = ComposableLifecycleNode(package="pk", plugin="P", {component})
    container = ComposableNodeContainer(
        package="rc", executable="cc", name="box", namespace="/r", composable_node_descriptions=[component])
    after = OnStateTransition(goal_state="active", entities=[Node(package="pk", executable="e", name="next")])
    return LaunchDescription([container, RegisterEventHandler(after)])
"""


def test_an_autostarted_component_is_taken_through_its_states_by_the_launcher(launched: Evaluate) -> None:
    text = COMPONENTS.format(component='name="cam", namespace="/r", autostart=True')
    found = launched(text, syntax="py", distro="kilted")
    assert [call.service for call in found.launcher_calls] == [
        "/r/box/_container/load_node",
        "/r/cam/change_state",
    ]
    assert [process.name for process in found.processes] == ["box", "next"], (
        "what waits for its state is foreseen"
    )
    assert not found.unforeseeable
    launcher = launcher_node(found.launcher_calls)
    names = {str(endpoint.name) for endpoint in launcher.interface.endpoints}
    assert {"/r/cam/change_state", "/r/cam/transition_event"} <= names


def test_a_component_without_autostart_is_left_alone(launched: Evaluate) -> None:
    text = COMPONENTS.format(component='name="cam", namespace="/r"')
    found = launched(text, syntax="py", distro="kilted")
    assert [call.service for call in found.launcher_calls] == ["/r/box/_container/load_node"]
    assert [process.name for process in found.processes] == ["box"]


def test_autostart_of_a_component_without_a_name_is_reported_with_a_remedy(launched: Evaluate) -> None:
    found = launched(COMPONENTS.format(component="autostart=True"), syntax="py", distro="kilted")
    what = "autostart of pk/P, whose name only the plugin knows: give it name="
    assert what in [item.what for item in found.unforeseeable]
    assert all(item.location.line for item in found.unforeseeable)


def test_autostart_is_performed_where_the_release_does_so(launched: Evaluate) -> None:
    """Releases before the tag lifecycle_node keep the substitution, which counts as true whatever it says."""
    text = "from launch.substitutions import EnvironmentVariable\n" + in_python("""
        LifecycleNode(package="pk", executable="e", name="n", namespace="", autostart=EnvironmentVariable("GONE"))
    """)
    assert len(launched(text, distro="jazzy@2026-06", syntax="py").processes) == 1
    with pytest.raises(Exception, match="GONE"):
        launched(text, distro="jazzy", syntax="py")
    tag = '<lifecycle_node pkg="pk" exec="e" name="n" namespace="" autostart="$(var on no)"/>'
    assert launched(tag, distro="kilted").processes[0].kind == "lifecycle_node"
