"""``exact`` means that the name of an interface is known, not that every run makes it. In C++ a note says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from enclave_addons.inference.kernel.results import UNDECIDED as UNDECIDED_NOTE
from enclave_addons.inference.report.written import expand, to_json, to_text
from nodl.node_interface import Certainty
from tests.addons.inference.cpp.workspace import gaps, in_class, infer

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "void pub(std::string t) { create_publisher<std_msgs::msg::String>(t, 1); }\n"
UNDECIDED = {
    "an if": ('if (std::rand() > 5) { pub("a"); }', {"a"}),
    "both sides of it": ('if (std::rand() > 5) { pub("a"); } else { pub("b"); }', {"a", "b"}),
    "one of two names": ('pub(std::rand() > 5 ? "a" : "b");', {"a", "b"}),
    "a catch": ('try { std::rand(); } catch (...) { pub("a"); }', {"a"}),
    "a switch": ('switch (std::rand()) { case 1: pub("a"); break; case 2: pub("b"); }', {"a", "b"}),
    "a loop": ('while (std::rand() > 5) { pub("a"); }', {"a"}),
    "a second operand": ('std::rand() > 5 && (pub("a"), true);', {"a"}),
    "behind a way out": ('if (std::rand() > 5) { return; } pub("a");', {"a"}),
    "behind the end of a turn": (
        'for (int i = 0; i < 2; ++i) { if (std::rand() > 5) { continue; } pub("a"); }',
        {"a"},
    ),
    "a callback under a condition": (
        'if (std::rand() > 5) { create_wall_timer(1s, [this]() { pub("a"); }); }',
        {"a"},
    ),
    "a parameter": ('if (declare_parameter<bool>("on", true)) { pub("a"); }', {"a"}),
}
DECIDED = {
    "before a way out": ('pub("a"); if (std::rand() > 5) { return; }', {"a"}),
    "behind two sides": ('if (std::rand() > 5) { std::rand(); } else { std::rand(); } pub("a");', {"a"}),
    "a known condition": ('if (1 < 2) { pub("a"); }', {"a"}),
    "a known number of turns": ("for (int i = 0; i < 2; ++i) { pub(std::to_string(i)); }", {"0", "1"}),
    "once certainly": ('pub("a"); if (std::rand() > 5) { pub("a"); }', {"a"}),
    "a callback": ('create_wall_timer(1s, [this]() { pub("a"); });', {"a"}),
    "a callback behind a condition": (
        'if (std::rand() > 5) { std::rand(); } create_wall_timer(1s, [this]() { pub("a"); });',
        {"a"},
    ),
}


def certainties(system: InferredSystem) -> dict[str, Certainty]:
    return {str(e.name): e.certainty for node in system.nodes for e in node.endpoints}


@pytest.mark.parametrize(("body", "made"), UNDECIDED.values(), ids=UNDECIDED)
def test_under_an_undecided_condition_the_name_is_exact(body: str, made: set[str], tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, PUB))
    assert certainties(system) == dict.fromkeys(made, Certainty.EXACT)
    assert {e.note for node in system.nodes for e in node.endpoints} == {UNDECIDED_NOTE}
    assert gaps(system) == []


def test_the_note_is_in_what_is_written_down(tmp_path: Path) -> None:
    system = expand(infer(tmp_path, in_class('pub("a"); if (std::rand() > 5) { pub("b"); }', PUB)))
    (node,) = json.loads(to_json(system))["nodes"]
    assert [each.get("note") for each in node["interfaces"]] == [None, UNDECIDED_NOTE]
    a, b = to_text(system).splitlines()[1:]
    assert "[std_msgs/msg/String]  /" in a
    assert f"[std_msgs/msg/String]  [{UNDECIDED_NOTE}]  /" in b


def test_a_name_from_python_that_a_parameter_decides_says_the_same(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    body = "if node.declare_parameter('on', True).value:\n    pub('a')\npub('b')"
    program.write_text(_PYTHON + body, encoding="utf-8")
    (node,) = expand(infer_paths([program])).nodes
    assert [(each.name, each.note) for each in node.interfaces] == [("/a", UNDECIDED_NOTE), ("/b", "")]


@pytest.mark.parametrize(("body", "made"), DECIDED.values(), ids=DECIDED)
def test_without_one_it_has_no_note(body: str, made: set[str], tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, PUB))
    assert certainties(system) == dict.fromkeys(made, Certainty.EXACT)
    assert {e.note for node in system.nodes for e in node.endpoints} == {""}


_PYTHON = """\
import random, rclpy
from std_msgs.msg import String
node = rclpy.create_node('n')
def pub(name):
    node.create_publisher(String, name, 1)
"""
UNDECIDED_IN_PYTHON = {
    "an if": ("if random.random() > 0.5:\n    pub('a')", {"a"}),
    "one of two names": ("pub('a' if random.random() > 0.5 else 'b')", {"a", "b"}),
    "a library": ("try:\n    import there\n    pub('a')\nexcept ImportError:\n    pub('b')", {"a", "b"}),
    "a name of a library": (
        "try:\n    from there import x\n    name = 'a'\nexcept ImportError:\n    name = 'b'\npub(name)",
        {"a", "b"},
    ),
}


@pytest.mark.parametrize(("body", "made"), UNDECIDED_IN_PYTHON.values(), ids=UNDECIDED_IN_PYTHON)
def test_python_says_the_same(body: str, made: set[str], tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(_PYTHON + body, encoding="utf-8")
    system = infer_paths([program])
    assert certainties(system) == dict.fromkeys(made, Certainty.EXACT)
    assert gaps(system) == []


@pytest.mark.parametrize(
    ("body", "certainty"),
    [
        ('if (std::rand() > 5) { pub("a_" + std::string(std::getenv("X"))); }', Certainty.PATTERN),
        ('if (std::rand() > 5) { pub(std::getenv("X")); }', Certainty.UNKNOWN),
    ],
)
def test_a_name_that_is_not_known_is_not_exact_there_either(
    body: str, certainty: Certainty, tmp_path: Path
) -> None:
    system = infer(tmp_path, in_class(body, PUB))
    assert set(certainties(system).values()) == {certainty}


def test_what_a_decided_condition_leaves_out_is_not_listed(tmp_path: Path) -> None:
    system = infer(tmp_path, in_class('if (1 > 2) { pub("a"); } else { pub("b"); }', PUB))
    assert set(certainties(system)) == {"b"}
