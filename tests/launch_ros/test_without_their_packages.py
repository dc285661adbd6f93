"""Python launch files that import ``nav2_common``, ``rclpy`` or ``xacro``, on a machine where none is installed."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from enclave_launch.evaluation.evaluate import EvaluationError
from enclave_launch.process import Evaluation

Evaluate = Callable[..., Evaluation]

FILE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

def generate_launch_description():
    {before}
    node = Node(package="pk", executable="e", name="n", namespace="ns", parameters=[{parameters}])
    return LaunchDescription([DeclareLaunchArgument("topic", default_value="/front/scan"), node])
"""
NAV2 = (
    "from nav2_common.launch import HasNodeParams, LaunchConfigAsBool, ReplaceString, RewrittenYaml\n"
    "    topic = LaunchConfiguration('topic')"
)
PARAMETERS = """
ns:
  n:
    ros__parameters:
      sim: false
      scan: front
      frames: {scan: deep, ids: [map, odom]}
"""
PLAIN = {"sim": False, "scan": "front", "frames.scan": "deep", "frames.ids": ("map", "odom")}


@pytest.fixture(autouse=True)
def as_if_never_imported() -> Iterator[None]:
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] in ("nav2_common", "rclpy", "xacro")]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("arguments", "changed"),
    [
        ("{}", {}),
        ("{'scan': topic}", {"scan": "/front/scan", "frames.scan": "/front/scan"}),
        ("{'ns.n.ros__parameters.scan': topic}", {"scan": "/front/scan"}),
        ("{'ns.n.ros__parameters.new.rate': '5'}", {"new.rate": "5"}),
        ("{'ns.n.ros__parameters.new.rate': '5'}, convert_types=True", {"new.rate": 5}),
        ("{'new.rate': '5'}", {}),
        ("{'sim': 'True'}", {"sim": True}),
        ("{}, value_rewrites={'odom': 'world'}", {"frames.ids": ("map", "world")}),
    ],
)
def test_a_parameter_file_is_rewritten(
    launched: Evaluate, tmp_path: Path, arguments: str, changed: dict[str, object]
) -> None:
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    text = FILE.format(before=NAV2, parameters=f"RewrittenYaml('{tmp_path}/p.yaml', {arguments})")
    assert launched(text, syntax="py").processes[0].parameters == {**PLAIN, **changed}


def test_keys_are_renamed_and_a_root_key_is_put_above(launched: Evaluate, tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text("m: {ros__parameters: {scan: front, frames: {scan: deep}}}")
    options = "{}, root_key='ns', key_rewrites={'scan': 'topic', 'm': 'n'}"
    text = FILE.format(before=NAV2, parameters=f"RewrittenYaml('{tmp_path}/p.yaml', {options})")
    assert launched(text, syntax="py").processes[0].parameters == {"topic": "front", "frames.topic": "deep"}


@pytest.mark.parametrize(("condition", "scan"), [("true", "back"), ("false", "front")])
def test_texts_are_replaced_if_the_condition_holds(
    launched: Evaluate, tmp_path: Path, condition: str, scan: str
) -> None:
    """Each may be given what another gave."""
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    replaced = f"ReplaceString('{tmp_path}/p.yaml', {{'front': 'back'}}, IfCondition('{condition}'))"
    text = FILE.format(before=NAV2, parameters=f"RewrittenYaml({replaced}, {{'sim': 'true'}})")
    assert launched(text, syntax="py").processes[0].parameters == {**PLAIN, "scan": scan, "sim": True}


@pytest.mark.parametrize("may_lack_packages", [False, True])
def test_substitutions_in_a_rewritten_file_are_performed_if_they_are_allowed(
    launched: Evaluate, tmp_path: Path, may_lack_packages: bool
) -> None:
    """As Nav2's bring-up has it."""
    (tmp_path / "p.yaml").write_text(PARAMETERS.replace("front", "$(var topic)"))
    before = NAV2 + "\n    from launch_ros.parameter_descriptions import ParameterFile"
    rewritten = f"RewrittenYaml('{tmp_path}/p.yaml', {{'sim': 'true'}})"
    for allowed, scan in (("True", "/front/scan"), ("False", "$(var topic)")):
        text = FILE.format(before=before, parameters=f"ParameterFile({rewritten}, allow_substs={allowed})")
        found = launched(text, syntax="py", allow_missing_packages=may_lack_packages)
        assert found.processes[0].parameters == {**PLAIN, "sim": True, "scan": scan}


def test_it_may_be_a_file_for_all_nodes(launched: Evaluate, tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    text = FILE.format(before=NAV2, parameters="").replace(
        "[DeclareLaunchArgument",
        f"[SetParametersFromFile(RewrittenYaml('{tmp_path}/p.yaml', {{'sim': 'true'}})), DeclareLaunchArgument",
    )
    imported = text.replace("import Node\n", "import Node, SetParametersFromFile\n")
    assert launched(imported, syntax="py").processes[0].parameters == {**PLAIN, "sim": True}


def test_nothing_is_written_by_a_dry_run(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    text = FILE.format(before=NAV2, parameters=f"RewrittenYaml('{tmp_path}/p.yaml', {{}})")
    assert launched(text, syntax="py").processes[0].parameter_files
    assert not list((tmp_path / "tmp").iterdir())


@pytest.mark.parametrize(
    ("substitution", "value"),
    [
        ("HasNodeParams('{file}', 'ns')", True),
        ("HasNodeParams('{file}', 'n')", False),
        ("LaunchConfigAsBool('topic')", False),
    ],
)
def test_a_question_is_answered_as_text(
    launched: Evaluate, tmp_path: Path, substitution: str, value: bool
) -> None:
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    parameters = "{'p': " + substitution.format(file=tmp_path / "p.yaml") + "}"
    assert launched(FILE.format(before=NAV2, parameters=parameters), syntax="py").processes[0].parameters == {
        "p": value
    }


@pytest.mark.parametrize(("text", "value"), [("Yes", True), ("0", False)])
def test_the_usual_words_are_a_truth(launched: Evaluate, text: str, value: bool) -> None:
    file = FILE.format(before=NAV2, parameters="{'p': LaunchConfigAsBool('topic')}")
    assert launched(file, f"topic:={text}", syntax="py").processes[0].parameters == {"p": value}


def test_the_file_of_a_package_that_is_not_installed_is_missed_not_made_up(launched: Evaluate) -> None:
    file = FILE.format(
        before=NAV2 + "\n    from ament_index_python import get_package_share_directory as share",
        parameters="RewrittenYaml(share('nowhere') + '/p.yaml', {'scan': topic})",
    )
    with pytest.raises(EvaluationError, match="package 'nowhere' not found"):
        launched(file, syntax="py")
    found = launched(file, syntax="py", allow_missing_packages=True)
    assert found.processes[0].parameters == {}
    assert "parameter-file-missing" in [str(warning.code) for warning in found.warnings]


def test_an_installed_package_is_used(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "nav2_common").mkdir()
    (tmp_path / "nav2_common" / "launch.py").write_text("installed = 7\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    text = FILE.format(before="from nav2_common.launch import installed", parameters="{'p': installed}")
    assert launched(text, syntax="py").processes[0].parameters == {"p": 7}


XACRO = [
    "import xacro\n    d = xacro.process_file('/a.xacro', mappings={'arm': 'left'})",
    "import io, xacro\n    f = io.StringIO()\n    f.name = '/a.xacro'\n    d = xacro.parse(f)\n"
    "    xacro.process_doc(d, mappings={'arm': 'left'})",
]  # fmt: skip


@pytest.mark.parametrize("before", XACRO)
def test_the_program_xacro_does_what_its_package_would(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, before: str
) -> None:
    program = tmp_path / "xacro"
    program.write_text(
        '#!/bin/sh\n[ "$2" = arm:=left ] || { echo no arm >&2; exit 1; }\necho "<robot name=\'$1\'/>"\n'
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    found = launched(FILE.format(before=before, parameters="{'p': d.toxml()}"), syntax="py")
    assert found.processes[0].parameters == {"p": '<?xml version="1.0" ?><robot name="/a.xacro"/>'}
    wrong = FILE.format(before=before.replace("left", "right"), parameters="{'p': d.toxml()}")
    with pytest.raises(EvaluationError, match=r"xacro /a\.xacro failed: no arm"):
        launched(wrong, syntax="py")


@pytest.mark.parametrize(
    ("text", "expected"),
    [('<robot name="a">\n <link name="b" id="&lt;"/>\n <!-- c -->\n <p> d </p>\n</robot>',
      '<robot name="a"><link id="&lt;" name="b"/><!-- c --><p> d </p></robot>'),
     ('<?xml version="1.0"?>\n<robot/>', "<robot/>")],
)  # fmt: skip
def test_a_file_without_xacro_in_it_needs_no_program(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, expected: str
) -> None:
    """As xacro 2.1 writes it, below a banner of four comments."""
    monkeypatch.setenv("PATH", "/nowhere")
    (tmp_path / "a.urdf").write_text(text)
    before = f"import xacro; d = xacro.process_file('{tmp_path}/a.urdf')"
    found = launched(FILE.format(before=before, parameters="{'p': d.toxml()}"), syntax="py").processes[0]
    description = str(found.parameters["p"])
    assert description.startswith('<?xml version="1.0" ?><!-- =====')
    assert description.rpartition(" -->" if "c" not in expected else "== -->")[2] == expected


@pytest.mark.parametrize("before", XACRO)
def test_without_the_program_there_is_an_error_or_a_placeholder(
    launched: Evaluate, monkeypatch: pytest.MonkeyPatch, before: str
) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    text = FILE.format(before=before, parameters="{'p': d.toxml()}")
    with pytest.raises(EvaluationError, match="No module named 'xacro', and no program of that name"):
        launched(text, syntax="py")
    found = launched(text, syntax="py", allow_missing_packages=True)
    assert found.processes[0].parameters == {"p": "<output of xacro, which is not installed>"}
    assert "program-not-installed" in [str(warning.code) for warning in found.warnings]


@pytest.mark.parametrize("may_lack_packages", [False, True])
def test_an_installed_xacro_is_replaced_by_its_program_where_packages_may_be_missing(
    launched: Evaluate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, may_lack_packages: bool
) -> None:
    (tmp_path / "xacro.py").write_text("def process_file(file): raise LookupError('no package a_gripper')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    program = tmp_path / "xacro"
    program.write_text("#!/bin/sh\necho \"package 'a_gripper' not found\" >&2\nexit 2\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    text = FILE.format(
        before="import xacro; d = xacro.process_file('/a.xacro')", parameters="{'p': d.toxml()}"
    )
    if not may_lack_packages:
        with pytest.raises(EvaluationError, match="no package a_gripper"):
            launched(text, syntax="py")
        return
    found = launched(text, syntax="py", allow_missing_packages=True)
    assert found.processes[0].parameters == {
        "p": "<output of xacro, whose package a_gripper is not installed>"
    }


def test_a_launch_file_logs_with_rclpy(launched: Evaluate, caplog: pytest.LogCaptureFixture) -> None:
    before = (
        "import rclpy.logging; log = rclpy.logging.get_logger('bringup'); log.get_child('arm').warn('slow')"
    )
    assert launched(FILE.format(before=before, parameters=""), syntax="py").processes[0].name == "n"
    assert ("bringup.arm", "slow") in [(each.name, each.getMessage()) for each in caplog.records]


@pytest.mark.parametrize("before", ["from rclpy.node import Node as RosNode", "import rclpy; rclpy.init()"])
def test_nothing_else_of_rclpy_is_there(launched: Evaluate, before: str) -> None:
    with pytest.raises(EvaluationError, match="rclpy"):
        launched(FILE.format(before=before, parameters=""), syntax="py")
