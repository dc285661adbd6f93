"""Findings become ``NodeInterface`` values: names as templates, with certainty and file:line."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_addons.inference.kernel.findings import Findings, FoundEndpoint, FoundNode, Options
from enclave_addons.inference.kernel.texts import Hole, Input, OwnName, Piece, Text, text_of
from enclave_addons.inference.kernel.values import ITEMS, RANDOM, Items, Obj, Unknown, Value
from enclave_addons.inference.start import LaunchKey
from nodl.name_template import NameTemplate, ParameterPart, Part, UnknownPart, melted
from nodl.node_interface import (
    RANDOM_ENDING,
    Certainty,
    ClientLibrary,
    Endpoint,
    Gap,
    NodeInterface,
)
from nodl.ros_arguments import parse_ros_arguments

_TYPE_NAMES: dict[type, str] = {bool: "bool", int: "int", float: "double", str: "string"}
MAX_ALTERNATIVES = 64
UNDECIDED = "made only under a condition that is not decided before the start"


def interfaces_of(findings: Findings, origin: LaunchKey, library: ClientLibrary) -> list[NodeInterface]:
    """Return one interface for each node, and for each name that it may have, in the order they were found."""
    interfaces: list[NodeInterface] = []
    for node in findings.nodes.values():
        if node.created or node.endpoints:
            interfaces.extend(_interfaces_of(node, findings, origin, library))
    return interfaces


def _interfaces_of(
    node: FoundNode, findings: Findings, origin: LaunchKey, library: ClientLibrary
) -> list[NodeInterface]:
    names: list[str | None] = [*_plain(node.names)] or [None]
    namespaces = _namespaces(node)
    gaps = node.gaps.listed()
    if not node.created:
        gaps = gaps or [Gap(node.source, "the node that these interfaces belong to is not known")]
    elif random := _random_name(node.names):
        names = [random]
    elif names == [None] or not all(isinstance(atom, str) for atom in node.names):
        gaps.append(Gap(node.source, f"the name of this node is made at run time{_made_of(node.names)}"))
    if not all(atom is None or isinstance(atom, str) for atom in node.namespaces):
        gaps.append(
            Gap(node.source, f"the namespace of this node is made at run time{_made_of(node.namespaces)}")
        )
    if len(names) > 1 and len(namespaces) > 1:
        gaps.append(Gap(node.source, "which name of this node goes with which namespace is not known"))
    rules = _own_arguments(node, findings, gaps)
    hears: bool | None = None if len(node.hears_launch) != 1 else bool(node.hears_launch[0])
    if findings.global_words:
        hears = False
    anyway = set(node.endpoints)
    endpoints = dict.fromkeys(
        each
        for found in node.endpoints
        if _without_conditions(found) not in anyway - {found}
        for each in _endpoints(found)
    )
    return [
        NodeInterface(
            package=origin.package,
            executable=origin.executable,
            plugin=origin.plugin,
            name=name,
            namespace=namespace,
            endpoints=tuple(endpoints),
            source=node.source,
            library=library,
            lifecycle=node.lifecycle,
            parameters=tuple(sorted({*node.defaults, *node.set_in_code})),
            gaps=tuple(dict.fromkeys(gaps)),
            own_rules=rules,
            parameter_types=tuple(_parameter_types(node)),
            global_arguments=hears,
        )
        for name in names
        for namespace in namespaces
    ]


def _parameter_types(node: FoundNode) -> Iterator[tuple[str, str]]:
    for name, is_typed in sorted(node.typed.items()):
        kinds = {_TYPE_NAMES.get(type(atom)) for atom in node.defaults.get(name, ())}
        kind = kinds.pop() if len(kinds) == 1 else None
        if is_typed and kind is not None and name not in node.set_in_code:
            yield name, kind


def _own_arguments(node: FoundNode, findings: Findings, gaps: list[Gap]) -> tuple[str, ...]:
    """Return remap rules that the program itself gives the node."""
    rules: list[str] = []
    lists = [*node.words, *(findings.global_words if node.hears_launch != (False,) else ())]
    for words in lists:
        found = parse_ros_arguments(words) if words is not None else None
        if found is None or found.parameters or len(lists) > 1:
            gaps.append(Gap(node.source, "remap rules or parameters given in code are not followed"))
        else:
            rules += found.remaps
    return tuple(rules)


def _random_name(names: Value) -> str | None:
    """Return the known beginning of a name whose rest is different at each start, with ``RANDOM_ENDING``."""
    pieces = names[0].pieces if len(names) == 1 and isinstance(names[0], Text) else ()
    first, others = (pieces[0], pieces[1:]) if pieces else (None, ())
    random = [piece.why == RANDOM for piece in others if isinstance(piece, Hole)]
    known = all(isinstance(piece, (str, Hole)) for piece in others)
    if not (isinstance(first, str) and first.endswith("_") and known and all(random)):
        return None
    return first.rstrip("_") + RANDOM_ENDING


def _made_of(value: Value) -> str:
    shown = [str(template) for atom in value if isinstance(atom, Text) for template in templates(atom)]
    return f": {', '.join(dict.fromkeys(shown))}" if shown else ""


def _namespaces(node: FoundNode) -> list[str | None]:
    texts: list[str | None] = []
    for atom in node.namespaces or (None,):
        if atom is None or atom == "":
            texts.append("/")
        else:
            texts.extend("/" + text.lstrip("/") for text in _plain((atom,)))
    return list(dict.fromkeys(texts)) or [None]


def _plain(value: Value) -> list[str]:
    """Return the texts of ``value`` with defaults filled in. What stays unknown is left out."""
    filled = (template.fill({}) for atom in value for template in templates(atom))
    return list(dict.fromkeys(each.text for each in filled if each.is_literal))


# --- names --------------------------------------------------------------------------------------------------


def _endpoints(found: FoundEndpoint) -> list[Endpoint]:
    return [
        Endpoint(
            found.kind,
            each,
            found.type,
            found.source,
            certainty_of(each),
            qos=found.qos,
            introspected=found.introspected,
        )
        for each in templates(found.name)
    ]


def _without_conditions(found: FoundEndpoint) -> FoundEndpoint:
    if not isinstance(found.name, Text):
        return found
    pieces = (piece for piece in found.name.pieces if not (isinstance(piece, Input) and piece.is_condition))
    return found._replace(name=text_of(pieces))


def certainty_of(template: NameTemplate) -> Certainty:
    """Return exact for a literal, from default if nothing is open, a pattern if a part is known, else unknown."""
    if template.is_literal:
        return Certainty.EXACT
    known = [part for part in template.parts if isinstance(part, str) and part.strip("/~")]
    open_parts = [
        part
        for part in template.parts
        if isinstance(part, UnknownPart)
        or (isinstance(part, ParameterPart) and part.default is None and not part.name.endswith(".**"))
    ]
    if not open_parts:
        return Certainty.FROM_DEFAULT
    has_default = any(isinstance(part, ParameterPart) and part.default for part in template.parts)
    return Certainty.PATTERN if known or has_default else Certainty.UNKNOWN


def templates(name: object) -> list[NameTemplate]:
    """Return the templates of one possible name: several where a parameter has several defaults."""
    if isinstance(name, str):
        return [NameTemplate.literal(name)]
    if not isinstance(name, Text):
        return [NameTemplate((UnknownPart(name.why if isinstance(name, Unknown) else "not a text"),))]
    results: list[tuple[Part, ...]] = [()]
    for index, piece in enumerate(name.pieces):
        choices = _parts(piece, index == 0)
        results = [(*result, choice) for result in results for choice in choices]
        if len(results) > MAX_ALTERNATIVES:
            return [NameTemplate((UnknownPart("too many possible defaults"),))]
    return [NameTemplate(melted(result)) for result in results]


def _parts(piece: Piece, first: bool) -> list[Part]:
    if isinstance(piece, str):
        return [piece]
    if isinstance(piece, Hole):
        return [UnknownPart(piece.why)]
    if isinstance(piece, OwnName):
        return [own_name(piece.what, first)]
    assert isinstance(piece.owner, (FoundNode, Options))
    defaults = _default_texts(piece.owner.default(piece.name), piece.item)
    return [ParameterPart(piece.name, default, piece.item, piece.edits) for default in defaults]


def own_name(what: str, first: bool) -> str:
    """Return what a node says of itself (its ``name``, ``ns`` or ``fqn``) in a template."""
    if what == "fqn":
        return "~" if first else "{ns}/{node}"
    return "{node}" if what == "name" else "{ns}"


def _default_texts(value: Value, item: int | str | None) -> list[str | None]:
    """Return the defaults of an input, or of one element or each element of it."""
    if item is not None:
        lists = [each for atom in value if isinstance(atom, Obj) for each in atom.cells.get(ITEMS, ())]
        exact = [each.exact for each in lists if isinstance(each, Items) and each.exact is not None]
        if len(exact) < len(value):
            return [None]
        chosen = [each[item : item + 1 or None] if isinstance(item, int) else each for each in exact]
        value = tuple(atom for each in chosen for element in each for atom in element)
    texts: list[str | None] = []
    for atom in value:
        if isinstance(atom, (str, int, float)):
            texts.append(str(atom))
        elif isinstance(atom, Text):
            texts.extend(_plain((atom,)) or [None])
        else:
            texts.append(None)
    found = list(dict.fromkeys(texts)) or [None]
    return found if len(found) <= MAX_ALTERNATIVES else [None]
