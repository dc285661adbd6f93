"""Programs from their entries to their nodes: cached answers where nothing has changed, else new ones."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TypeAlias

from nodl.infer.cpp.cache.answers import Answers, Made
from nodl.infer.cpp.cache.folder import digest_of
from nodl.infer.cpp.entry import CppSupportMissing, Entry, Solved, failure
from nodl.infer.cpp.program import Sources, run_program
from nodl.infer.cpp.results import interfaces_of, program_gaps
from nodl.infer.start import LaunchKey, Start
from nodl.node_interface import Gap
from nodl.source_ref import SourceRef

MAX_NESTING = 6_000
"""Of our own calls: some twenty for each call of the program that is followed, which nest up to 60 deep."""

Program: TypeAlias = tuple[LaunchKey, Entry]


def solve(sources: Sources, key: LaunchKey, entry: Entry, start: Start | None = None) -> Made:
    """Analyse the program of ``entry``; whatever goes wrong inside the analysis becomes a gap of this program.

    Returns:
        A ``Solved`` with the files that it was read from.

    Raises:
        CppSupportMissing: tree-sitter is not installed.
    """
    try:
        return _solved(sources, key, entry, start)
    except CppSupportMissing:
        raise
    except Exception as error:
        place = SourceRef(entry.files[0] if entry.files else entry.place)
        gap = Gap(place, failure("the analysis of this program", error))
        return Made(Solved(gaps=(gap,)), {name: digest_of(name) for name in entry.files}, lasting=False)


def _solved(sources: Sources, key: LaunchKey, entry: Entry, start: Start | None) -> Made:
    with _garbage_at_the_end():
        findings = run_program(sources, entry, start)
    solved = Solved(
        nodes=tuple(interfaces_of(findings, key.package, key.executable, key.plugin)),
        gaps=tuple(program_gaps(findings)),
        dead=tuple(Gap(answer.source, answer.reason) for answer in findings.answers if answer.dead),
        classes=tuple(sorted(findings.classes)),
        consulted=findings.consulted,
    )
    read = (*findings.files, *sources.unreadable)
    return Made(solved, {name: sources.digests[name] for name in read})


@contextmanager
def _garbage_at_the_end() -> Iterator[None]:
    """Collect garbage once, at the end: what a run makes refers to itself and stays until then."""
    enabled, limit = gc.isenabled(), sys.getrecursionlimit()
    gc.disable()
    gc.freeze()
    sys.setrecursionlimit(max(limit, MAX_NESTING))
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)
        gc.collect()
        gc.unfreeze()
        if enabled:
            gc.enable()


def solve_all(sources: Sources, answers: Answers, programs: Sequence[Program]) -> list[Made]:
    """Solve each of ``programs``, from earlier runs if nothing has changed."""
    found: list[Made] = []
    for each in programs:
        known = answers.find(("program", *each))
        if known is None:
            known = solve(sources, *each)
            answers.keep(("program", *each), known)
        found.append(known)
    return found
