"""The same input gives the same bytes: on a slow machine, under any hash seed, and when a budget ends the analysis."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from enclave_addons.inference.report.written import expand, to_json
from nodl.name_template import UnknownPart

pytestmark = pytest.mark.usefixtures("no_cache")

# Each level of calls doubles the work: without a budget this would take minutes.
_ENDLESS = "\n".join(
    (
        "from rclpy.node import Node",
        "from std_msgs.msg import String",
        "class N(Node):",
        "    def __init__(self):",
        "        super().__init__('n')",
        "        self.seen = {}",
        "        self.create_publisher(String, 'before', 10)",
        "        self.step0('a')",
        "        self.create_publisher(String, 'after', 10)",
        *(
            f"    def step{level}(self, text):\n"
            f"        self.seen[text] = [text, self.seen]\n"
            f"        self.step{level + 1}(text + 'l')\n"
            f"        self.step{level + 1}(text + 'r')"
            for level in range(20)
        ),
        "    def step20(self, text):",
        "        self.seen[text] = text",
        "N()",
    )
)
_SETS = """
    from rclpy.node import Node
    from std_msgs.msg import String
    class N(Node):
        def __init__(self, names):
            super().__init__('n')
            for name in {*names, 'x', 'y'}:
                self.create_publisher(String, name + '/state', 10)
                self.create_publisher(String, self.declare_parameter(name, name).value, 10)
    N({'front', 'rear', 'left', 'right'})
"""

_SECURE_NODL = "import sys; from nodl.verb import main; sys.exit(main())"


@pytest.fixture
def slow_clocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every look at a clock finds that an hour has passed."""

    def hours() -> Iterator[float]:
        now = 0.0
        while True:
            now += 3600
            yield now

    clock = hours()
    for name in ("process_time", "perf_counter", "monotonic", "time", "thread_time"):
        monkeypatch.setattr(time, name, lambda: next(clock))


def _json(path: Path) -> str:
    return to_json(expand(infer_paths([path])))


def test_a_budget_ends_at_the_same_step_whatever_the_clock_says(
    tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.interpreter.run.MAX_STEPS", 60_000)  # keeps the test short
    program = tmp_path / "endless.py"
    program.write_text(_ENDLESS)
    plain = _json(program)
    assert "the analysis was given up" in plain
    assert '"/before"' in plain
    request.getfixturevalue("slow_clocks")
    assert _json(program) == plain


def test_a_program_of_which_something_stays_unknown_is_given_up_earlier(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.interpreter.run.MAX_STEPS", 60_000)
    monkeypatch.setattr("enclave_addons.inference.interpreter.run.MAX_STEPS_IN_VAIN", 10_000)
    program = tmp_path / "endless.py"
    program.write_text(_ENDLESS)
    assert "more than 60000 steps" in _json(program)
    program.write_text(_ENDLESS.replace("'before'", "input()"))
    assert "more than 10000 steps" in _json(program)


def test_a_program_that_is_too_large_is_given_up_and_says_what_that_means(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.interpreter.run.MAX_STEPS", 60_000)
    program = tmp_path / "endless.py"
    program.write_text(_ENDLESS)
    assert [gap.why for gap in infer_paths([program]).gaps] == [
        "the analysis was given up: more than 60000 steps; any interface beside those listed is possible"
    ]
    loops = " ".join(f"for {name} in range(60)" for name in "abcd")
    program.write_text(f"import rclpy\nrclpy.create_node('n')\nNAMES = [a + b + c + d {loops}]\n")
    assert not infer_paths([program]).gaps  # so many turns are not followed one by one


def test_the_hash_seed_does_not_change_a_byte(tmp_path: Path, infer: Callable[..., InferredSystem]) -> None:
    infer(_SETS)
    found = {_in_fresh_process(tmp_path, seed) for seed in ("0", "1", "2")}
    assert len(found) == 1
    assert b'"/front/state"' in found.pop()


def _in_fresh_process(folder: Path, seed: str) -> bytes:
    command = [sys.executable, "-c", _SECURE_NODL, "infer", str(folder), "--format", "json"]
    environment = {**os.environ, "PYTHONHASHSEED": seed}
    return subprocess.run(command, env=environment, check=True, capture_output=True).stdout


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("input()", "text that the user types"),
        ("','.join(open('f'))", "joined texts"),
        ("open('f').read()", "a result of builtins"),
    ],
)
def test_the_reason_of_a_gap_is_of_its_own_program(tmp_path: Path, text: str, why: str) -> None:
    """Also after other programs with a gap in a name of the same form."""
    program = tmp_path / "program.py"
    before = "import rclpy\nnode = rclpy.create_node('n')\n"
    program.write_text(f"{before}node.create_publisher(object, 'a/' + {text}, 1)\n")
    (node,) = infer_paths([program]).nodes
    (part,) = [part for part in node.endpoints[0].name.parts if isinstance(part, UnknownPart)]
    assert part.why == why


def test_a_huge_literal_costs_little_and_is_said(tmp_path: Path) -> None:
    program = tmp_path / "table.py"
    program.write_text("TABLE = [" + "1," * 600_000 + "]\n")
    system = infer_paths([program])
    assert [gap.why for gap in system.gaps] == ["the file is too large to be a program"]


def test_nested_comprehensions_are_bounded(
    names: Callable[..., list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.interpreter.run.MAX_STEPS", 60_000)
    loops = " ".join(f"for {name} in range(60)" for name in "abcd")
    assert names(f"NAMES = [a + b + c + d {loops}]") == []


@pytest.mark.parametrize(
    "body",
    [
        "x = 'a'\n" + "x = x + x\n" * 60,
        "x = 'a'\n" + "x = f'{x}{x}'\n" * 60,
        "x = 'a'\n" + "x = x.replace('a', 'aaaaaaaa')\n" * 20,
        "x = 'a'.ljust(10 ** 4 * 10 ** 4 * 10 ** 3)",
        "x = 'a'.ljust(99999999999)",
        "x = f'{1:>99999999999}'",
        "x = '%99999999999d' % 1",
        "x = '{:99999999999}'.format(1)",
        "x = ''.join(['a' * 200] * 64) * 200",
        "x = 9 ** 9 ** 9 ** 9\nx = 1 << 99999999999",
    ],
)
def test_no_text_or_number_grows_without_end(body: str, names: Callable[..., list[str]]) -> None:
    text = f"import rclpy\n{body}\nnode = rclpy.create_node('n')\nnode.create_publisher(object, str(x), 1)\n"
    (name,) = names(text)
    assert len(name) < 20_000


@pytest.mark.parametrize(
    "text",
    [
        "str(uuid.uuid4())",
        "str(f)",
        "f'{f}'",
        "'%s' % f",
        "str([f])",
        "repr(itertools.count())",
        "str(iter([1]))",
        "str(g())",
        "str(object())",
    ],
)
def test_no_address_of_an_object_becomes_a_name(text: str, names: Callable[..., list[str]]) -> None:
    before = "import itertools, uuid, rclpy\ndef f(): pass\ndef g(): yield 1\n"
    program = f"{before}node = rclpy.create_node('n')\nnode.create_publisher(object, 'a/' + {text}, 1)\n"
    (name,) = names(program)
    assert "?" in name
    assert "0x" not in name


@pytest.mark.parametrize(
    "statement",
    [
        "list(itertools.count())",
        "sorted(itertools.repeat('x'))",
        "sum(itertools.count())",
        "dict(zip(g(), g()))",
        "[each for each in g()]",
        "re.match('(a+)+$', 'a' * 40 + 'b')",
    ],
)
def test_what_never_ends_is_given_up(statement: str, names: Callable[..., list[str]]) -> None:
    before = (
        "import itertools, re, rclpy\ndef g():\n    while True: yield 'x'\nnode = rclpy.create_node('n')\n"
    )
    assert names(f"{before}node.create_publisher(object, 'a', 1)\n{statement}\n") == ["a"]
