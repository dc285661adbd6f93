"""Compile programs, run them under seeds and parameters, and compare what they made with what inference says."""

from __future__ import annotations

import random
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from nodl.infer import InferredSystem, infer_paths
from nodl.infer.results import UNDECIDED
from nodl.names import InvalidNameError, expand_name
from nodl.node_interface import Certainty
from tests.nodl.infer.cpp.random_programs.generator import HEAD, TYPES, Program
from tests.nodl.infer.cpp.workspace import gaps, package

STAND_IN = Path(__file__).with_name("rclcpp_stand_in.hpp")
COMPILER = ["g++", "-std=c++17", "-O0", "-w", "-D_GLIBCXX_ASSERTIONS", "-Werror=return-type"]
Interface = tuple[str, str]  # kind and final name; of a node its kind is "node"
Scenario = Mapping[str, str]  # parameters


class Run(NamedTuple):
    """``status``: 0, 1 after an exception that nobody caught, 2 if it crashed or did not end."""

    scenario: Scenario
    made: frozenset[Interface]
    status: int


class Verdict(NamedTuple):
    """``silent``: made and not covered; ``false``: certain, without a note of a condition, and made by no run.
    ``whole``: without gaps and open names.
    """

    silent: frozenset[Interface]
    false: frozenset[Interface]
    whole: bool


def scenarios(program: Program, seed: int) -> list[Scenario]:
    """The defaults, and some values that a launch may give."""
    choose = random.Random(seed)
    values = {"text": ("left", "base"), "number": ("0", "2"), "truth": ("true", "false")}
    given = {name: choose.choice(values[kind]) for name, kind in program.parameters.items()}
    return [{}, given] if given else [{}]


def compiled(programs: Sequence[Program], folder: Path, seeds: Iterable[int]) -> Path:
    """All in one executable, each in a namespace; ``subprocess.CalledProcessError`` where one is not valid."""
    folder.mkdir(parents=True, exist_ok=True)
    header = folder / "stand_in.hpp"
    if not header.with_suffix(".hpp.gch").exists():
        header.write_text(STAND_IN.read_text() + re.sub(r"^#include.*\n", "", HEAD, flags=re.M) + TYPES)
        subprocess.run([*COMPILER, "-x", "c++-header", header, "-o", f"{header}.gch"], check=True)
    text, calls = [], []
    for number, program in enumerate(programs):
        body = re.sub(
            r"^#include.*\n",
            "",
            program.files["src/main.cpp"].removeprefix(HEAD).removeprefix(TYPES),
            flags=re.M,
        )
        text.append(f'#line 1 "program {number}"\nnamespace p{number} {{\n{body}\n}}')
        for at, scenario in enumerate(scenarios(program, number)):
            words = " ".join(f"{name}={value}" for name, value in scenario.items())
            calls += [f'in_a_process("{number} {at}", p{number}::main, {seed}, "{words}");' for seed in seeds]
    source = folder / "programs.cpp"
    source.write_text("\n".join([*text, "int main() {", *calls, "}"]))
    command: list[str | Path] = [*COMPILER, "-include", header, source, "-o", folder / "programs"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return folder / "programs"


def runs(programs: Sequence[Program], folder: Path, seeds: Iterable[int]) -> list[list[Run]]:
    """What each program made, run by run."""
    output = subprocess.run(
        [compiled(programs, folder, seeds)], check=True, capture_output=True, text=True
    ).stdout
    found: list[list[Run]] = [[] for _ in programs]
    for one in output.split("RUN ")[1:]:
        head, *lines = one.splitlines()
        number, at, _ = map(int, head.split())
        pairs = [line.split(" ", 1) for line in lines if line]
        ended = [pair[1] for pair in pairs if pair[0] == "END"]
        made = frozenset((kind, name) for kind, name in pairs if kind != "END")
        found[number].append(
            Run(scenarios(programs[number], number)[at], made, int(ended[0]) if ended else 2)
        )
    return found


def judged(program: Program, made: Sequence[Run], folder: Path) -> Verdict:
    """Compare the runs with what inference says under their parameters."""
    system = infer_paths([package(folder / "demo", program.files)])
    has_gaps = bool(gaps(system))
    silent: set[Interface] = set()
    certain: set[Interface] = set()
    is_open = False
    for scenario in {tuple(run.scenario.items()) for run in made}:
        claim = _claim(system, dict(scenario))
        certain |= claim.certain
        is_open = is_open or bool(claim.patterns)
        of_these = [run for run in made if tuple(run.scenario.items()) == scenario and run.status != 2]
        silent |= {
            each for run in of_these for each in run.made if not claim.covers(each) and _valid(each[1])
        }
    # What an exception that nobody catches leaves out has no note.
    ended = not any(run.status for run in made)
    false = certain - {each for run in made for each in run.made} if ended else set()
    return Verdict(frozenset(() if has_gaps else silent), frozenset(false), not has_gaps and not is_open)


class _Claim(NamedTuple):
    """``certain``: without a note; ``noted``: under a condition."""

    certain: set[Interface]
    noted: set[Interface]
    patterns: list[tuple[str, re.Pattern[str]]]

    def covers(self, made: Interface) -> bool:
        known = any(kind == made[0] and pattern.fullmatch(made[1]) for kind, pattern in self.patterns)
        return known or made in self.certain or made in self.noted


def _claim(system: InferredSystem, parameters: Mapping[str, object]) -> _Claim:
    claim = _Claim(set(), set(), [])
    for node in system.nodes:
        if node.name is None or node.namespace is None:
            claim.patterns.append(("node", re.compile(".*")))
        else:
            claim.noted.add(("node", expand_name(node.name, namespace=node.namespace, node="x")))
        for endpoint in node.endpoints:
            kind = endpoint.kind.value
            for text in {filled.text for filled in endpoint.name.fill_each(parameters)}:
                if endpoint.certainty in (Certainty.EXACT, Certainty.FROM_DEFAULT) and "*" not in text:
                    conditional = endpoint.note == UNDECIDED or endpoint.name != endpoint.name.unconditional
                    final = _final(text, node.name, node.namespace)
                    (claim.noted if conditional or not final else claim.certain).add((kind, final))
                else:
                    start = "" if text.startswith(("/", "*")) else ".*/"
                    claim.patterns.append((kind, re.compile(start + re.escape(text).replace(r"\*", ".*"))))
    return claim


def _final(name: str, node: str | None, namespace: str | None) -> str:
    try:
        return expand_name(name, namespace=namespace or "/", node=node or "unknown")
    except InvalidNameError:
        return ""


def _valid(name: str) -> bool:
    """rclcpp refuses the others."""
    return re.fullmatch(r"(/[A-Za-z_]\w*)+", name) is not None and "__" not in name
