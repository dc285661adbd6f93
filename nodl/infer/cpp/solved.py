"""Programs from their entries to their nodes: kept answers where nothing has changed, else in parallel."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TypeAlias

from nodl.infer.cpp.cache.answers import Answers, Made
from nodl.infer.cpp.component_mains import may_only_make, only_makes
from nodl.infer.cpp.entry import Entry, Solved
from nodl.infer.cpp.parallel import each_in_parallel
from nodl.infer.cpp.program import Sources, run_program
from nodl.infer.cpp.results import interfaces_of, program_gaps
from nodl.infer.start import LaunchKey, Start
from nodl.node_interface import Gap

Program: TypeAlias = tuple[LaunchKey, Entry]


def solve(sources: Sources, key: LaunchKey, entry: Entry, start: Start | None = None) -> Made:
    """The program of ``entry``, ``Solved``, with the files that it was read from. Raises ``CppSupportMissing``."""
    with _garbage_at_the_end():
        findings = run_program(sources, entry, start)
    solved = Solved(
        nodes=tuple(interfaces_of(findings, key.package, key.executable, key.plugin, start)),
        gaps=tuple(program_gaps(findings)),
        dead=tuple(Gap(answer.source, answer.reason) for answer in findings.answers if answer.dead),
        classes=tuple(sorted(findings.classes)),
        consulted=findings.consulted,
    )
    read = (*findings.files, *sources.unreadable)
    return Made(solved, {name: sources.digests[name] for name in read})


@contextmanager
def _garbage_at_the_end() -> Iterator[None]:
    """What a run makes refers to itself and stays to its end: garbage is looked for once, then, and only among that."""
    enabled = gc.isenabled()
    gc.disable()
    gc.freeze()
    try:
        yield
    finally:
        gc.collect()
        gc.unfreeze()
        if enabled:
            gc.enable()


def solve_all(sources: Sources, answers: Answers, programs: Sequence[Program]) -> list[Made]:
    """Each of ``programs``: from earlier runs where nothing has changed, the others in parallel."""
    found = {each: answers.find(("program", *each)) for each in programs}
    groups = _groups([each for each, made in found.items() if made is None])
    for group, fresh in zip(groups, each_in_parallel(partial(_solve_group, sources), groups), strict=True):
        for program, answer in zip(group, fresh, strict=True):
            answers.keep(("program", *program), answer)
            found[program] = answer
    return [made for each in programs if (made := found[each]) is not None]


def _groups(programs: Sequence[Program]) -> list[list[Program]]:
    """Each program alone, but behind a component the executables that may do nothing but make it."""
    groups = {each: [each] for each in programs}
    components = [each for each in programs if each[1].cls]
    for each in programs:
        made = next((first for first in components if may_only_make(each[1], first[1])), None)
        if made is not None:
            groups[made] += groups.pop(each)
    return list(groups.values())


def _solve_group(sources: Sources, group: Sequence[Program]) -> list[Made]:
    first, *others = group
    answer = solve(sources, *first)
    return [
        answer,
        *(
            _under(key, answer, sources, entry)
            if only_makes(entry, first[1], sources)
            else solve(sources, key, entry)
            for key, entry in others
        ),
    ]


def _under(key: LaunchKey, component: Made, sources: Sources, executable: Entry) -> Made:
    """What an executable makes that only makes the component."""
    solved: Solved = component.answer
    nodes = tuple(
        node._replace(package=key.package, executable=key.executable, plugin=key.plugin)
        for node in solved.nodes
    )
    read = {**component.files, **{name: sources.digests[name] for name in executable.files}}
    return Made(solved._replace(nodes=nodes), read)
