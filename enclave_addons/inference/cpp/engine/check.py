"""Every place that could make an interface is accounted for: as one, as dead for a reason, or as a gap.

Places are found by their words in the text of the program's files, whatever the grammar made of them.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterable
from typing import NamedTuple

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.sites import Site, sites_of
from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Function
from enclave_addons.inference.cpp.syntax import text
from enclave_common.source_location import SourceLocation

_DECLARES = ("function_declarator", "using_declaration", "template_parameter_list", "friend_declaration")
_ADDRESS = re.compile(r"&\s*(?:\w+\s*::\s*)+(\w+)")
_MAKING = ("call_expression", "field_initializer", "argument_list", "new_expression")


class SiteAnswer(NamedTuple):
    """``reason``: why the place is dead, or what is missing."""

    site: Site
    dead: bool
    reason: str

    @property
    def source(self) -> SourceLocation:
        return SourceLocation(self.site.file, self.site.line)


def account(run: Machine, files: Iterable[FileIndex]) -> list[SiteAnswer]:
    """Report what became of each place that has no interface and no gap of its own."""
    answers: list[SiteAnswer] = []
    reach = reachable(run) | _taken(run)
    made = {each for cls in run.made_classes() for each in run.names.ancestry(cls)}
    for index in files:
        functions = sorted(index.all_functions, key=lambda f: f.node.start_byte)
        for site in sites_of(index):
            answer = _answer(run, index, site, functions, reach, made)
            if answer is not None:
                answers.append(answer)
    return answers


def _answer(
    run: Machine,
    index: FileIndex,
    site: Site,
    functions: list[Function],
    reach: set[Function],
    made: set[Class],
) -> SiteAnswer | None:
    if _is_handled(run, index, site):
        return None
    function = _around(site.offset, functions)
    if function is None:
        if _is_declaration(index, site):
            return None
        owner = _class_around(index, site)
        if owner is not None and owner not in made:
            return SiteAnswer(site, True, f"the program makes no object of {owner}")
        if not any(each.file is index for each in run.called):
            return SiteAnswer(site, True, "no function of this file runs")
        return SiteAnswer(site, False, f"{site.word} stands where it is not understood")
    if function.name == site.word and function.body is not None and site.offset < function.body.start_byte:
        return None  # the name of the function itself
    for (file, start, end), why in run.dead.items():
        if file == index.file and start <= site.offset < end:
            return SiteAnswer(site, True, why)
    if function in run.called:
        return SiteAnswer(site, False, f"what {function} makes was not followed to its end")
    if function not in reach:
        return SiteAnswer(site, True, f"nothing in the program calls {function}")
    return SiteAnswer(site, False, f"it was not understood who calls {function}, and for which node")


def _taken(run: Machine) -> set[Function]:
    """Return the functions whose address code takes that was followed, and that nothing called."""
    words = {word for function in run.called for word in _ADDRESS.findall(text(function.node))}
    named = (each for word in words for each in run.names.functions_by_name.get(word, ()))
    return {each for each in named if each not in run.called}


def reachable(run: Machine) -> set[Function]:
    """Return the functions that calls which were not followed may lead to, by their names.

    A method counts when an object of its class was made, or its class is named in what is reached.
    """
    made = {each.name for cls in run.made_classes() for each in run.names.ancestry(cls)}
    words = set(run.unresolved)
    found: set[Function] = set()
    waiting = list(words)
    idle: dict[str, list[Function]] = {}
    while waiting:
        word = waiting.pop()
        for function in (*run.names.functions_by_name.get(word, ()), *idle.pop(word, ())):
            owner = function.owner.rpartition("::")[2]
            if owner and owner not in made and owner not in words and not function.static:
                idle.setdefault(owner, []).append(function)
                continue
            if function in found or function in run.called:
                continue
            found.add(function)
            new = run.names.spoken_of(function) - words
            words |= new
            waiting += new
    return found


def _around(offset: int, functions: list[Function]) -> Function | None:
    position = bisect.bisect_right(functions, offset, key=lambda f: f.node.start_byte)
    best = None
    for function in functions[max(0, position - 40) : position]:
        if function.node.start_byte <= offset < function.node.end_byte:
            best = function
    return best


def _class_around(index: FileIndex, site: Site) -> Class | None:
    inner: Class | None = None
    for cls in (each for listed in index.classes.values() for each in listed):
        around = cls.node.start_byte <= site.offset < cls.node.end_byte
        if around and (inner is None or cls.node.start_byte > inner.node.start_byte):
            inner = cls
    return inner


def _is_handled(run: Machine, index: FileIndex, site: Site) -> bool:
    """Return whether a call whose name is this word had its result: it begins before the word, its arguments behind
    it."""
    handled = run.handled.get(index.file, set())
    node = index.tree.root_node.descendant_for_byte_range(site.offset, site.offset + 1)
    while node is not None and node.type not in (
        "compound_statement",
        "function_definition",
        "argument_list",
    ):
        if node.type in _MAKING and node.start_byte in handled:
            return True
        node = node.parent
    return False


def _is_declaration(index: FileIndex, site: Site) -> bool:
    """Return whether ``create_publisher`` is the name of a method only declared, or in a macro that nobody uses."""
    node = index.tree.root_node.descendant_for_byte_range(site.offset, site.offset + 1)
    while node is not None and node.type not in ("call_expression", "ERROR", "init_declarator"):
        if node.type in _DECLARES:
            return True
        node = node.parent
    return False
