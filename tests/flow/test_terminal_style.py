"""How the tree looks: at 80 columns on a terminal, whole in a pipe."""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from enclave_common.terminal import progress
from enclave_launch import LaunchPlan, ResolveOptions, resolve
from enclave_launch.diagnostics import Code, Diagnostic
from enclave_launch.report.terminal_style import TerminalStyle, terminal_style_of
from enclave_launch.report.tree import plan_tree
from tests.programs import PYTHON, install_package, python_program

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"
MANY = [f"/robot/sensor_{number}/points" for number in range(40)]


@pytest.fixture
def plan(tmp_path: Path) -> LaunchPlan:
    """One node with many topics, in a file with a long name."""
    topics = "".join(f'<topic name="{name}" type="std_msgs/msg/String" role="publisher"/>' for name in MANY)
    manifest = tmp_path / "many.nodl.xml"
    node = f'<node name="talker" executable="talker">{topics}</node>'
    manifest.write_text(f'<interface version="1">{node}</interface>')
    file = tmp_path / "a_launch_file_with_a_rather_long_name_for_a_terminal.launch.xml"
    file.write_text('<launch><node pkg="demo_nodes" exec="talker"/></launch>')
    return resolve(file, options=ResolveOptions(prefixes=(DEMO,), manifests=(manifest,)))


def test_on_a_terminal_no_line_is_wider(plan: LaunchPlan) -> None:
    told = plan_tree(plan, TerminalStyle(80))
    # the first is the path of the file: words stay whole
    assert max(map(len, told.splitlines()[1:])) <= 80


def test_long_lists_are_folded_and_counted(plan: LaunchPlan) -> None:
    folded = plan_tree(plan, TerminalStyle(80))
    shown = sum(name in folded for name in MANY)
    assert shown < len(MANY) and f"… and {len(MANY) - shown} more (-v shows them)" in folded


@pytest.mark.parametrize("style", [TerminalStyle(), TerminalStyle(80, full=True)])
def test_nothing_is_folded_in_a_pipe_or_with_v(plan: LaunchPlan, style: TerminalStyle) -> None:
    told = plan_tree(plan, style)
    assert all(name in told for name in MANY) and "more (-v" not in told


def diagnostics(count: int, remedy: str = "write a manifest") -> list[Diagnostic]:
    return [Diagnostic(Code.NO_MANIFEST, f"n{n}", f"node n{n} unknown", None, remedy) for n in range(count)]


def test_what_to_do_is_said_once() -> None:
    lines = TerminalStyle().listed("warning", diagnostics(3))
    assert lines == [
        *(f"warning: node n{n} unknown" for n in range(3)),
        "    what to do: write a manifest",
    ]
    assert TerminalStyle().listed("warning", diagnostics(1)) == ["warning: node n0 unknown; write a manifest"]


def test_many_of_a_kind_are_counted_unless_all_are_wanted() -> None:
    lines = TerminalStyle().listed("warning", diagnostics(9))
    assert "warning: 5 more like these (no-manifest; -v shows them)" in lines and len(lines) == 6
    assert len(TerminalStyle(full=True).listed("warning", diagnostics(9))) == 10


def test_names_cannot_bring_control_characters_of_their_own() -> None:
    told = TerminalStyle(80).listed("warning", [Diagnostic(Code.NO_MANIFEST, "n", "node \033[2Jn")])
    assert "\033[2J" not in "".join(told) and "\\x1b[2Jn" in "".join(told)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_only_a_terminal_has_a_width() -> None:
    assert terminal_style_of(Terminal()).width == shutil.get_terminal_size().columns
    assert terminal_style_of(io.StringIO()).width is None


def in_a_terminal(tmp_path: Path, command: str, *capture: str, keys: tuple[str, ...] = ()) -> str:
    """What a terminal of 80 columns shows once ``command`` and ``keys`` have had their effect: ``DONE`` ends it."""
    if shutil.which("tmux") is None:
        assert os.environ.get("CI") != "true", "tmux is missing"
        pytest.skip("tmux is not installed")
    tmux = ["tmux", "-S", str(tmp_path / f"tmux-{time.monotonic_ns()}"), "-f", "/dev/null"]
    environment = {**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8"}
    start = ["new-session", "-d", "-x", "80", "-y", "60", command]
    subprocess.run([*tmux, *start], check=True, env=environment)
    try:
        shown, until = "", time.monotonic() + 60
        while "DONE" not in shown and time.monotonic() < until:
            time.sleep(0.2)
            if keys and "READY" in shown:
                subprocess.run([*tmux, "send-keys", *keys], check=True)
                keys = ()
            run = subprocess.run([*tmux, "capture-pane", "-p", *capture], capture_output=True, check=True)
            shown = run.stdout.decode()
        return shown
    finally:
        subprocess.run([*tmux, "kill-server"], check=False)


LAUNCH = f"-m enclave_launch --dry-run --prefix {shlex.quote(str(DEMO))} demo_nodes talker_listener_remap.launch.xml"


@pytest.mark.parametrize(
    ("setting", "enclave", "codes"),
    [("NO_COLOR=1", "/ear", set()), ("NO_COLOR=", "\033[36m/ear", {"\033[36m", "\033[39m"})],
    ids=["NO_COLOR", "colours"],
)
def test_recorded_in_a_real_terminal(setting: str, enclave: str, codes: set[str], tmp_path: Path) -> None:
    """Colours, unless NO_COLOR is set, and nothing else: no cursor movement."""
    command = f"sh -c {shlex.quote(f'export {setting}; {PYTHON} {LAUNCH}; echo DONE; sleep 60')}"
    shown = in_a_terminal(tmp_path, command, "-e")
    assert f"├── enclave {enclave}" in shown
    assert set(re.findall(r"\033\[[^A-Za-z]*[A-Za-z]", shown)) == codes


def test_a_slow_analysis_says_what_it_does_once_in_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal, clock = Terminal(), [0.0]
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    shown = progress("analysing", quiet=False)
    assert shown is not None and progress("analysing", quiet=True) is None
    for clock[0], subject in ((1.0, "demo/quick"), (3.0, "nav2_amcl/\033amcl"), (4.0, "demo/next")):
        shown(subject)
    assert terminal.getvalue() == "analysing nav2_amcl/\\x1bamcl ...\n"


def test_the_analysis_of_each_program_is_told(tmp_path: Path) -> None:
    program = "#!/usr/bin/env python3\nimport rclpy\nrclpy.init()\nrclpy.create_node('n')\n"
    install_package(tmp_path, "pk", {"prog": program})
    file = tmp_path / "one.launch.xml"
    file.write_text('<launch><node pkg="pk" exec="prog"/></launch>')
    told: list[str] = []
    resolve(file, options=ResolveOptions(prefixes=(tmp_path,), progress=told.append))
    assert told == ["pk/prog"]


def test_tab_completes_in_a_real_bash(tmp_path: Path) -> None:
    """Package, launch file and argument, each after Tab, as a person would type them."""
    program = tmp_path / "secure-launch"
    main = "import sys\nfrom enclave_launch.verb.secure_launch import main\nsys.exit(main())\n"
    program.write_text(python_program(main))
    program.chmod(0o755)
    register = Path(sys.executable).parent / "register-python-argcomplete"
    setting = f"PATH={tmp_path}:$PATH AMENT_PREFIX_PATH='{DEMO}' PYTHONPATH='{DEMO.parents[1]}'"
    (tmp_path / "rc").write_text(
        f'export {setting}\neval "$({shlex.quote(str(register))} secure-launch)"\nPS1="READY "\n',
        encoding="utf-8",
    )
    words = ("secure-launch --dry", "demo_n", "talker_listener_r", "cou")
    keys = [key for word in words for key in (word, "Tab")]
    typed = (*keys, "7; echo DO''NE", "Enter")
    shown = in_a_terminal(tmp_path, f"bash --rcfile {tmp_path}/rc -i", "-J", keys=typed)
    line = next(line for line in shown.splitlines() if line.startswith("READY secure-launch"))
    assert "--dry-run demo_nodes talker_listener_remap.launch.xml count:=7" in line
    assert "enclave /ear" in shown
