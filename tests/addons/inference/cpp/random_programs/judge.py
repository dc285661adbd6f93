"""Compile programs, run them under seeds and parameters, and compare what they made with what inference says."""

from __future__ import annotations

import random
import re
import subprocess
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_addons.inference import InferredSystem, infer_paths
from enclave_addons.inference.kernel.results import UNDECIDED
from nodl.names import InvalidNameError, expand_name
from nodl.node_interface import Certainty
from tests.addons.inference.cpp.random_programs.generator import HEAD, TYPES, Program
from tests.addons.inference.cpp.workspace import gaps, package

STAND_IN = Path(__file__).with_name("rclcpp_stand_in.hpp")
COMPILER = [
    "g++",
    "-std=c++17",
    "-O0",
    "-g1",
    "-no-pie",
    "-w",
    "-D_GLIBCXX_ASSERTIONS",
    "-Werror=return-type",
]
Interface = tuple[str, str]  # kind and final name; of a node its kind is "node"
Scenario = Mapping[str, str]  # parameters


class Made(NamedTuple):
    """An interface that a run made.

    ``lines``: those of the program that led to it: of the call that makes it, of each call around that one, and of
    the calls that registered the callback in which it stands.
    """

    interface: Interface
    lines: frozenset[int]


class Run(NamedTuple):
    """``status``: 0, 1 after an exception that was not caught, 2 if it crashed or did not end."""

    scenario: Scenario
    made: frozenset[Made]
    status: int

    @property
    def interfaces(self) -> set[Interface]:
        return {each.interface for each in self.made}


class Verdict(NamedTuple):
    """What inference says beside what the runs made.

    ``silent``: made by a run, not listed, and no gap is at a line that led to it.
    ``false``: listed without a condition, and made by no run.
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
        source = program.files["src/main.cpp"]
        body = source.removeprefix(HEAD).removeprefix(TYPES)
        first = source.count("\n") - body.count("\n") + 1
        body = re.sub(r"^#include.*", "", body, flags=re.M)
        text.append(f'namespace p{number} {{\n#line {first} "program {number}"\n{body}\n}}')
        for at, scenario in enumerate(scenarios(program, number)):
            words = " ".join(f"{name}={value}" for name, value in scenario.items())
            calls += [f'in_a_process("{number} {at}", p{number}::main, {seed}, "{words}");' for seed in seeds]
    main = folder / "programs.cpp"
    main.write_text("\n".join([*text, '#line 1 "main"', "int main() {", *calls, "}"]))
    command: list[str | Path] = [*COMPILER, "-include", header, main, "-o", folder / "programs"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return folder / "programs"


def runs(programs: Sequence[Program], folder: Path, seeds: Iterable[int]) -> list[list[Run]]:
    """What each program made, run by run."""
    executable = compiled(programs, folder, seeds)
    output = subprocess.run([executable], check=True, capture_output=True, text=True).stdout
    lines_at = _lines(executable, set(re.findall(r"\b0x[0-9a-f]+", output)))
    found: list[list[Run]] = [[] for _ in programs]
    for one in output.split("RUN ")[1:]:
        head, *rows = one.splitlines()
        number, at, _ = map(int, head.split())
        ended, made = 2, set()
        for kind, name, *addresses in (row.split(" ") for row in rows if row):
            if kind == "END":
                ended = int(name)
            else:
                lines = {lines_at[address] for address in addresses if address in lines_at}
                made.add(Made((kind, name), frozenset(lines)))
        found[number].append(Run(scenarios(programs[number], number)[at], frozenset(made), ended))
    return found


def _lines(executable: Path, addresses: Collection[str]) -> dict[str, int]:
    """The line of a program behind each return address, where there is one."""
    called_at = "\n".join(hex(int(address, 16) - 1) for address in addresses)
    command: list[str | Path] = ["addr2line", "-e", executable]
    places = subprocess.run(command, input=called_at, check=True, capture_output=True, text=True).stdout
    found = (re.search(r"program \d+:(\d+)", place) for place in places.splitlines())
    return {address: int(place[1]) for address, place in zip(addresses, found, strict=True) if place}


def judged(program: Program, made: Sequence[Run], folder: Path) -> Verdict:
    """Compare the runs with what inference says under their parameters."""
    system = infer_paths([package(folder / "demo", program.files)])
    silent: set[Interface] = set()
    certain: set[Interface] = set()
    is_open = False
    for scenario in {tuple(run.scenario.items()) for run in made}:
        claim = _claim(system, program.files["src/main.cpp"], dict(scenario))
        certain |= claim.certain
        is_open = is_open or bool(claim.patterns)
        of_these = [run for run in made if tuple(run.scenario.items()) == scenario and run.status != 2]
        silent |= {
            each.interface
            for run in of_these
            for each in run.made
            if not claim.covers(each) and _valid(each.interface[1])
        }
    # What an exception leaves out has no note if it is not caught.
    ended = not any(run.status for run in made)
    false = certain - {each for run in made for each in run.interfaces} if ended else set()
    return Verdict(frozenset(silent), frozenset(false), not gaps(system) and not is_open)


class _Pattern(NamedTuple):
    kind: str
    name: re.Pattern[str]
    line: int

    def fits(self, made: Made) -> bool:
        kind, name = made.interface
        return kind == self.kind and self.line in made.lines and self.name.fullmatch(name) is not None


class _Claim(NamedTuple):
    """``certain``: listed without a condition; ``noted``: with one; ``gaps``: the lines that gaps cover."""

    certain: set[Interface]
    noted: set[Interface]
    patterns: list[_Pattern]
    gaps: set[int]

    def covers(self, made: Made) -> bool:
        if not self.gaps.isdisjoint(made.lines):
            return True
        if made.interface in self.certain or made.interface in self.noted:
            return True
        return any(pattern.fits(made) for pattern in self.patterns)


def _covered(text: str, line: int) -> range:
    """Return the lines that a gap covers: its own with the block that begins there, all if it has none."""
    rows = text.splitlines()
    depth = 0
    for last, row in enumerate(rows[line - 1 :], line) if line else ():
        depth += row.count("{") - row.count("}")
        if depth <= 0:
            return range(line, last + 1)
    return range(len(rows) + 1)


def _claim(system: InferredSystem, text: str, parameters: Mapping[str, object]) -> _Claim:
    claim = _Claim(set(), set(), [], set())
    for gap in (*system.gaps, *(gap for node in system.nodes for gap in node.gaps)):
        claim.gaps.update(_covered(text, gap.source.line))
    for node in system.nodes:
        if node.name is None or node.namespace is None:
            claim.patterns.append(_Pattern("node", re.compile(".*"), node.source.line))
        else:
            claim.noted.add(("node", expand_name(node.name, namespace=node.namespace, node="x")))
        for endpoint in node.endpoints:
            kind = endpoint.kind.value
            for written in {filled.text for filled in endpoint.name.fill_each(parameters)}:
                if endpoint.certainty in (Certainty.EXACT, Certainty.FROM_DEFAULT) and "*" not in written:
                    conditional = endpoint.note == UNDECIDED or endpoint.name != endpoint.name.unconditional
                    final = _final(written, node.name, node.namespace)
                    (claim.noted if conditional or not final else claim.certain).add((kind, final))
                else:
                    start = "" if written.startswith(("/", "*")) else ".*/"
                    name = re.compile(start + re.escape(written).replace(r"\*", ".*"))
                    claim.patterns.append(_Pattern(kind, name, endpoint.source.line))
    return claim


def _final(name: str, node: str | None, namespace: str | None) -> str:
    try:
        return expand_name(name, namespace=namespace or "/", node=node or "unknown")
    except InvalidNameError:
        return ""


def _valid(name: str) -> bool:
    """rclcpp refuses the others."""
    return re.fullmatch(r"(/[A-Za-z_]\w*)+", name) is not None and "__" not in name
