"""A document that inference writes grants exactly what inference grants in the launch, and to no other program."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import infer_executable
from enclave_addons.inference.report.v2_report import open_questions, to_v2
from enclave_addons.library.apply import applied
from nodl.dependence import Situation
from nodl.document.v2 import parse_v2
from nodl.node_interface import NodeInterface

PROGRAM = """#!/usr/bin/python3
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
class N(Node):
    def __init__(self):
        super().__init__('n')
        def p(name, default):
            return self.declare_parameter(name, default).value
        {body}
    def P(self, name):
        self.create_publisher(String, name, 10)
rclpy.init()
rclpy.spin(N())
"""


def _inferred(prefix: Path, body: str) -> NodeInterface:
    (prefix / "share/ament_index/resource_index/packages").mkdir(parents=True)
    (prefix / "share/ament_index/resource_index/packages/demo").touch()
    file = prefix / "lib/demo/program"
    file.parent.mkdir(parents=True)
    file.write_text(PROGRAM.format(body=body.replace("\n", "\n        ")), encoding="utf-8")
    file.chmod(0o755)
    (node,) = infer_executable("demo", "program", prefixes=[str(prefix)]).interfaces
    return node


def _names(node: NodeInterface, parameters: dict[str, object]) -> set[str]:
    return {name.text for endpoint in node.endpoints for name in endpoint.name.fill_each(parameters)}


class _NoDocuments:
    def of_class(self, plugin_class: str, instance: str = "") -> None:
        return None

    def named(self, name: str) -> None:
        return None

    def transports(self) -> tuple[tuple[str, str, NodeInterface], ...]:
        return ()


CASES: dict[str, tuple[str, list[dict[str, object]]]] = {
    "a truth value": (
        "if p('debug', False):\n    self.P('debug')\nself.P('always')",
        [{}, {"debug": True}, {"debug": False}],
    ),
    "its opposite": ("if not p('quiet', False):\n    self.P('log')", [{}, {"quiet": True}]),
    "a text": ("if p('mode', 'a') == 'b':\n    self.P('b')\nelse:\n    self.P('other')", [{}, {"mode": "b"}]),
    "a set of texts": (
        "if p('mode', 'a') in ('a', 'b'):\n    self.P('ab')",
        [{}, {"mode": "b"}, {"mode": "c"}],
    ),
    "the truth of a text": (
        "t = p('topic', '')\nif t:\n    self.P(t)\nself.P('x')",
        [{}, {"topic": "chatter"}],
    ),
    "a name and a test": (
        "t = p('topic', 'chatter')\nif p('debug', True):\n    self.P(t)",
        [{}, {"topic": "speech"}, {"debug": False, "topic": "speech"}],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_document_grants_what_live_inference_grants(case: str, tmp_path: Path) -> None:
    body, launches = CASES[case]
    node = _inferred(tmp_path, body)
    assert not node.gaps
    ((file, text),) = to_v2([node]).items()
    questions = open_questions(node)
    read = parse_v2(text.encode(), file, package=None, name="program").interface
    assert (read.package, read.executable, read.name) == ("demo", "program", "n")
    assert bool(questions) == (case == "the truth of a text"), questions
    for parameters in [] if questions else launches:
        situation = Situation("jazzy", "n", "/", parameters)
        described = applied(read, situation, _NoDocuments()).interface
        assert _names(described, {}) == _names(node, parameters), parameters


DRIVERS = """
class Usb:
    def start(self, node): node.P('usb/status')
class Serial:
    def start(self, node): node.P('serial/status')
"""


def test_what_an_object_makes_depends_on_what_decided_that_it_is_there(tmp_path: Path) -> None:
    body = DRIVERS + "d = p('driver', 'usb')\ndriver = Usb() if d == 'usb' else Serial()\ndriver.start(self)"
    node = _inferred(tmp_path, body)
    assert not node.gaps
    assert _names(node, {}) == {"usb/status"}
    assert _names(node, {"driver": "serial"}) == {"serial/status"}


def test_a_parameter_that_a_function_of_the_program_reads_decides(tmp_path: Path) -> None:
    node = _inferred(
        tmp_path, "if p('debug', False):\n    self.P('log')\nelif p('mode', 'a') == 'b':\n    self.P('b')"
    )
    assert not node.gaps
    assert _names(node, {}) == set()
    assert _names(node, {"debug": True, "mode": "b"}) == {"log"}
    assert _names(node, {"mode": "b"}) == {"b"}


def test_a_parameter_decides_what_else_is_known_to_leave_open(tmp_path: Path) -> None:
    rows = "for name, optional in (('gps', False), ('imu', True)):\n"
    skip = "    if optional and not p('all', False):\n        continue\n    self.P(name)"
    node = _inferred(tmp_path, rows + skip)
    assert not node.gaps
    assert _names(node, {}) == {"gps"}
    assert _names(node, {"all": True}) == {"gps", "imu"}


def test_a_parameter_decides_in_a_comprehension(tmp_path: Path) -> None:
    node = _inferred(tmp_path, "[self.P(each) for each in ('left', 'right') if p(each, False)]")
    assert not node.gaps
    assert _names(node, {}) == set()
    assert _names(node, {"right": True}) == {"right"}


def test_an_object_that_is_made_at_several_places_is_there_if_one_of_them_made_it(tmp_path: Path) -> None:
    loop = "driver = None\nfor each in ('a', 'b'):\n    wanted = p(each, False)\n    if wanted:\n        driver = Usb()"
    node = _inferred(tmp_path, DRIVERS + loop + "\nif driver:\n    driver.start(self)")
    assert not node.gaps
    assert _names(node, {}) == set()
    assert _names(node, {"a": True}) == _names(node, {"b": True}) == {"usb/status"}


def test_two_parameters_with_one_default_are_a_question(tmp_path: Path) -> None:
    node = _inferred(tmp_path, "self.P(p('a', 'chatter'))\nself.P(p('b', 'chatter'))")
    (question,) = open_questions(node)
    assert "several interfaces are the publisher chatter by default" in question


def test_what_is_there_in_any_case_has_no_condition(tmp_path: Path) -> None:
    node = _inferred(tmp_path, "if p('debug', False):\n    self.P('x')\nself.P('x')")
    assert not open_questions(node)
    assert "when" not in "".join(to_v2([node]).values())
