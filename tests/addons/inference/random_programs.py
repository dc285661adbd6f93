"""Random programs, which change variables, fields and containers in the ways in which Python calls a function.

``mechanisms.programs`` lists those ways. A program takes up to three of them, under tests, loops, exceptions and
callbacks, and makes interfaces that are named by what the places hold then. The same seed gives the same program.
"""

from __future__ import annotations

import random
import re
import textwrap
from pathlib import Path
from typing import NamedTuple

from enclave_addons.inference import infer_paths
from tests.addons.inference.recorder import Fact, record
from tests.addons.inference.test_deceptions import claim

MECHANISMS = re.split(
    r"^# --- .*\n", (Path(__file__).parent / "mechanisms.programs").read_text(), flags=re.M
)[1:]
OTHER = """\
T = 'a'
def text(name):
    global T
    T = name
"""
"""A second module of the program."""


class Place(NamedTuple):
    """How a name gets there, how it is read, and what declares the variable in a function."""

    write: str
    read: str
    declared: str = ""


PLACES = (
    Place("TOPIC = {}", "TOPIC", "global TOPIC"),
    Place("local = {}", "local", "nonlocal local"),
    Place("other.T = {}", "other.T"),
    Place("other.text({})", "other.T"),
    Place("kept.topic = {}", "kept.topic"),
    Place("setattr(kept, 'topic', {})", "kept.topic"),
    Place("Kept.shared = {}", "kept.shared"),
    Place("kept.perhaps = None if choose() else {}", "kept.perhaps or 'none'"),
    Place("kept.inner = Kept({})", "kept.inner.topic"),
    Place("kept.made = lambda: {}", "kept.made()"),
    Place("kept.names = [{}]", "kept.names[0]"),
    Place("items[0] = {}", "items[0]"),
    Place("items.append({})", "items[-1]"),
    Place("table['key'] = {}", "table['key']"),
    Place("table.update(key={})", "table['key']"),
    Place("kept.topic = {}", "copy.deepcopy(kept).topic"),
    Place("kept.names = [{}]", "copy.copy(kept).names[0]"),
    Place("copy.copy(kept).names[0] = {}", "kept.names[0]"),
    Place("copy.deepcopy(kept).names[0] = {}", "kept.names[0]"),
    Place("kept.inner = copy.deepcopy(Kept({}))", "kept.inner.topic"),
    Place("items[0] = {}", "copy.deepcopy([items])[0][0]"),
    Place("table['key'] = {}", "copy.copy(table)['key']"),
)
WAYS = (
    "{}",
    "{}",
    "if choose():\n    {}",
    "for _ in range(2):\n    {}",
    "while choose():\n    {}",
    "try:\n    {}\n    raise ValueError\nexcept ValueError:\n    pass",
    "try:\n    pass\nfinally:\n    {}",
    "with contextlib.suppress(ValueError):\n    {}",
    "node.create_timer(1.0, lambda: {})\nrclpy.spin_once(node)",
    "[{} for _ in range(2)]",
)
INTERFACES = (
    "node.create_publisher(String, {}, 10)",
    "node.create_subscription(String, {}, print, 10)",
    "node.create_client(Empty, {})",
)
START = """\
import argparse, ast, asyncio, collections, concurrent.futures, contextlib, copy, dataclasses, enum, functools, io
import itertools, json, operator, queue, re, sys, threading, types, weakref
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Empty
from tosses import choose
import other
TOPIC = 'a'
class Kept:
    shared = 'a'
    def __init__(self, topic='a'):
        self.topic, self.perhaps, self.names = topic, None, [topic]
        self.made = lambda: topic
def main():
    rclpy.init()
    node = Node('n')
    kept, local, items, table = Kept(), 'a', ['a'], {'key': 'a'}
    kept.inner = Kept()
"""


def random_program(seed: int) -> str:
    """Return the program of this seed; it imports ``OTHER`` as ``other``."""
    chance = random.Random(seed)
    lines = [START]
    for number in range(chance.randint(1, 3)):
        place, again = chance.choice(PLACES), chance.choice(PLACES)
        again = chance.choice((place, place, again))
        call = f"part{number}()"
        body = chance.choice(MECHANISMS).replace("AGAIN", again.write.format(f"'c{number}'"))
        change = _function("change()", place.write.format(f"'z{number}'"), place)
        change += _function("again()", again.write.format(f"'d{number}'"), again)
        part = _function(call, change + body, again)
        interface = chance.choice(INTERFACES).format(chance.choice((place, place, again)).read)
        lines += [part, chance.choice(WAYS).format(call), interface]
    lines += ["rclpy.spin(node)", chance.choice(INTERFACES).format(chance.choice(PLACES).read)]
    return "\n".join([lines[0], *(textwrap.indent(each, "    ") for each in lines[1:]), "main()\n"])


def _function(head: str, body: str, place: Place) -> str:
    return f"def {head}:\n" + textwrap.indent(f"{place.declared or 'pass'}\n{body}\n", "    ")


def silently_missing(seed: int, folder: Path) -> set[Fact]:
    """Return what the program of this seed makes in some run and inference neither lists nor leaves open."""
    file = folder / "program.py"
    file.write_text(random_program(seed), encoding="utf-8")
    (folder / "other.py").write_text(OTHER, encoding="utf-8")
    claimed = claim(infer_paths([file]), {})
    made = {fact for toss in range(4) for fact in record(file, {}, toss)}
    return {fact for fact in made if not claimed.covers(fact)}
