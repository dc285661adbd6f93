"""A written and a final name → the name as the source means it; a final name → what the source may write.

rcl gets most names as the source writes them. Some programs build theirs from the node's name (``get_name() + "/x"``):
in one run that looks like a literal, and means ``~/x``. Measured over 277 names of 64 programs that ran under two node
names: a written name that begins with the node's final name and ``/`` is private in 8 of 8 cases, and none other is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from nodl.names import InvalidNameError, split_fqn
from nodl.node_interface import EndpointKind
from nodl.remap import NodeNames, RemapRules

_PARTS = "/_action/"


class Meant(NamedTuple):
    """A name as the source means it. ``moved``: the launch's rules do not lead to the final name, so rules of the
    program itself do; ``name`` is then the final name."""

    name: str
    moved: bool = False


def meant_name(kind: EndpointKind, written: str, final: str, fqn: str, rules: RemapRules | None) -> Meant:
    """Return what the source of ``fqn`` means by ``written``, which became ``final`` by the launch's ``rules``."""
    name = private_name(written, fqn)
    if rules is None or not final or not fqn or final in final_names(kind, name, fqn, rules):
        return Meant(name)
    return Meant(final, moved=True)


def private_name(written: str, fqn: str) -> str:
    """Return ``~/x`` for a name that begins with the node's own; substitutions of that meaning are written plainly."""
    if fqn:
        for own in (f"{fqn}/", f"{split_fqn(fqn)[1]}/", "{node}/"):
            if written.startswith(own):
                return f"~/{written[len(own) :]}"
    for own in ("{ns}/", "{namespace}/"):
        if written.startswith(own):
            return written[len(own) :]
    return written


def final_names(kind: EndpointKind, name: str, fqn: str, rules: RemapRules) -> set[str]:
    """Return what ``name`` may become in the node ``fqn``; actions with and without rules, as distributions differ."""
    namespace, node = split_fqn(fqn)
    names = NodeNames(node, namespace, rules)
    try:
        if kind.family != "action":
            return {(names.topic if kind.family == "topic" else names.service)(name).name}
        found = {names.action(name, as_a_whole=whole).name for whole in (True, False)}
        parts = [names.action_parts(action) for action in sorted(found)]
        return found | {moved for each in parts if each and (moved := each.moved_together)}
    except InvalidNameError:
        return set()


def written_names(kind: EndpointKind, final: str, fqn: str, rules: RemapRules) -> tuple[str, ...]:
    """Return what the source of the node ``fqn`` may write for ``final``: the inverse of expansion and remapping.

    The likelier first: what a rule says, then private names, then relative ones. Each is tried forwards, by the rules
    of rcl; empty if no name that is written leads there.
    """
    found = [*_by_rule(kind, final, fqn, rules), *spellings(final, fqn)]
    return tuple(dict.fromkeys(each for each in found if final in final_names(kind, each, fqn, rules)))


def spellings(full: str, fqn: str) -> tuple[str, ...]:
    """Return the ways to write the full name ``full`` in the node ``fqn``: private, relative, absolute."""
    namespace, _ = split_fqn(fqn)
    above = namespace.rstrip("/") + "/"
    found = [f"~/{full[len(fqn) + 1 :]}"] if full.startswith(f"{fqn}/") else []
    if full.startswith(above):
        found.append(full[len(above) :])
    return (*found, full)


def _by_rule(kind: EndpointKind, final: str, fqn: str, rules: RemapRules) -> Iterator[str]:
    namespace, node = split_fqn(fqn)
    names = NodeNames(node, namespace)
    for rule in rules.names:
        if rule.node not in (None, node):
            continue
        try:
            replacement, match = names.expand(rule.replacement), names.expand(rule.match)
        except InvalidNameError:
            continue  # rcl skips it, too
        if replacement == final:
            yield rule.match
            yield from spellings(match, fqn)
        elif _part_of(replacement, final) and _part_of(match, ""):  # a rule for one of an action's five names
            yield from spellings(match.partition(_PARTS)[0], fqn)


def _part_of(name: str, action: str) -> bool:
    found, below, _ = name.partition(_PARTS)
    return bool(below) and action in ("", found)
