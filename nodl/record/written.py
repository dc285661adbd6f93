"""A written and a final name → the name as the source means it. Pure.

rcl gets most names as the source writes them. Some programs build theirs from the node's name (``get_name() + "/x"``):
in one run that looks like a literal, and means ``~/x``. Measured over 277 names of 64 programs that ran under two node
names: a written name that begins with the node's final name and ``/`` is private in 8 of 8 cases, and none other is.
"""

from __future__ import annotations

from typing import NamedTuple

from nodl.names import InvalidNameError, split_fqn
from nodl.node_interface import EndpointKind
from nodl.remap import NodeNames, RemapRules

_TOPICS = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
_ACTIONS = (EndpointKind.ACTION_SERVER, EndpointKind.ACTION_CLIENT)


class Meant(NamedTuple):
    """``moved``: the launch's rules do not lead to the final name, so rules of the program itself do; ``name`` is then
    the final name."""

    name: str
    moved: bool = False


def meant_name(kind: EndpointKind, written: str, final: str, fqn: str, rules: RemapRules | None) -> Meant:
    """What the source of the node ``fqn`` means by ``written``, which became ``final`` by the launch's ``rules``."""
    name = private_name(written, fqn)
    if rules is None or not final or not fqn or final in final_names(kind, name, fqn, rules):
        return Meant(name)
    return Meant(final, moved=True)


def private_name(written: str, fqn: str) -> str:
    """``~/x`` for a name that begins with the node's own; substitutions that say the same are written plainly."""
    if fqn:
        for own in (f"{fqn}/", f"{split_fqn(fqn)[1]}/", "{node}/"):
            if written.startswith(own):
                return f"~/{written[len(own) :]}"
    for own in ("{ns}/", "{namespace}/"):
        if written.startswith(own):
            return written[len(own) :]
    return written


def final_names(kind: EndpointKind, name: str, fqn: str, rules: RemapRules) -> set[str]:
    """What ``name`` may become in the node ``fqn``; actions with and without rules, as distributions differ."""
    namespace, node = split_fqn(fqn)
    names = NodeNames(node, namespace, rules)
    try:
        if kind in _TOPICS:
            return {names.topic(name).name}
        if kind not in _ACTIONS:
            return {names.service(name).name}
        found = {names.action(name, as_a_whole=whole).name for whole in (True, False)}
        parts = [names.action_parts(action) for action in sorted(found)]
        return found | {moved for each in parts if each and (moved := each.moved_together)}
    except InvalidNameError:
        return set()
