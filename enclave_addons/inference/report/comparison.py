"""What a manifest lacks of that which the source of its program makes. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from nodl.names import InvalidNameError, expand_name
from nodl.node_interface import RANDOM_ENDING, Endpoint, EndpointKind, NodeInterface

Named = tuple[EndpointKind, str]


class Lacking(NamedTuple):
    """``endpoints`` stand in the source and not in the manifest; ``open``: those whose name the source leaves open, and
    gaps, of which nobody can say whether the manifest has them; ``agreed``: how many both have."""

    endpoints: tuple[Endpoint, ...]
    open: tuple[str, ...]
    agreed: int


def lacking(described: Iterable[NodeInterface], inferred: Sequence[NodeInterface]) -> Lacking:
    """Compare one program. Names that follow a parameter are compared by its default, as manifests list them."""
    has = {named for node in described for endpoint in node.endpoints if (named := _named(node, endpoint))}
    missing: list[Endpoint] = []
    questions = [f"{gap.source}: {gap.why}" for node in inferred for gap in node.gaps]
    agreed = 0
    for node in inferred:
        if (node.name or "").endswith(RANDOM_ENDING):
            continue  # a TransformListener's own node: manifests say it of the node beside it
        for endpoint in node.endpoints:
            if endpoint.name.fill_each({}) == ():
                continue  # only where a parameter has another value than its default
            named = _named(node, endpoint)
            if named is None:
                questions.append(f"{endpoint.source}: the name of a {_kind(endpoint.kind)} is not known")
            elif named in has:
                agreed += 1
            else:
                missing.append(endpoint)
    return Lacking(tuple(dict.fromkeys(missing)), tuple(dict.fromkeys(questions)), agreed)


def _named(node: NodeInterface, endpoint: Endpoint) -> Named | None:
    """Return kind and full name, by the defaults of parameters; ``None`` if the name is not known."""
    filled = endpoint.name.unconditional.fill({})
    if not filled.is_literal or not filled.text:
        return None
    try:
        full = expand_name(filled.text, namespace=node.namespace or "/", node=node.name or "node")
    except InvalidNameError:
        return None
    return endpoint.kind, full


def to_text(program: str, found: Lacking) -> str:
    """Say how many interfaces the manifest has, then a line for each that it lacks and for what stays open."""
    lines = [
        f"{program}: the manifest has {found.agreed} of {found.agreed + len(found.endpoints)} interfaces"
    ]
    lines += [
        f"  lacks {_kind(each.kind)} {each.name} [{each.type or 'type not known'}]  {each.source}"
        for each in found.endpoints
    ]
    lines += [f"  open {question}" for question in found.open]
    return "\n".join([*lines, ""])


def _kind(kind: EndpointKind) -> str:
    return kind.value.replace("_", " ")
