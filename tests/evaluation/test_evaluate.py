"""``evaluate`` from the outside: errors with their place, what it leaves untouched, options."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import EvaluationError, evaluate, parse_arguments
from enclave_launch.host.plan_host import PlanHost


def test_an_error_tells_file_line_element_and_the_include_chain(files: Callable[..., Path]) -> None:
    folder = files(
        inner__launch__xml='\n\n<executable cmd="$(var unset)"/>',
        middle__launch__xml='\n<include file="$(dirname)/inner.launch.xml"/>',
        main__launch__xml='<let name="a" value="b"/>\n<include file="$(dirname)/middle.launch.xml"/>',
    )
    with pytest.raises(EvaluationError) as caught:
        evaluate(folder / "main.launch.xml")
    location = caught.value.location
    assert location is not None
    assert (Path(location.file).name, location.line, location.element) == (
        "inner.launch.xml",
        3,
        "executable",
    )
    assert [Path(step).name for step in location.includes] == ["main.launch.xml:2", "middle.launch.xml:2"]
    assert type(caught.value.cause).__name__ == "SubstitutionFailure"


def test_an_exception_of_a_python_file_shows_the_users_own_frame(files: Callable[..., Path]) -> None:
    folder = files(
        main__launch__py="""
            import os.path
            def generate_launch_description():
                return os.path.join(None, "x")
        """
    )
    with pytest.raises(EvaluationError) as caught:
        evaluate(folder / "main.launch.py")
    assert caught.value.location is not None
    assert (Path(caught.value.location.file).name, caught.value.location.line) == ("main.launch.py", 4)


def test_an_exception_of_an_opaque_function_shows_the_users_own_frame(launch_py: Any) -> None:
    with pytest.raises(EvaluationError, match="ZeroDivisionError") as caught:
        launch_py("def f(context):\n    return 1 / 0\nentities = [OpaqueFunction(function=f)]\n")
    assert caught.value.location is not None
    assert caught.value.location.line > 1


def test_what_was_started_before_the_error_is_kept(launch_xml: Any) -> None:
    with pytest.raises(EvaluationError) as caught:
        launch_xml('<executable cmd="first"/><executable cmd="$(var unset)"/>')
    assert [process.cmd for process in caught.value.partial.processes] == [("first",)]


@pytest.mark.parametrize("path", ["$(dirname)", "$(env D)"])
def test_cyclic_includes_are_an_error(
    files: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    folder = files(
        a__launch__xml=f'<include file="{path}/b.launch.xml"/>',
        b__launch__xml=f'<include file="{path}/a.launch.xml"/>',
    )
    monkeypatch.setenv("D", str(folder))
    with pytest.raises(EvaluationError, match=r"without end: (.*)([ab]\.launch\.xml) -> .*\.xml -> \1\2"):
        evaluate(folder / "a.launch.xml")


@pytest.mark.parametrize("path", ["$(dirname)", "$(env D)"])
def test_a_recursive_include_that_ends_is_fine(
    files: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    """The argument scan of launch can perform ``$(env D)``, and ``$(dirname)`` not."""
    folder = files(
        a__launch__xml=f"""
            <arg name="n" default="3"/><executable cmd="$(var n)"/>
            <include file="{path}/a.launch.xml" if="$(eval '$(var n) > 0')">
              <arg name="n" value="$(eval '$(var n) - 1')"/></include>
        """
    )
    monkeypatch.setenv("D", str(folder))
    assert [process.cmd[0] for process in evaluate(folder / "a.launch.xml").processes] == ["3", "2", "1", "0"]


def test_a_description_in_memory_is_no_missing_file(launch_py: Any) -> None:
    """Its location is a name only; beside it, a file that is missing is left out."""
    found = launch_py(
        """
        from launch import LaunchDescriptionSource
        inner = LaunchDescription([ExecuteProcess(cmd=["inner"])])
        entities = [
            IncludeLaunchDescription(LaunchDescriptionSource(inner)),
            IncludeLaunchDescription("/missing/p/launch/p.launch.xml"),
        ]
        """,
        allow_missing_packages=True,
    )
    assert [process.cmd for process in found.processes] == [("inner",)]
    assert [str(warning.code) for warning in found.warnings] == ["include-left-out"]


@pytest.mark.parametrize("simulated", [True, False])
def test_a_timer_on_simulated_time_is_reported(launch_py: Any, simulated: bool) -> None:
    found = launch_py(f"""
        from launch_ros.actions import ROSTimer, SetUseSimTime
        entities = [ROSTimer(period=2.0, actions=[ExecuteProcess(cmd=["later"])])]
        entities += [SetUseSimTime(True)] if {simulated} else []
    """)
    assert [process.cmd for process in found.processes] == [("later",)]
    assert [str(warning.code) for warning in found.warnings] == ["ros-timer-on-wall-time"] * simulated


def test_our_own_process_is_left_as_it_was(launch_py: Any) -> None:
    environment, path, modules = dict(os.environ), list(sys.path), set(sys.modules)
    launch_py("""
        import os
        os.environ["FROM_PYTHON"] = "1"
        entities = [SetEnvironmentVariable("FROM_LAUNCH", "1"), UnsetEnvironmentVariable("PATH")]
    """)
    assert (dict(os.environ), sys.path) == (environment, path)
    assert not {
        name for name in set(sys.modules) - modules if name.partition(".")[0] in ("launch", "launch_ros")
    }


def test_it_is_restored_after_an_error_too(launch_xml: Any) -> None:
    before = dict(os.environ)
    with pytest.raises(EvaluationError):
        launch_xml('<set_env name="A_NEW_ONE" value="1"/><executable cmd="$(var unset)"/>')
    assert dict(os.environ) == before


def test_missing_packages_go_on_with_a_placeholder_and_one_warning(launch_xml: Any) -> None:
    found = launch_xml(
        """
        <node pkg="nowhere" exec="a"/><node pkg="nowhere" exec="b"/>
        <include file="$(find-pkg-share nowhere)/launch/x.launch.xml"/>
        <executable cmd="after"/>
        """,
        allow_missing_packages=True,
    )
    assert [process.cmd[0] for process in found.processes] == [
        "/missing/nowhere/lib/nowhere/a",
        "/missing/nowhere/lib/nowhere/b",
        "after",
    ]
    assert sum("package 'nowhere'" in warning.text for warning in found.warnings) == 1
    assert any("not included" in warning.text for warning in found.warnings)


def test_without_the_option_a_missing_package_is_an_error(launch_xml: Any) -> None:
    with pytest.raises(EvaluationError, match="package 'nowhere' not found, searching"):
        launch_xml('<node pkg="nowhere" exec="a"/>')


def test_no_python_refuses_python_files(launch_py: Any) -> None:
    with pytest.raises(EvaluationError, match="--no-python"):
        launch_py("entities = []", no_python=True)


def test_the_same_seed_gives_the_same_anonymous_names(launch_xml: Any) -> None:
    text = '<executable cmd="$(anon a) $(anon b) $(anon a)"/>'
    first, again = (launch_xml(text, anonymous_seed=7).processes[0].cmd for _ in range(2))
    other = launch_xml(text, anonymous_seed=8).processes[0].cmd
    assert first == again != other
    assert first[0] == first[2] != first[1]


@pytest.mark.parametrize("word", ["a", ":=b", "a:=", ""])
def test_malformed_arguments(word: str) -> None:
    with pytest.raises(RuntimeError, match="malformed launch argument"):
        parse_arguments([word])


def test_arguments_split_at_the_first_separator_and_the_last_one_counts() -> None:
    assert parse_arguments(["a:=b:=c", "x:=1", "x:=2"]) == [("a", "b:=c"), ("x", "2")]


def test_launch_configurations_are_set_before_the_file(files: Callable[..., Path]) -> None:
    folder = files(main__launch__xml='<executable cmd="ls"/>')
    found = evaluate(folder / "main.launch.xml", launch_configurations={"launch-prefix": "nice -n 3"})
    assert found.processes[0].cmd == ("nice", "-n", "3", "ls")


def test_the_location_of_a_python_action_is_where_it_was_made(launch_py: Any) -> None:
    process = launch_py("p = EP(cmd=['p'])\nentities = [p]\n").processes[0]
    text = Path(process.location.file).read_text(encoding="utf-8").splitlines()
    assert text[process.location.line - 1] == "p = EP(cmd=['p'])"


def test_host_records_the_distribution(launch_xml: Any) -> None:
    assert launch_xml("", distro="humble").distro == "humble"
    assert PlanHost().release.distro.value in ("humble", "jazzy", "kilted", "lyrical", "rolling")
