"""Programs from their entries to their nodes: cached answers where nothing has changed, else new ones, in parallel."""

from __future__ import annotations

import gc
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TypeAlias

from enclave_addons.inference.answers.cpp import Answers, Made
from enclave_addons.inference.answers.folder import digest_of
from enclave_addons.inference.cpp.entry import CppSupportMissing, Entry, Solved, failure
from enclave_addons.inference.cpp.parallel import each_in_parallel
from enclave_addons.inference.cpp.program import Sources, run_program
from enclave_addons.inference.cpp.reading.declarations import FileIndex, FunctionParameter
from enclave_addons.inference.cpp.results import interfaces_of, program_gaps
from enclave_addons.inference.cpp.syntax import text
from enclave_addons.inference.start import LaunchKey, Progress, Start
from enclave_common.files import text_or_nothing
from enclave_common.source_location import SourceLocation
from nodl.node_interface import Gap

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
        place = SourceLocation(entry.files[0] if entry.files else entry.place)
        gap = Gap(place, failure("the analysis of this program", error))
        return Made(Solved(gaps=(gap,)), {name: digest_of(name) for name in entry.files}, lasting=False)


def _solved(sources: Sources, key: LaunchKey, entry: Entry, start: Start | None) -> Made:
    with _garbage_at_the_end():
        findings = run_program(sources, entry, start)
    nodes = interfaces_of(findings, *key, start)
    solved = Solved(
        nodes=tuple(nodes),
        gaps=program_gaps(findings),
        dead=tuple(Gap(answer.source, answer.reason) for answer in findings.answers if answer.dead),
        classes=tuple(sorted(findings.classes)),
        consulted=findings.consulted or (start is not None and nodes != interfaces_of(findings, *key)),
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


def solve_all(
    sources: Sources, answers: Answers, programs: Sequence[Program], progress: Progress | None = None
) -> list[Made]:
    """Solve each of ``programs``: from earlier runs if nothing has changed, the others in parallel."""
    found = {each: answers.find(("program", *each)) for each in programs}
    groups = _groups([each for each, made in found.items() if made is None])
    for group, fresh in zip(groups, each_in_parallel(partial(_solve_group, sources), groups), strict=True):
        for program, answer in zip(group, fresh, strict=True):
            answers.keep(("program", *program), answer)
            found[program] = answer
        if progress is not None:
            progress(sum(made is not None for made in found.values()), len(programs))
    return [made for each in programs if (made := found[each]) is not None]


def _groups(programs: Sequence[Program]) -> list[list[Program]]:
    """Group each program alone, but behind a component the executables that may do nothing but make it."""
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
    """Return the component's answer as that of an executable that makes only the component."""
    solved: Solved = component.answer
    nodes = tuple(
        node._replace(package=key.package, executable=key.executable, plugin=key.plugin)
        for node in solved.nodes
    )
    read = {**component.files, **{name: sources.digests[name] for name in executable.files}}
    return component._replace(answer=solved._replace(nodes=nodes), files=read)


_MAIN = re.compile(
    r"\{rclcpp::init\((?P<arguments>\w+,\w+)\);"
    r"(?:rclcpp::NodeOptions(?P<options>\w+);)?"
    r"auto(?P<node>\w+)=std::make_shared<(?P<component>[\w:]+)>\((?P<given>rclcpp::NodeOptions\(\)|(?P=options))?\);"
    r"rclcpp::spin\((?P=node)(?:->get_node_base_interface\(\))?\);"
    r"(?:rclcpp::shutdown\(\);)?(?:return(?:0|EXIT_SUCCESS);)?\}"
)  # without white space
_DEFAULTS = ("rclcpp::NodeOptions()", "NodeOptions()", "{}")


def may_only_make(executable: Entry, component: Entry) -> bool:
    """Return whether it is worth to evaluate ``only_makes``."""
    file = _main_beside(executable, component)
    return file is not None and f"<{component.cls}>" in text_or_nothing(file)


def _main_beside(executable: Entry, component: Entry) -> str | None:
    """Return the one source that the executable has beside those of the component; ``None`` if that is not all."""
    own = [file for file in executable.files if file not in component.files]
    rest = tuple(file for file in executable.files if file in component.files)
    alike = executable.definitions == component.definitions
    return own[0] if alike and executable.main and rest == component.files and len(own) == 1 else None


def only_makes(executable: Entry, component: Entry, sources: Sources) -> bool:
    """Return whether ``executable`` makes ``component``, as a container would, and nothing else."""
    file = _main_beside(executable, component)
    index = sources.index(file, component.definitions) if file is not None else None
    made = _made(index) if index is not None else None
    if index is None or made is None or made["component"] != component.cls:
        return False
    reached = sources.closure(component.files, component.definitions)
    takes = _options_alone(component.cls, reached)
    default = text(takes.default) if takes is not None else ""
    called_alike = takes is not None and (made["given"] or "".join(default.split()) in _DEFAULTS)
    return bool(called_alike) and {each.file for each in reached}.issuperset(index.source.includes)


def _made(index: FileIndex) -> re.Match[str] | None:
    """Return what such a ``main`` makes, if the file has nothing else."""
    others = (
        index.classes, index.globals, index.aliases, index.using, index.enums, index.declared, index.errors,
        index.source.uncertain, index.source.unknown_macros,
    )  # fmt: skip
    mains = index.functions.get("main", ())
    if any(others) or len(index.all_functions) != 1 or len(mains) != 1:
        return None
    match = _MAIN.fullmatch("".join(text(mains[0].body).split()))
    given = ",".join(each.name for each in mains[0].parameters)
    return match if match is not None and match["arguments"] == given else None


def _options_alone(component: str, files: Iterable[FileIndex]) -> FunctionParameter | None:
    """Return the parameter of the one constructor that takes options and nothing else; ``main`` can call no other."""
    name = component.rpartition("::")[2]
    classes = (each for index in files for each in index.classes.get(name, ()) if each.qualified == component)
    found = [each for cls in classes for each in (*cls.methods.get(name, ()), *cls.declared.get(name, ()))]
    taking = [each.parameters for each in found if any("NodeOptions" in p.type for p in each.parameters)]
    alone = len(taking) == 1 == len(taking[0]) and all(each.parameters for each in found)
    return taking[0][0] if alone else None
