"""What later point releases changed (from their change logs; not run against real launch)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch.process import Evaluation

Evaluate = Callable[..., Evaluation]


@pytest.mark.parametrize(
    ("distro", "applies"),
    [("jazzy@2025-05", False), ("jazzy", True), ("rolling@2025-05", False), ("lyrical", True)],
)
def test_wildcards_in_parameter_files_of_components(
    launched: Evaluate, tmp_path: Path, distro: str, applies: bool
) -> None:
    text = "/**: {ros__parameters: {a: 1}}\n/*/n: {ros__parameters: {a: 2}}\n/other/*: {ros__parameters: {a: 3}}\n"
    (tmp_path / "p.yaml").write_text(text)
    result = launched(
        """<load_composable_node target="c"><composable_node pkg="pk" plugin="P" name="n" namespace="ns">
        <param from="$(dirname)/p.yaml"/></composable_node></load_composable_node>""",
        distro=distro,
    )
    assert result.components[0].parameters == {"a": 2 if applies else 1}


def test_use_sim_time_of_launch_itself(launched: Evaluate) -> None:
    text = '<set_use_sim_time value="$(var sim true)"/><node pkg="pk" exec="e"/>'
    assert len(launched(text, distro="lyrical").processes) == 1
    assert len(launched(text, "sim:=false", distro="lyrical").processes) == 1
    with pytest.raises(Exception, match="do not agree"):
        launched(text, distro="jazzy@2025-08")


def test_paths_below_a_package(launched: Evaluate, prefix: Path) -> None:
    text = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_ros.substitutions import FindPackageShare

def generate_launch_description():
    return LaunchDescription([ExecuteProcess(cmd=[FindPackageShare("pk") / "launch" / "x.py"])])
"""
    assert launched(text, syntax="py").processes[0].cmd == (f"{prefix}/share/pk/launch/x.py",)


def test_text_parameters_are_quoted(launched: Evaluate) -> None:
    text = """<node pkg="pk" exec="e"><param name="s" value="1e3" type="str"/><param name="n" value="[a, b]"/>
    <param name="i" value="1"/></node>"""
    (old,) = launched(text, distro="jazzy").processes
    (new,) = launched(text, distro="kilted").processes
    assert (old.parameters["s"], new.parameters["s"]) == (1000.0, "1e3")
    assert (new.parameters["n"], new.parameters["i"]) == (("a", "b"), 1)
    assert "s: '1e3'" in next(iter(new.parameter_files.values()))
