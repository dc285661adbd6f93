"""Names that speak to the terminal: no program of ours passes them on, machine formats use their own escapes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from enclave_launch.verb.secure_launch import main as secure_launch
from nodl.verb import main as secure_nodl

ROOT = Path(__file__).parents[2]
DEMO = str(ROOT / "fixtures/demo_ws")
EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e\x7f"
"""Sets the title, clears the screen, colours by an 8-bit sequence, turns the line around, deletes."""

LAUNCH = f"""
launch:
- arg:
    name: "a{EVIL}"
    default: "d{EVIL}"
    description: "t{EVIL}"
- executable:
    cmd: "true {EVIL}"
    name: "forged\\nenclave /everything"
- node:
    pkg: demo_nodes
    exec: talker
    name: talker
    param:
    - name: p
      value: "v{EVIL}"
    env:
    - name: E
      value: "{EVIL}"
"""

SOURCE = f"""
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

def main():
    rclpy.init()
    node = Node("talker")
    node.create_publisher(String, "chatter{EVIL.encode("unicode_escape").decode()}", 10)
    rclpy.spin(node)

main()
"""

Output = tuple[str, str]
Run = Callable[[Path, pytest.CaptureFixture[str]], Output]


def launch(*words: str) -> Run:
    def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Output:
        file = folder / f"evil{EVIL[:3]}.launch.yaml"
        file.write_text(json_yaml(LAUNCH))
        secure_launch(["--prefix", DEMO, *words, str(file)])
        captured = capsys.readouterr()
        return captured.out, captured.err

    return run


def json_yaml(text: str) -> str:
    """YAML takes control characters only as escapes."""
    return "".join(c if c.isprintable() or c == "\n" else f"\\u{ord(c):04x}" for c in text)


def infer(*words: str) -> Run:
    def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Output:
        file = folder / f"talker{EVIL[:3]}.py"
        file.write_text(SOURCE)
        secure_nodl(["infer", *words, str(file)])
        captured = capsys.readouterr()
        return captured.out, captured.err

    return run


def wrong_usage(folder: Path, capsys: pytest.CaptureFixture[str]) -> Output:
    with pytest.raises(SystemExit):
        secure_launch([f"--{EVIL}", "a"])
    captured = capsys.readouterr()
    return captured.out, captured.err


PRINTED: dict[str, Run] = {
    "the tree": launch("--dry-run"),
    "the JSON": launch("--dry-run", "--format", "json"),
    "--show-args": launch("--show-args"),
    "--print": launch("--print"),
    "--dump-params": launch("--dump-params"),
    "secure-nodl infer": infer(),
    "secure-nodl infer as JSON": infer("--format", "json"),
    "a file that is not there": lambda folder, capsys: (secure_launch([EVIL]), *capsys.readouterr())[1:],
    "wrong usage": wrong_usage,
}


@pytest.mark.parametrize("name", PRINTED)
def test_no_control_character_is_printed(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, err = PRINTED[name](tmp_path, capsys)
    assert out or err
    assert all(line.replace("\t", "").isprintable() for line in (out + err).split("\n")), ascii(out + err)


def test_machine_formats_still_hold_the_value(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, _ = PRINTED["the JSON"](tmp_path, capsys)
    talker = json.loads(out)["processes"][1]
    assert talker["environment"]["E"] == EVIL and talker["parameters"]["p"] == f"v{EVIL}"
    out, _ = PRINTED["--dump-params"](tmp_path, capsys)
    assert yaml.safe_load(out)["/talker"]["ros__parameters"]["p"] == f"v{EVIL}"


def test_a_name_cannot_forge_a_line_of_the_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, _ = PRINTED["the tree"](tmp_path, capsys)
    assert "forged\\nenclave /everything" in out
    assert not [line for line in out.splitlines() if line.startswith("enclave /everything")]
