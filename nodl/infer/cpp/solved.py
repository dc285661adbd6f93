"""Programs from their entries to their nodes: kept answers where nothing has changed, else in parallel."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from nodl.infer.cpp.cache.answers import Answers, Made
from nodl.infer.cpp.entry import Entry, Solved
from nodl.infer.cpp.parallel import each_in_parallel
from nodl.infer.cpp.program import Sources, run_program
from nodl.infer.cpp.results import interfaces_of, program_gaps
from nodl.infer.cpp.running.machine import Settings
from nodl.infer.start import LaunchKey, Start
from nodl.node_interface import Gap


def solve(sources: Sources, key: LaunchKey, entry: Entry, start: Start | None = None) -> Made:
    """The program of ``entry``, ``Solved``, with the files that it was read from. Raises ``CppSupportMissing``."""
    findings = run_program(sources, entry, Settings(start))
    solved = Solved(
        nodes=tuple(interfaces_of(findings, key.package, key.executable, key.plugin, start)),
        gaps=tuple(program_gaps(findings)),
        dead=tuple(Gap(answer.source, answer.reason) for answer in findings.answers if answer.dead),
        classes=tuple(sorted(findings.classes)),
        consulted=bool(findings.consulted),
    )
    read = (*findings.files, *sources.unreadable)
    return Made(solved, {name: sources.digests[name] for name in read})


def solve_all(sources: Sources, answers: Answers, programs: Sequence[tuple[LaunchKey, Entry]]) -> list[Made]:
    """Each of ``programs``: from earlier runs where nothing has changed, the others in parallel."""
    found = [answers.find(("program", *each)) for each in programs]
    missing = [each for each, made in zip(programs, found, strict=True) if made is None]
    fresh = iter(each_in_parallel(partial(_solve_one, sources), missing))
    results = []
    for program, made in zip(programs, found, strict=True):
        if made is None:
            made = next(fresh)
            answers.keep(("program", *program), made)
        results.append(made)
    return results


def _solve_one(sources: Sources, program: tuple[LaunchKey, Entry]) -> Made:
    return solve(sources, *program)
