"""What a program makes where inference cannot know it: a gap with its cause, and how far inference goes at all."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from enclave_addons.inference import infer_paths
from enclave_addons.inference.kernel import machine
from enclave_addons.inference.python import run
from tests.addons.inference.conftest import Infer

HEAD = "import rclpy, sys\nfrom rclpy.node import Node\nfrom std_msgs.msg import String\n"
NODE = "node = rclpy.create_node('n')\n"
GAPS: dict[str, tuple[str, list[str]]] = {
    "a function that is named, and called by nobody that is known": (
        NODE + "def make():\n    node.create_publisher(String, 'a', 1)\nsome = getattr(sys, 'x')\nTABLE = make\n"
        "class C:\n    def late(self):\n        node.create_publisher(String, 'b', 1)\nc = C()\nX = c.late\n",
        ["make() may be called from somewhere", "late() may be called from somewhere"],
    ),
    "a function that nobody names": (NODE + "def make():\n    node.create_publisher(String, 'a', 1)\n", []),
    "a side that a constant closes": (NODE + "D = False\nif D:\n    node.create_publisher(String, 'a', 1)\n", []),
    "a node in unknown hands": (NODE + "import others\nothers.use(node)\n", ["the node is handed to others.use"]),
    "a node in the hands of numpy": (NODE + "import numpy\nnumpy.array([node])\n", []),
    "a ROS package that cannot be read": (
        NODE + "from moveit_helpers import Arm\nArm()\n", ["moveit_helpers.Arm() is of a ROS package"],
    ),
    "a module in a folder without __init__.py that is not there": (
        NODE + "import lib.command\nlib.command.use(node)\n", ["the node is handed to lib.command.use"],
    ),
    "parameters of generate_parameter_library": (
        NODE + "from robot.robot_parameters import robot\nrobot.ParamListener(node)\n", [],
    ),
    "a listener of another library": (
        NODE + "from robot.tools import robot\nrobot.ParamListener(node)\n", ["the node is handed to robot.tools"],
    ),
    "a name that is different at each start": (
        "import uuid\nnode = rclpy.create_node(f'client_{str(uuid.uuid4())[:8]}')\n"
        "node.create_publisher(String, 'a', 1)\n", [],
    ),
    "a topic that is different at each start": (
        NODE + "import uuid\nnode.create_publisher(String, f'a_{uuid.uuid4().hex}', 1)\n", [],
    ),
    "a name that is different at each start and has no beginning of its own": (
        "import uuid\nnode = rclpy.create_node('x' + uuid.uuid4().hex)\n"
        "node.create_publisher(String, 'a', 1)\n", ["the name of this node is made at run time"],
    ),
    "a library that knows nothing of ROS": (NODE + "import torch\ntorch.nn.Linear(1, 2)\n", []),
    "code made at run time": (NODE + "exec(input())\n", ["code made at run time"]),
    "an interface on something unknown": (
        NODE + "import others\nothers.thing().create_publisher(String, 'a', 1)\n", ["the node of this interface"],
    ),
    "arguments of the process that the program changes": (
        "rclpy.init(args=sys.argv + ['-r', 'a:=b'])\n" + NODE, ["remap rules or parameters given in code"],
    ),
}  # fmt: skip


def _whys(infer: Infer, program: str) -> list[str]:
    system = infer(HEAD + program)
    return [gap.why for gap in (*system.gaps, *(gap for node in system.nodes for gap in node.gaps))]


@pytest.mark.parametrize("case", GAPS)
def test_what_is_not_known_is_a_gap_and_its_neighbour_is_not(case: str, infer: Infer) -> None:
    program, expected = GAPS[case]
    found = _whys(infer, program)
    assert len(found) == len(expected)
    assert all(any(why.startswith(start) for why in found) for start in expected), found


def test_one_cause_is_one_gap_with_its_first_places(infer: Infer) -> None:
    (why,) = _whys(infer, NODE + "import others\n" + "others.use(node)\n" * 5)
    assert why.endswith("(5 places: main.py:6, main.py:7, main.py:8, ...)")


def test_a_program_with_more_than_ten_causes_is_one_gap(infer: Infer) -> None:
    calls = "".join(f"import tf2_x{n}\ntf2_x{n}.Make()\n" for n in range(11))
    (why,) = _whys(infer, NODE + calls)
    assert why.startswith("this program is not followed: 11 places, first: tf2_x0.Make()")


TOO_MUCH: dict[str, str] = {
    "closures that call each other": "f = lambda x: x\n" + "f = (lambda g: lambda x: g(g(x)))(f)\n" * 40
    + "create = f\n",
    "loops in loops": "".join(f"{' ' * n}for x{n} in range(60):\n" for n in range(6))
    + "      node.create_publisher(String, f'a{x0}', 1)\n",
    "a number that grows": "n = 1\nwhile n < 10**9:\n    n += 1\n",
}  # fmt: skip


@pytest.mark.parametrize("case", TOO_MUCH)
def test_counted_steps_end_every_program(case: str, infer: Infer, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[int] = []
    really = machine.Machine.step

    def counted(self: machine.Machine, count: int = 1) -> None:
        steps.append(count)
        really(self, count)

    monkeypatch.setattr(machine.Machine, "step", counted)
    infer(HEAD + NODE + TOO_MUCH[case] + ("f(1)\n" if "create" in TOO_MUCH[case] else ""))
    assert sum(steps) <= machine.MAX_STEPS + 1


def test_a_program_that_is_given_up_says_so_and_nothing_more(infer: Infer) -> None:
    (why,) = _whys(infer, NODE + TOO_MUCH["loops in loops"] + NODE.replace("'n'", "'m'"))
    assert why.startswith("this program was given up after")


def test_loops_deep_in_others_that_only_compute_something_are_not_run_turn_by_turn(infer: Infer) -> None:
    loops = "".join(f"{' ' * n}for x{n} in range(60):\n" for n in range(6)) + "      total = x5 * 2\n"
    assert _whys(infer, loops + NODE) == []


def test_callbacks_that_start_each_other_with_growing_numbers_come_to_an_end(infer: Infer) -> None:
    program = (
        "class A(Node):\n"
        "    def __init__(self):\n        super().__init__('a')\n        self.again(1)\n"
        "    def again(self, wait):\n"
        "        self.create_publisher(String, 'a', 1)\n"
        "        self.create_timer(wait, lambda: self.again(wait * 2))\n"
        "rclpy.spin(A())\n"
    )
    assert _whys(infer, program) == []


def test_a_mistake_of_the_analyser_is_a_gap_of_that_program_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:

    def fail(*_: object) -> int:
        raise KeyError("injected")

    for name, extra in (("good.py", ""), ("bad.py", "assert True\n")):
        (tmp_path / name).write_text(HEAD + extra + NODE + "node.create_publisher(String, 'a', 1)\n")

    monkeypatch.setitem(run.STATEMENTS, ast.Assert, fail)
    system = infer_paths([tmp_path])
    (gap,) = system.gaps
    assert "the analysis failed (KeyError at test_gaps.py" in gap.why
    assert [str(each.name) for node in system.nodes for each in node.endpoints] == ["a"]
