"""Programs in unusual spellings, beside what each made when it was compiled with rclcpp (jazzy) and run.

``programs/*.programs`` hold them, one after another under a heading ``// --- what it does``. ``//=`` lines say what
the run made, without what every node has; ``//?`` lines what another run could make; ``//#`` begins a further file.
What is missing must be a gap or an open name; where every name is known, no other one is listed; of ``beliefs``, in
which an easy reading gives another name than C++ does, none in any case.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from enclave_addons.inference import infer_paths
from nodl.names import expand_name
from nodl.node_interface import Certainty, NodeInterface
from tests.addons.inference.cpp.workspace import gaps, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

FOLDER = Path(__file__).parent / "programs"
PRELUDE, MAIN = (FOLDER / "prelude.hpp").read_text(), (FOLDER / "main.cpp").read_text()
Interface = tuple[str, str]  # kind and final name


class Program(NamedTuple):
    """``made``: in the run; ``possible``: in another one."""

    files: dict[str, str]
    made: frozenset[Interface]
    possible: frozenset[Interface]


def _programs() -> Iterator[tuple[str, Program]]:
    for file in sorted(FOLDER.glob("*.programs")):
        for section in re.split(r"^// --- ", file.read_text(), flags=re.M)[1:]:
            title, _, body = section.partition("\n")
            source = "\n" + re.sub(r"^//[=?] .*\n", "", body, flags=re.M)
            first, *more = re.split(r"^//# (.*)\n", source, flags=re.M)
            head = PRELUDE if "Maker" in first else PRELUDE.partition("class Maker")[0]
            files = {"src/main.cpp": head + first + ("" if "int main(" in first else MAIN)}
            files.update(zip(more[::2], more[1::2], strict=True))
            yield f"{file.stem}: {title}", Program(files, _listed("=", body), _listed("?", body))


def _listed(mark: str, body: str) -> frozenset[Interface]:
    lines = re.findall(rf"^//\{mark} (\w+) (.*)$", body, flags=re.M)
    return frozenset((kind, name) for kind, names in lines for name in names.split())


PROGRAMS = dict(_programs())


class Claim(NamedTuple):
    certain: set[Interface]
    open: list[tuple[str, re.Pattern[str]]]
    gaps: list[str]

    def covers(self, made: Interface) -> bool:
        known = any(kind == made[0] and pattern.fullmatch(made[1]) for kind, pattern in self.open)
        return known or made in self.certain or bool(self.gaps)


def claim(folder: Path, files: dict[str, str]) -> Claim:
    """What inference says of a program. ``open``: names of which a part is not known."""
    system = infer_paths([package(folder / "demo", files)])
    found = Claim(set(), [], gaps(system))
    for node in system.nodes:
        for endpoint in node.endpoints:
            name = _final(node, endpoint.name.fill({}).text)
            if endpoint.certainty in (Certainty.EXACT, Certainty.FROM_DEFAULT):
                found.certain.add((endpoint.kind.value, name))
            else:
                start = "" if name.startswith(("/", "*")) else ".*/"
                pattern = re.compile(start + re.escape(name).replace(r"\*", ".*"))
                found.open.append((endpoint.kind.value, pattern))
    return found


def _final(node: NodeInterface, name: str) -> str:
    if "*" in name:
        return name
    return expand_name(name, namespace=node.namespace or "/", node=node.name or "unknown")


@pytest.mark.parametrize("title", PROGRAMS)
def test_nothing_is_missing_silently(title: str, tmp_path: Path) -> None:
    program = PROGRAMS[title]
    found = claim(tmp_path, program.files)
    assert not [made for made in program.made if not found.covers(made)]


@pytest.mark.parametrize("title", PROGRAMS)
def test_where_all_is_known_no_other_name_is_listed(title: str, tmp_path: Path) -> None:
    program = PROGRAMS[title]
    found = claim(tmp_path, program.files)
    if not found.gaps and not found.open:
        assert found.certain - program.made == program.possible


@pytest.mark.parametrize("title", [title for title in PROGRAMS if title.startswith("beliefs")])
def test_beside_a_gap_no_other_name_is_listed_either(title: str, tmp_path: Path) -> None:
    program = PROGRAMS[title]
    assert claim(tmp_path, program.files).certain <= program.made | program.possible


def test_so_many_are_known_whole(tmp_path: Path) -> None:
    """11 of 56 when this was written: unusual spellings may be gaps, but not nearly all."""
    whole = 0
    for number, program in enumerate(PROGRAMS.values()):
        found = claim(tmp_path / str(number), program.files)
        whole += not found.gaps and not found.open
    assert whole >= 8
