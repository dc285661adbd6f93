"""The manners that the four commands share: version, verbs, abbreviations, quiet and verbose."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from enclave_launch import __version__
from tests.programs import COMPILED, install_package

DEMO_WS = Path(__file__).parents[2] / "fixtures/demo_ws"
TALKER = ("--prefix", str(DEMO_WS), "demo_nodes", "talker_listener.launch.xml")
COMMANDS = {
    "secure-launch": "enclave_launch",
    "secure-plan": "enclave_addons.review.verb",
    "secure-keystore": "keystore.verb",
    "secure-nodl": "nodl.verb",
}


def run(command: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", COMMANDS[command], *words], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_each_names_itself_and_its_version(command: str) -> None:
    told = run(command, "--version")
    assert (told.returncode, told.stdout) == (0, f"{command} {__version__}\n")


@pytest.mark.parametrize(
    ("command", "words", "meant"),
    [
        ("secure-launch", ["--dryrun", "x.launch.xml"], "--dry-run"),
        ("secure-launch", ["--dry", "x.launch.xml"], "--dry-run"),
        ("secure-plan", ["chekc", "x.launch.xml"], "check"),
        ("secure-plan", ["show", "--prefx", "p", "x.launch.xml"], "--prefix"),
        ("secure-keystore", ["verfy", "ks"], "verify"),
        ("secure-keystore", ["verify", "--form", "json", "ks"], "--format"),
        ("secure-nodl", ["infr", "x"], "infer"),
        ("secure-nodl", ["infer", "--comp", "x"], "--compare"),
    ],
)
def test_a_slip_is_wrong_usage_and_answered(command: str, words: list[str], meant: str) -> None:
    told = run(command, *words)
    assert told.returncode == 2
    assert f"did you mean '{meant}'?" in told.stderr


@pytest.mark.parametrize(
    ("command", "words"),
    [("secure-plan", ["show"]), ("secure-keystore", ["verify"]), ("secure-nodl", ["infer"])],
)
def test_each_verb_takes_quiet_or_verbose_but_not_both(command: str, words: list[str]) -> None:
    assert "--quiet" in run(command, *words, "--help").stdout
    assert run(command, *words, "-q", "-v", "x").returncode == 2


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("secure-launch", ["--secure", "--keystore", "", "demo_nodes", "talker_listener.launch.xml"]),
        ("secure-keystore", ["create", ""]),
        ("secure-keystore", ["list", ""]),
    ],
)
def test_an_empty_path_is_wrong_usage_and_not_the_current_folder(command: str, words: list[str]) -> None:
    """``--keystore "$KS"`` where nobody has set ``KS``."""
    told = run(command, *words)
    assert told.returncode == 2
    assert "an empty path; is a variable of the shell not set?" in told.stderr


def test_a_quiet_keystore_says_nothing_of_what_went_well(tmp_path: Path) -> None:
    assert run("secure-keystore", "create", "-q", str(tmp_path / "ks")).stdout == ""
    assert run("secure-keystore", "create-enclave", "-q", str(tmp_path / "ks"), "/a").stdout == ""
    assert run("secure-keystore", "list", "-q", str(tmp_path / "ks")).stdout == "/a\n"  # asked for
    refused = run("secure-keystore", "create-enclave", "-q", str(tmp_path / "ks"), "/a b")
    assert refused.returncode == 2 and "secure-keystore: error:" in refused.stderr


def test_a_verbose_keystore_names_what_it_left_alone(tmp_path: Path) -> None:
    run("secure-keystore", "create", str(tmp_path / "ks"))
    made = run("secure-keystore", "create-enclave", str(tmp_path / "ks"), "/a")
    assert "/a: created" in made.stdout
    again = ["create-enclave", str(tmp_path / "ks"), "/a"]
    assert run("secure-keystore", *again).stdout == "1 enclave unchanged\n"
    assert run("secure-keystore", *again[:1], "-v", *again[1:]).stdout == "/a: unchanged\n"


def test_counts_agree_in_number(tmp_path: Path) -> None:
    run("secure-keystore", "create", str(tmp_path / "ks"))
    assert run("secure-keystore", "verify", str(tmp_path / "ks")).stdout.startswith("0 enclaves, 0 findings")
    run("secure-keystore", "create-enclave", str(tmp_path / "ks"), "/a")
    assert run("secure-keystore", "verify", str(tmp_path / "ks")).stdout.startswith("1 enclave, 0 findings")


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A prefix with one compiled program, and a launch file that starts it."""
    install_package(tmp_path / "ws", "pk", {"prog": COMPILED})
    file = tmp_path / "robot.launch.xml"
    file.write_text('<launch><node pkg="pk" exec="prog"/></launch>')
    return file


def test_a_manifest_that_describes_another_program_says_which(robot: Path, tmp_path: Path) -> None:
    manifest = tmp_path / "other.nodl.xml"
    topic = '<topic name="in" type="std_msgs/msg/String" role="subscription"/>'
    text = '<interface version="1"><node name="s" executable="{}">' + topic + "</node></interface>"
    manifest.write_text(text.format("speaker"))
    words = ["--dry-run", "--prefix", str(tmp_path / "ws"), "--nodl", str(manifest), str(robot)]
    assert "; --nodl describes speaker; " in run("secure-launch", *words).stdout
    manifest.write_text(text.format("prog"))
    assert "no NoDL manifest" not in run("secure-launch", *words).stdout


def test_placeholders_of_launch_are_not_shown_as_names(robot: Path, tmp_path: Path) -> None:
    tree = run("secure-launch", "--dry-run", "--prefix", str(tmp_path / "ws"), str(robot)).stdout
    assert "[prog-1] pk/prog  (line 1" in tree and "unspecified" not in tree


def test_an_executable_that_is_guessed_from_a_node_name_is_told(tmp_path: Path) -> None:
    source = tmp_path / "node.py"
    source.write_text(
        "import rclpy\nfrom rclpy.node import Node\nrclpy.init()\nrclpy.spin(Node('chatterbox'))\n"
    )
    made = run("secure-nodl", "infer", str(source), "-o", str(tmp_path / "out"))
    assert "which executable runs node chatterbox is not known" in made.stderr
    assert run("secure-nodl", "infer", "-q", str(source), "-o", str(tmp_path / "out")).stderr == ""


WRITES = {
    "secure-launch": ("--dry-run", "--format", "json", *TALKER),
    "secure-plan": ("show", *TALKER),
    "secure-nodl": ("library", "list"),
}


@pytest.mark.parametrize("command", WRITES)
def test_a_full_disk_behind_the_output_is_one_line_and_a_failure(command: str) -> None:
    words = [sys.executable, "-m", COMMANDS[command], *WRITES[command]]
    with Path("/dev/full").open("w") as full:
        ran = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ran.returncode == 1
    assert "the output cannot be written: No space left on device" in ran.stderr
    assert "Traceback" not in ran.stderr


@pytest.mark.parametrize("command", WRITES)
def test_a_closed_output_is_no_traceback(command: str) -> None:
    words = shlex.join([sys.executable, "-m", COMMANDS[command], *WRITES[command]])
    ran = subprocess.run(["/bin/sh", "-c", f"{words} >&-"], stderr=subprocess.PIPE, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")


_SECURE_NODL = "from enclave_common.entry import secure_nodl; raise SystemExit(secure_nodl())"


@pytest.mark.parametrize(
    ("command", "module", "words"),
    [
        ("secure-nodl", "argparse", ["-c", _SECURE_NODL]),
        ("secure-nodl", "yaml", ["-c", _SECURE_NODL]),
        ("secure-launch", "yaml", ["-m", "enclave_launch", "--help"]),
    ],
)
def test_ctrl_c_during_the_imports_is_one_line(
    command: str, module: str, words: list[str], tmp_path: Path
) -> None:
    (tmp_path / f"{module}.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])])
    environment = {**os.environ, "PYTHONPATH": path}
    ran = subprocess.run(
        [sys.executable, *words], env=environment, capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stderr) == (130, f"{command}: interrupted\n")
