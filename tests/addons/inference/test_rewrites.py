"""A program that is rewritten without changing what it makes still lists it, or says that it does not know.

``rewrites.programs`` has the ways; that each changes nothing is seen by running the program before and after.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from enclave_addons.inference import infer_paths
from tests.addons.inference.recorder import Fact, record
from tests.addons.inference.test_deceptions import claim

MODULES = "asyncio, collections, contextlib, copy, dataclasses, enum, functools, itertools, json, operator, os, queue"
PROGRAM = """\
import threading, types
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Empty
from tosses import choose

class Robot(Node):
    def __init__(self):
        super().__init__('robot')
        self.publisher = self.create_publisher(String, 'status', 10)
        for number in range(2):
            self.create_subscription(String, 'heard', self.heard, 10)
        self.create_timer(1.0, self.tick)
        self.declare_parameter('topic', 'real')
        if choose():
            self.set_parameters([Parameter('topic', value='simulated')])
        self.create_publisher(String, self.get_parameter('topic').value, 10)
    def heard(self, message):
        pass
    def tick(self):
        self.create_client(Empty, 'reset')

def stop_service(node):
    with contextlib.suppress(ValueError):
        return node.create_service(Empty, 'stop', print)

def main():
    rclpy.init()
    robot = Robot()
    stop_service(robot)
    rclpy.spin(robot)

main()
"""
CALLS = re.compile(
    r"(?P<node>\w+)\.(?P<method>create_(?P<kind>\w+))\((?P<arguments>\w+, (?P<value>'\w+'), [^\n]*)\)$", re.M
)


class Rewrite(NamedTuple):
    title: str
    definitions: str
    written: str

    def of(self, call: re.Match[str]) -> str:
        """Return the program with this call, or the name in it, written in this way."""
        words = {word.upper(): text for word, text in call.groupdict().items()}
        replaced = "arguments" if self.title.startswith("call: ") else "value"
        start, end = call.span() if replaced == "arguments" else call.span("value")
        program = PROGRAM[:start] + self.written + PROGRAM[end:]
        text = f"import {MODULES}\n{program.replace('class Robot', self.definitions + 'class Robot')}"
        return re.sub("|".join(words), lambda word: words[word[0]], text)


def _rewrites() -> dict[str, Rewrite]:
    text = (Path(__file__).parent / "rewrites.programs").read_text(encoding="utf-8")
    found = {}
    for section in re.split(r"^# --- ", text, flags=re.M)[1:]:
        title, _, rest = section.partition("\n")
        definitions, written = re.split(r"^=> ", rest, flags=re.M)
        found[title] = Rewrite(title, definitions, written.strip())
    return found


REWRITES = _rewrites()


def _made(file: Path) -> set[Fact]:
    return {fact for toss in range(3) for fact in record(file, {}, toss)}


@pytest.mark.parametrize("title", REWRITES)
def test_what_a_rewritten_program_makes_is_listed_or_left_open(title: str, tmp_path: Path) -> None:
    file = tmp_path / "program.py"
    file.write_text(f"import {MODULES}\n{PROGRAM}", encoding="utf-8")
    before = _made(file)
    for call in CALLS.finditer(PROGRAM):
        file.write_text(REWRITES[title].of(call), encoding="utf-8")
        assert _made(file) == before, "the rewriting is wrong"
        claimed = claim(infer_paths([file]), {})
        assert not {fact for fact in before if not claimed.covers(fact)}, file.read_text()
