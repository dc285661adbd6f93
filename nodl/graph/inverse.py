"""A final name → the names that the node's source may write for it: the inverse of expansion and remapping. Pure.

A name that a rule gave has the rule's own name, or that of each rule where several have the target. One that no rule
gave is the source's, in each spelling that expands to it: private below the node's name, relative below its namespace,
absolute. Each candidate is tried forwards, by the rules of rcl, and only those that give the final name are kept.
"""

from __future__ import annotations

from collections.abc import Iterator

from nodl.names import InvalidNameError, split_fqn
from nodl.node_interface import EndpointKind
from nodl.record.written import final_names
from nodl.remap import NodeNames, RemapRules

_PARTS = "/_action/"


def written_names(kind: EndpointKind, final: str, fqn: str, rules: RemapRules) -> tuple[str, ...]:
    """What the source of the node ``fqn`` may write, the likelier first: what a rule says, then private names, then
    relative ones. Empty when no name that is written leads there."""
    found = [*_by_rule(kind, final, fqn, rules), *spellings(final, fqn)]
    return tuple(dict.fromkeys(each for each in found if final in final_names(kind, each, fqn, rules)))


def spellings(full: str, fqn: str) -> tuple[str, ...]:
    """The ways to write the full name ``full`` in the node ``fqn``: private, relative, absolute."""
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
