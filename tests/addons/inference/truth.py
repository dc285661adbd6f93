"""What inference claims about a program, beside what the program makes when it runs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from enclave_addons.inference import InferredSystem
from enclave_addons.inference.python.analysis import infer_program
from enclave_addons.inference.python.program import Program, ProgramTarget
from enclave_addons.inference.start import InferredProgram, LaunchedNode, LaunchKey, ProgramLaunch
from nodl.names import InvalidNameError
from nodl.node_interface import NodeInterface
from nodl.remap import NodeNames, RemapRules, parse_rule
from tests.addons.inference.recorder import Fact, record

SEEDS = range(6)
_PRELUDE = """\
import copy
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Empty
"""


class Case(NamedTuple):
    """A program, and the parameters that a launch sets in each of its scenarios."""

    title: str
    text: str
    scenarios: tuple[dict[str, object], ...]


def read_cases(file: Path) -> Iterator[Case]:
    """Read programs under headings ``# --- title``; a line ``#= {...}`` gives parameters for one more run."""
    for section in re.split(r"^# --- ", file.read_text(), flags=re.M)[1:]:
        title, _, body = section.partition("\n")
        given = [json.loads(line[3:]) for line in body.splitlines() if line.startswith("#= ")]
        yield Case(title, _PRELUDE + body, ({}, *given))


class Claim(NamedTuple):
    """What inference says about a program under some parameters."""

    facts: frozenset[Fact]
    patterns: tuple[tuple[str, re.Pattern[str]], ...]
    gaps: tuple[str, ...]

    def covers(self, fact: Fact) -> bool:
        fits = any(kind == fact[0] and pattern.fullmatch(fact[1]) for kind, pattern in self.patterns)
        return fact in self.facts or fits or bool(self.gaps)

    @property
    def exact(self) -> bool:
        return not self.gaps and not self.patterns


def claim(system: InferredSystem, parameters: dict[str, object]) -> Claim:
    facts: set[Fact] = set()
    patterns: list[tuple[str, re.Pattern[str]]] = []
    gaps = [gap.why for gap in system.gaps]
    for node in system.nodes:
        gaps.extend(gap.why for gap in node.gaps)
        names = _names_of(node)
        facts.add(("node", names.fqn))
        heard = parameters if node.global_arguments is not False else {}
        for endpoint in node.endpoints:
            kind = endpoint.kind.value
            for filled in endpoint.name.fill_each(heard):
                if not filled.is_literal:
                    text = re.escape(filled.text).replace(r"\*", ".*")
                    start = "" if filled.text.startswith(("/", "*")) else "(/.*)?/"
                    patterns.append((kind, re.compile(start + text)))
                    continue
                with suppress(InvalidNameError):  # rcl refuses it as well
                    final = _final(names, kind, filled.text)
                    facts.add((kind, final))
                    if endpoint.introspected:
                        facts.add(("publisher", f"{final}/_service_event"))
    return Claim(frozenset(facts), tuple(patterns), tuple(gaps))


def _names_of(node: NodeInterface) -> NodeNames:
    rules = RemapRules(tuple(map(parse_rule, node.own_rules)))
    name = rules.node_name(node.name or "unknown").name
    return NodeNames(name, rules.namespace(node.namespace or "/", name).name, rules)


def _final(names: NodeNames, kind: str, written: str) -> str:
    if kind.startswith("action"):
        return names.expand(written)
    return (names.service if kind.startswith("service") else names.topic)(written).name


def truth(case: Case, file: Path, parameters: dict[str, object]) -> set[Fact]:
    """Run the program; of one that tosses coins take all that it makes."""
    seeds = SEEDS if "tosses" in case.text else (0,)
    return {fact for seed in seeds for fact in record(file, parameters, seed)}


def infer_launched(file: Path, parameters: dict[str, object]) -> InferredProgram:
    """Infer a program as a launch does, which sets ``parameters`` for each of its nodes."""
    program, target, key = Program([str(file.parent)]), ProgramTarget(str(file)), LaunchKey("demo", "program")
    found = infer_program(program, target, str(file), key)
    if not found.asks_launch:
        return found
    nodes = {
        each.name: LaunchedNode(parameters, each.name, each.namespace)
        for each in found.interfaces
        if each.name
    }
    launch = ProgramLaunch(nodes, dict.fromkeys(found.inputs), ())
    settled = infer_program(program, target, str(file), key, launch, found.lost)
    return settled if settled.interfaces and settled.open_places <= found.open_places else found
