"""Launch files, parameter files and manifests made to take for ever: each ends soon, and says why.

Each runs the command line in a process of its own, whose processor time and memory the system bounds: what would hang
is ended and fails the test, however busy the machine is.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MAX_SECONDS = 60  # of processor time, which a busy machine doubles; without a bound some never end
MAX_MEMORY = 4 * 2**30
PREFIX = ROOT / "fixtures/demo_ws"


def _bounded() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (MAX_SECONDS, MAX_SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))


def dry_run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "enclave_launch", "--dry-run", "--prefix", str(PREFIX), *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        command, cwd=folder, env=environment, preexec_fn=_bounded, capture_output=True, text=True, check=False
    )


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, levels)]
    return "\n".join(lines)


def alias_bomb_in_one_line() -> str:
    levels = [f"&amp;{chr(c)} [{', '.join(['*' + chr(c - 1)] * 9)}]" for c in range(ord("b"), ord("m"))]
    return f"[&amp;a [x, x], {', '.join(levels)}]"


def parameters(folder: Path, text: str, package: str = "demo_nodes", executable: str = "talker") -> str:
    (folder / "p.yaml").write_text(text)
    return f"""<launch><node pkg="{package}" exec="{executable}" name="t"><param from="p.yaml"/></node></launch>"""


def component(folder: Path, text: str) -> str:
    (folder / "p.yaml").write_text(text)
    return """<launch><node_container pkg="demo_nodes" exec="component_container" name="c" namespace="">
      <composable_node pkg="demo_nodes" plugin="demo_nodes::Talker" name="t"><param from="p.yaml"/></composable_node>
    </node_container></launch>"""


def names_itself_twice(folder: Path) -> str:
    return (
        '<launch><arg name="n" default=""/>'
        + f'<group><include file="$(dirname)/t.launch.xml" unless="$(equals $(var n) {"x" * 40})">'
        '<arg name="n" value="$(var n)x"/></include></group>' * 2 + "</launch>"
    )


def pipe(folder: Path) -> str:
    os.mkfifo(folder / "pipe.launch.xml")
    return '<launch><include file="$(dirname)/pipe.launch.xml"/></launch>'


def sparse(folder: Path) -> str:
    with open(folder / "huge.launch.xml", "wb") as file:
        file.truncate(2**40)
    return '<launch><include file="$(dirname)/huge.launch.xml"/></launch>'


def executable(words: str) -> Callable[[Path], str]:
    return lambda folder: f'<launch><executable cmd="true {words}"/></launch>'


HOSTILE: dict[str, tuple[Callable[[Path], str], str]] = {
    "an include of a device without end": (
        lambda folder: '<launch><include file="/dev/zero"/></launch>',
        "A device, not a file",
    ),
    "an include of a pipe": (pipe, "A pipe, not a file"),
    "an include of a folder": (lambda folder: '<launch><include file="/etc"/></launch>', "Is a directory"),
    "an include of a terabyte": (sparse, "larger than"),
    "the content of a device": (
        lambda folder: '<launch><let name="a" value="$(file-content /dev/zero)"/></launch>',
        "A device, not a file",
    ),
    "files that include themselves twice": (names_itself_twice, "unfolds to more than"),
    "a loop without end": (
        lambda folder: '<launch><for len="1000000000" name="i"><log message="a"/></for></launch>',
        "unfolds to more than",
    ),
    "loops in loops": (
        lambda folder: (
            "<launch>" + '<for len="1000" name="i">' * 4 + '<log message="a"/>' + "</for>" * 4 + "</launch>"
        ),
        "unfolds to more than",
    ),
    "a text that doubles": (
        lambda folder: (
            '<launch><let name="a" value="xx"/>'
            + '<let name="a" value="$(var a)$(var a)"/>' * 60
            + "</launch>"
        ),
        "a text of more than",
    ),
    "an environment variable that doubles": (
        lambda folder: (
            '<launch><set_env name="A" value="xx"/>'
            + '<append_env name="A" value="$(env A)"/>' * 60
            + "</launch>"
        ),
        "a text of more than",
    ),
    "an entity that grows": (
        lambda folder: (
            '<!DOCTYPE launch [<!ENTITY a0 "xx">'
            + "".join(f'<!ENTITY a{i} "&a{i - 1};&a{i - 1};">' for i in range(1, 60))
            + ']><launch><let name="a" value="&a59;"/></launch>'
        ),
        "has more than 256 characters",
    ),
    "an entity from outside": (
        lambda folder: '<!DOCTYPE launch [<!ENTITY a SYSTEM "/dev/zero">]><launch>&a;</launch>',
        "external",
    ),
    "a megabyte in one argument": (executable("x" * 1_000_000), "a word of a command line has more than"),
    "a megabyte in quotes": (
        executable("'" + "x" * 1_000_000 + "'"),
        "a word of a command line has more than",
    ),
    "a megabyte for a shell": (
        lambda folder: f'<launch><executable cmd="true {"x" * 1_000_000}" shell="true"/></launch>',
        "a word of a command line has more than",
    ),
    "elements in elements": (lambda folder: "<group>" * 100_000, "nested more than"),
    "an alias bomb in a component's parameter file": (
        lambda folder: component(folder, f"{bomb(9)}\n/**:\n  ros__parameters:\n    b: 1\n"),
        "aliases stand for more than",
    ),
}

HARMLESS: dict[str, Callable[[Path], str]] = {
    "an alias bomb as a value": lambda folder: (
        '<launch><node pkg="demo_nodes" exec="talker" name="t">'
        f'<param name="p" value="{alias_bomb_in_one_line()}"/></node></launch>'
    ),
    "a hundred thousand words": executable("x " * 100_000),
    "a megabyte of dollars": lambda folder: f'<launch><let name="a" value="{"$" * 1_000_000}"/></launch>',
    "a megabyte of backslashes": lambda folder: (
        f'<launch><let name="a" value="{chr(92) * 1_000_000}"/></launch>'
    ),
    "a hundred thousand substitutions": lambda folder: (
        f'<launch><let name="b" value="x"/><let name="a" value="{"$(var b)" * 100_000}"/></launch>'
    ),
    "a parameter value of a megabyte": lambda folder: (
        '<launch><node pkg="demo_nodes" exec="talker" name="t">'
        f'<param name="p" value="{"x" * 1_000_000}"/></node></launch>'
    ),
    "an alias bomb in a node's parameter file": lambda folder: parameters(folder, bomb(9)),
    "a parameter file inside itself": lambda folder: parameters(folder, "a: &a [*a]"),
    "a deep parameter file": lambda folder: parameters(folder, "[" * 100_000),
    "a section name full of wildcards": lambda folder: parameters(
        folder, f"{'/**' * 2000}/none:\n  ros__parameters:\n    a: 1\n"
    ),
    "a parameter file that is a device": lambda folder: (
        '<launch><node pkg="demo_nodes" exec="talker" name="t"><param from="/dev/zero"/></node></launch>'
    ),
}


@pytest.mark.parametrize(("make", "told"), HOSTILE.values(), ids=HOSTILE.keys())
def test_it_is_refused_with_the_reason(make: Callable[[Path], str], told: str, tmp_path: Path) -> None:
    (tmp_path / "t.launch.xml").write_text(make(tmp_path))
    run = dry_run(tmp_path, "t.launch.xml")
    assert (run.returncode, "Traceback" in run.stderr) == (1, False), run.stderr[-2000:]
    assert told in run.stderr
    assert len(run.stderr) < 20_000


@pytest.mark.parametrize("make", HARMLESS.values(), ids=HARMLESS.keys())
def test_it_takes_no_long_time(make: Callable[[Path], str], tmp_path: Path) -> None:
    """What a started program is told to refuse is its own business; here it only must not take long."""
    (tmp_path / "t.launch.xml").write_text(make(tmp_path))
    run = dry_run(tmp_path, "t.launch.xml")
    assert (run.returncode, "Traceback" in run.stderr) == (0, False), run.stderr[-2000:]


def inferred(folder: Path, source: str) -> subprocess.CompletedProcess[str]:
    (folder / "talker.py").write_text(f"from rclpy.node import Node\nnode = Node('talker')\n{source}\n")
    command = [sys.executable, "-m", "nodl.verb", "infer", "talker.py"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        command, cwd=folder, env=environment, preexec_fn=_bounded, capture_output=True, text=True, check=False
    )


HOSTILE_SOURCES = {
    "brackets in brackets": "x = " + "(" * 50_000 + ")" * 50_000,
    "signs": "x = " + "-" * 50_000 + "1",
    "a long sum": "x = " + "1 + " * 50_000 + "1",
    "a format without end": f"node.create_publisher(T, '{'%(' * 100_000}' % {{}}, 1)",
    "a text that doubles": "s = 'a'\n" + "s = s + s\n" * 60 + "node.create_publisher(T, s, 1)",
    "a text that is multiplied": "node.create_publisher(T, 'a' * 10**9 * 10**9, 1)",
    "a number that grows": "node.create_publisher(T, str(9**9**9**9), 1)",
    "branches": "s = ''\n" + "s = s + ('a' if c else 'b')\n" * 60 + "node.create_publisher(T, s, 1)",
}


@pytest.mark.parametrize("source", HOSTILE_SOURCES.values(), ids=HOSTILE_SOURCES.keys())
def test_inference_of_a_foreign_source_takes_no_long_time(source: str, tmp_path: Path) -> None:
    run = inferred(tmp_path, source)
    assert (run.returncode in (0, 1), "Traceback" in run.stderr) == (True, False), run.stderr[-2000:]
