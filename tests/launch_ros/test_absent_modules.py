"""Python launch files that import modules which are not installed, with ``--allow-missing-packages``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import flow
from enclave_launch.evaluation.evaluate import EvaluationError
from enclave_launch.options import ResolveOptions
from enclave_launch.process import Evaluation

Evaluate = Callable[..., Evaluation]

FILE = """
import os
from launch import LaunchDescription
from launch.actions import *
from launch.conditions import *
from launch.substitutions import *
from launch_ros.actions import ComposableNodeContainer, Node
from launch_ros.descriptions import ComposableNode, ParameterValue
from launch_ros.parameter_descriptions import ParameterFile
{imports}

def generate_launch_description():
    description = LaunchDescription([Node(package="pk", executable="e", name="n")])
    {body}
    return description
"""
IMPORT = "from robot_common.launching import config\nimport robot_common.tools as tools"


def _file(body: str, imports: str = IMPORT) -> str:
    return FILE.format(imports=imports, body="\n    ".join(body.splitlines()))


@pytest.fixture
def tree(launched: Evaluate) -> Evaluate:
    """Evaluate a file with this body, which may lack packages."""

    def run(body: str, imports: str = IMPORT, *arguments: str) -> Evaluation:
        return launched(_file(body, imports), *arguments, syntax="py", allow_missing_packages=True)

    return run


def test_without_the_option_the_import_is_refused(launched: Evaluate) -> None:
    with pytest.raises(EvaluationError, match=r"main\.launch\.py:10: .*No module named 'robot_common'"):
        launched(_file("pass"), syntax="py")


def test_the_module_is_named_once_and_is_gone_afterwards(tree: Evaluate) -> None:
    found = tree("config.load(tools.x)")
    assert [process.name for process in found.processes] == ["n"]
    assert [warning.subject for warning in found.warnings] == ["robot_common"]
    assert not [name for name in sys.modules if name.startswith("robot_common")]


@pytest.mark.parametrize(
    ("parameters", "known", "unknown"),
    [
        ("[config.load('a')]", {}, ["robot_common.launching.config.load()"]),
        ("config.load('a')", {}, ["robot_common.launching.config.load()"]),
        ("[{'rate': 5, 'gain': tools.gain['x']}]", {"rate": 5}, ["robot_common.tools.gain['x']"]),
        ("[{'text': ParameterValue(tools.text, value_type=str)}]", {}, ["robot_common.tools.text"]),
        ("[ParameterFile(tools.file, allow_substs=True), {'rate': 5}]", {"rate": 5}, ["robot_common.tools.file"]),
        ("[{'rate': 5}]", {"rate": 5}, []),
    ],
)  # fmt: skip
def test_parameters_from_it_are_not_known_and_the_others_are(
    tree: Evaluate, parameters: str, known: dict[str, object], unknown: list[str]
) -> None:
    body = f"description.add_action(Node(package='pk', executable='e', parameters={parameters}))"
    process = tree(body).processes[1]
    assert process.parameters == known
    assert [item.value for item in process.unknown_parameters] == unknown
    container = f"""component = ComposableNode(package='pk', plugin='P', name='c', parameters={parameters})
description.add_action(ComposableNodeContainer(package='pk', executable='e', name='box', namespace='',
    composable_node_descriptions=[component]))"""
    (component,) = tree(container).components
    assert component.parameters == known
    assert [item.value for item in component.unknown_parameters] == unknown


@pytest.mark.parametrize(
    ("body", "report"),
    [
        ("description.add_action(tools.node('a'))", "what robot_common.tools.node() would start"),
        ("description.add_action(GroupAction([tools.node]))", "what robot_common.tools.node would start"),
        ("description = config.launch()", "what robot_common.launching.config.launch() would start"),
        ("for name in tools.names: description.add_action(Node(package='pk', executable='e', name=name))",
         "what robot_common.tools.names contains"),
        ("description = LaunchDescription([*description.entities, *tools.nodes()])",
         "what robot_common.tools.nodes() contains"),
        ("description = LaunchDescription(description.entities + tools.nodes())",
         "what robot_common.tools.nodes() would start"),
        ("tools.add_nodes(description)", "what robot_common.tools.add_nodes() adds to what it is given"),
        ("description.add_action(OpaqueFunction(function=lambda context: tools.nodes(context)))",
         "what robot_common.tools.nodes() would start"),
        ("description.add_action(Node(package='pk', executable='e', condition=IfCondition(tools.simulated)))",
         "whether this Node is executed, which depends on robot_common.tools.simulated"),
        ("class Mine(tools.Action):\n    size = 3\ndescription.add_action(Mine(size=Mine.size))",
         "what Mine() would start"),
    ],
)  # fmt: skip
def test_what_it_may_start_is_reported(tree: Evaluate, body: str, report: str) -> None:
    found = tree(body)
    assert [item.what for item in found.unforeseeable] == [
        f"{report}: the Python module 'robot_common' is not installed"
    ]
    assert found.unforeseeable[0].location.file.endswith("main.launch.py")
    assert found.unforeseeable[0].location.line > 10


@pytest.mark.parametrize(
    ("body", "use"),
    [
        ("str(tools.x)", "text"),
        ("f'{tools.x}'", "text"),
        ("'%s' % tools.x", "text"),
        ("'a' + tools.x", "text"),
        ("tools.x / 'a'", "a path"),
        ("os.path.join(tools.x, 'a')", "a path"),
        ("open(tools.x)", "a path"),
        ("if tools.x: pass", "a condition"),
        ("tools.x == 1", "a condition"),
        ("'a' in tools.x", "a condition"),
        ("tools.x < 1", "a condition"),
        ("len(tools.x)", "a number"),
        ("description.add_action(Node(package=tools.x, executable='e'))", "text"),
        ("description.add_action(Node(package='pk', executable='e', name=tools.x))", "text"),
        ("description.add_action(Node(package='pk', executable='e', remappings=[('a', tools.x)]))", "text"),
        ("description.add_action(Node(package='pk', executable='e', arguments=[tools.x]))", "text"),
        ("description.add_action(SetEnvironmentVariable('A', tools.x))", "text"),
        ("while tools.more(): pass", "a condition"),
    ],
)  # fmt: skip
def test_a_value_that_the_launch_needs_is_refused_at_its_place(tree: Evaluate, body: str, use: str) -> None:
    with pytest.raises(EvaluationError) as caught:
        tree(body)
    assert f"robot_common.tools.{'more()' if 'more' in body else 'x'} is used as {use}" in str(caught.value)
    assert str(caught.value).startswith(f"{caught.value.location}")
    assert caught.value.location is not None
    assert caught.value.location.line == 15


@pytest.mark.parametrize(("use", "error"), [("int(tools.x)", "int"), ("tools.x * 2", "unsupported operand")])
def test_a_number_is_refused_by_python(tree: Evaluate, use: str, error: str) -> None:
    with pytest.raises(EvaluationError, match=error):
        tree(use)


@pytest.mark.parametrize(
    "imports",
    [
        "try:\n    import robot_common\nexcept ImportError:\n    robot_common = None",
        "try:\n    import robot_common\nexcept (KeyError, ModuleNotFoundError):\n    robot_common = None",
        "import contextlib\nrobot_common = None\nwith contextlib.suppress(ImportError):\n    import robot_common",
        "import importlib.util\nrobot_common = importlib.util.find_spec('robot_common')",
    ],
)
def test_a_file_that_has_an_answer_to_the_error_gets_the_error(tree: Evaluate, imports: str) -> None:
    assert not tree("assert robot_common is None", imports).unforeseeable


def test_another_handler_is_no_answer(tree: Evaluate) -> None:
    tree("robot_common.x", "try:\n    import robot_common\nexcept KeyError:\n    robot_common = None")


@pytest.mark.parametrize("name", ["launch.no_such_module", "json.no_such_module", "helper.no_such_module"])
def test_no_part_of_an_installed_package_is_made_up(
    tree: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "helper").mkdir()
    (tmp_path / "helper" / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(EvaluationError, match=f"No module named '{name}'"):
        tree("pass", f"import {name}")


def test_an_import_by_an_installed_library_keeps_its_error(tree: Evaluate) -> None:
    with pytest.raises(EvaluationError, match="robot_common"):
        tree("pass", "import importlib\nimportlib.import_module('robot_common')")


def test_a_name_that_a_star_may_have_brought_is_refused_with_the_module(tree: Evaluate) -> None:
    tree("pass", "from robot_common.names import *")
    with pytest.raises(EvaluationError) as caught:
        tree("somewhere()", "from robot_common.names import *")
    assert "name 'somewhere' is not defined" in str(caught.value)
    assert "it may be a name of robot_common.names, which is not installed" in str(caught.value)
    with pytest.raises(EvaluationError) as other:
        tree("somewhere()", "import robot_common.names")
    assert "it may be" not in str(other.value)


def test_rclpy_is_opaque_beside_its_loggers(tree: Evaluate) -> None:
    body = (
        "rclpy.logging.get_logger('x').info('y')\ndescription.add_action(Node(package='pk', executable='e'))"
    )
    found = tree(body, "import rclpy.logging\nfrom rclpy.node import Node as RosNode")
    assert len(found.processes) == 2


def test_a_plan_has_both_as_errors_of_a_secured_start(
    tree: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "a.launch.py"
    body = "description.add_action(tools.more)\n"
    file.write_text(
        _file(body + "description.add_action(Node(package='pk', executable='e', parameters=[tools.p]))")
    )
    plan = flow.resolve(str(file), options=ResolveOptions(allow_missing_packages=True))
    codes = {str(diagnostic.code) for diagnostic in (*plan.problems, *plan.warnings)}
    assert {"parameters-unknown", "not-foreseeable", "package-not-installed"} <= codes
