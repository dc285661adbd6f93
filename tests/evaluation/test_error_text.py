"""What a person reads when a launch file is wrong: what, where, and what to do next; no class names, no Python."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from enclave_launch import LaunchFileError
from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost

XML = "<launch>\n{}\n</launch>\n"


def message(tmp_path: Path, name: str, text: str | bytes, **options: Any) -> str:
    file = tmp_path / name
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(LaunchFileError) as caught:
        evaluate(file, host=PlanHost(**options))
    return str(caught.value).replace(f"{tmp_path}/", "")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ('<node pkg="p" exec="e" foo="1"/>', "2: <node> Unexpected attribute(s) found in `node`: {'foo'}"),
        ('<let name="x"/>', "2: <let> Attribute 'value' of type str not found in Entity 'let'"),
        ('<let name="x" value="$(nosub a)"/>', "2: <let> Unknown substitution: nosub"),
        ('<log message="a" if="maybe"/>', "but got 'maybe'"),
        (
            '<include file="$(dirname)/none.launch.xml"/>',
            "2: <include> No such file or directory: 'none.launch.xml'",
        ),
        ("&nothing;", "a.launch.xml:2: malformed XML: undefined entity"),
        ("<node", "malformed XML: not well-formed (invalid token)"),
    ],
)
def test_a_mistake_in_xml(tmp_path: Path, content: str, told: str) -> None:
    text = message(tmp_path, "a.launch.xml", XML.format(content))
    assert text.startswith("a.launch.xml:")
    assert told in text
    assert "Error" not in text


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (
            "launch: [\n",
            "a.launch.yaml:2: malformed YAML: while parsing a flow node, expected the node content",
        ),
        ("", "a.launch.yaml: the file is empty, expected the key 'launch'"),
        (b"launch:\n- arg: {name: \xff}\n", "a.launch.yaml: not UTF-8 text: byte 0xff at offset 22"),
    ],
)
def test_a_mistake_in_yaml(tmp_path: Path, content: str | bytes, told: str) -> None:
    text = message(tmp_path, "a.launch.yaml", content)
    assert text.startswith(told)
    assert "Error" not in text


def test_what_python_raised_in_the_users_code_keeps_its_class(tmp_path: Path) -> None:
    code = "def generate_launch_description():\n    return {}['speed']\n"
    assert message(tmp_path, "a.launch.py", code) == "a.launch.py:2: KeyError: speed"


def test_a_variable_that_the_file_needs_is_called_an_environment_variable(tmp_path: Path) -> None:
    code = "import os\n\ndef generate_launch_description():\n    return os.environ['NEED_COMPILE_OF_TEST']\n"
    assert message(tmp_path, "a.launch.py", code) == (
        "a.launch.py:4: KeyError: NEED_COMPILE_OF_TEST\n"
        "the launch file needs the environment variable NEED_COMPILE_OF_TEST, which is not set"
    )


def test_a_program_that_the_file_runs_is_told_from_a_file_that_it_reads(tmp_path: Path) -> None:
    code = "import subprocess\n\ndef generate_launch_description():\n    {}\n"
    text = message(tmp_path, "a.launch.py", code.format("subprocess.check_output(['no-xacro', 'a.urdf'])"))
    assert text.startswith(
        "a.launch.py:4: No such file or directory: 'no-xacro'\nthe launch file runs this program"
    )
    assert message(tmp_path, "a.launch.py", code.format("open('a.urdf')")) == (
        "a.launch.py:4: No such file or directory: 'a.urdf'"
    )


@pytest.mark.parametrize("returned", ["None", "5"])
def test_a_python_file_must_return_a_description(tmp_path: Path, returned: str) -> None:
    text = message(tmp_path, "a.launch.py", f"def generate_launch_description():\n    return {returned}\n")
    assert text.endswith("generate_launch_description() must return a LaunchDescription")


def test_a_missing_argument_says_how_to_give_it(tmp_path: Path) -> None:
    text = message(tmp_path, "a.launch.xml", XML.format('<arg name="robot"/>'))
    assert "missing required argument 'robot'" in text
    assert "NAME:=VALUE" in text


def test_an_error_in_an_argument_of_an_include_stands_at_the_include(tmp_path: Path) -> None:
    (tmp_path / "b.launch.xml").write_text("<launch/>")
    content = '<include file="$(dirname)/b.launch.xml"><arg name="x" value="$(var unset)"/></include>'
    text = message(tmp_path, "a.launch.xml", XML.format(content))
    assert text == "a.launch.xml:2: <include> launch configuration 'unset' does not exist"


def test_a_launch_file_that_ends_python_is_refused_where_it_does(tmp_path: Path) -> None:
    code = "import sys\ndef generate_launch_description():\n    sys.exit({})\n"
    told = "; to refuse to launch, raise an error that says why"
    assert (
        message(tmp_path, "a.launch.py", code.format("0")) == f"a.launch.py:3: this calls sys.exit(0){told}"
    )
    assert message(tmp_path, "a.launch.py", code.format("")) == f"a.launch.py:3: this calls sys.exit(){told}"
    inside = (
        "from launch import LaunchDescription\nfrom launch.actions import OpaqueFunction\n"
        "def act(context):\n    raise SystemExit('no')\n"
        "def generate_launch_description():\n    return LaunchDescription([OpaqueFunction(function=act)])\n"
    )
    assert message(tmp_path, "a.launch.py", inside).startswith("a.launch.py:4: this calls sys.exit('no'); ")


@pytest.mark.parametrize("name", ["b.launch.xml", "b.launch.py"])
def test_a_pipe_is_no_launch_file(tmp_path: Path, name: str) -> None:
    """Nobody may ever write to it."""
    os.mkfifo(tmp_path / name)
    text = message(tmp_path, "a.launch.xml", XML.format(f'<include file="$(dirname)/{name}"/>'))
    assert text == f"a.launch.xml:2: <include> A pipe, not a file: '{name}'"


def test_a_package_that_is_not_installed_says_what_to_do(tmp_path: Path) -> None:
    text = message(tmp_path, "a.launch.xml", XML.format('<node pkg="nowhere" exec="e"/>'))
    assert "2: <node> package 'nowhere' not found" in text
    assert "--prefix" in text and "--allow-missing-packages" in text


def test_an_error_inside_a_helper_stands_at_the_element_and_names_the_helper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "r3_helper.py").write_text(
        "from launch import Substitution\n\nclass Broken(Substitution):\n"
        "    def perform(self, context):\n        return context.launch_configurations['unset']\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    code = (
        "from launch import LaunchDescription\nfrom launch.actions import LogInfo\nfrom r3_helper import Broken\n\n"
        "def generate_launch_description():\n    return LaunchDescription([\n        LogInfo(msg=[Broken()]),\n    ])\n"
    )
    text = message(tmp_path, "a.launch.py", code)
    assert text == "a.launch.py:7: <LogInfo> KeyError: unset (in r3_helper.py:5)"


def test_a_program_that_is_not_installed_is_a_placeholder_when_packages_may_be_missing(
    tmp_path: Path,
) -> None:
    text = XML.format(
        '<executable cmd="$(find-exec no-such-xacro) $(command \'no-such-xacro a.urdf\')" shell="true"/>'
    )
    assert "executable 'no-such-xacro' not found on the PATH" in message(tmp_path, "a.launch.xml", text)
    found = evaluate(tmp_path / "a.launch.xml", host=PlanHost(allow_missing_packages=True))
    assert " ".join(found.processes[0].cmd).startswith("/missing/bin/no-such-xacro <output of no-such-xacro")
    assert tuple(map(str, found.warnings)) == (
        "program 'no-such-xacro' is not installed; a placeholder replaces its output",
    )


def test_a_command_that_fails_on_a_file_of_a_missing_package_gives_a_placeholder_when_packages_may_be_missing(
    tmp_path: Path,
) -> None:
    command = "$(command 'cat $(find-pkg-share no_such_arm)/arm.urdf')"
    text = XML.format(f'<executable cmd="talker {command}"/>')
    assert "'no_such_arm'" in message(tmp_path, "a.launch.xml", text)
    found = evaluate(tmp_path / "a.launch.xml", host=PlanHost(allow_missing_packages=True))
    assert (
        "<output of cat, whose /missing/no_such_arm/share/no_such_arm/arm.urdf is not installed>"
        in " ".join(found.processes[0].cmd)
    )
    assert str(found.warnings[-1]) == (
        "'cat' failed, as /missing/no_such_arm/share/no_such_arm/arm.urdf is not installed; "
        "a placeholder replaces its output"
    )


@pytest.mark.parametrize(("package", "is_placeholder"), [("no_such_camera", True), ("here", False)])
def test_a_command_that_misses_a_package_itself_gives_a_placeholder_when_packages_may_be_missing(
    package: str, is_placeholder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As xacro does for a model that includes one of a package which is not installed."""
    index = tmp_path / "prefix/share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "here").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    program = tmp_path / "model"
    program.write_text(
        f"#!/bin/sh\necho \"error: package '{package}' not found, searching: []\" >&2\nexit 2\n"
    )
    program.chmod(0o755)
    text = XML.format(f"<executable cmd=\"talker $(command '{program}')\"/>")
    assert "executed command failed" in message(tmp_path, "a.launch.xml", text)
    if not is_placeholder:
        assert "executed command failed" in message(
            tmp_path, "a.launch.xml", text, allow_missing_packages=True
        )
        return
    found = evaluate(tmp_path / "a.launch.xml", host=PlanHost(allow_missing_packages=True))
    assert f"whose package {package} is not installed>" in " ".join(found.processes[0].cmd)


def test_a_command_that_fails_otherwise_is_an_error_when_packages_may_be_missing(tmp_path: Path) -> None:
    text = XML.format("<executable cmd=\"talker $(command 'cat /no/such/arm.urdf')\"/>")
    assert "executed command failed" in message(tmp_path, "a.launch.xml", text, allow_missing_packages=True)


@pytest.mark.parametrize(
    ("expression", "cause"),
    [
        ("true and $(var a)", "Python writes True; compare the text of an argument instead"),
        ("$(var a) == 'front'", "if front is the value of an argument, put it in quotes"),
        ("$(var a) +", "a text needs quotes around it"),
        ("len(3)", ""),
    ],
)
def test_an_error_in_an_expression_names_the_expression_and_its_usual_cause(
    tmp_path: Path, expression: str, cause: str
) -> None:
    text = (
        '<launch><arg name="a" default="front"/>\n<let name="b" value="$(eval &quot;'
        + expression
        + '&quot;)"/></launch>'
    )
    told = message(tmp_path, "a.launch.xml", text)
    assert told.startswith("a.launch.xml:2: <let> ")
    assert f"\nin the expression: {expression.replace('$(var a)', 'front')}" in told
    assert cause in told
    assert bool(cause) == (told.count("\n") == 2)


PYTHON = """from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
import os
def generate_launch_description():
    node = Node(package="pk", executable="e")
    return {}
"""


@pytest.mark.parametrize(
    ("returned", "cause"),
    [
        ("LaunchDescription([Node(package='p', executable='a' + LaunchConfiguration('x'))])",
         "a LaunchConfiguration has no value before the launch file is visited"),
        ("LaunchDescription([os.path.join('a', LaunchConfiguration('x'))])",
         "a LaunchConfiguration has no value before the launch file is visited"),
        ("LaunchDescription([None])", "a NoneType stands where an action is expected"),
        ("[node]", "generate_launch_description() must return a LaunchDescription"),
        ("LaunchDescription([Node(package='p', executable='e', parameters=[{'a': object()}])])",
         "Unexpected type for parameter value <object>"),
        ("LaunchDescription([DeclareLaunchArgument('x', default_value='1', condition=LaunchConfiguration('x'))])",
         "condition= takes a condition, such as IfCondition(...), not a LaunchConfiguration"),
    ],
)  # fmt: skip
def test_an_error_of_python_has_its_usual_cause_and_no_address(
    tmp_path: Path, returned: str, cause: str
) -> None:
    told = message(tmp_path, "a.launch.py", PYTHON.format(returned))
    assert cause in told
    assert "0x" not in told


def test_an_error_in_a_parameter_file_with_substitutions_is_at_its_line(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("/**:\n  ros__parameters:\n    a: $(var known)\n    b: $(var gone)\n")
    text = (
        '<launch><arg name="known" default="1"/>\n<node pkg="pk" exec="e">'
        f'<param from="{tmp_path}/p.yaml" allow_substs="true"/></node></launch>'
    )
    told = message(tmp_path, "a.launch.xml", text, allow_missing_packages=True)
    assert told.startswith("p.yaml:4: launch configuration 'gone' does not exist")
