"""Findings become ``NodeInterface`` values: names as templates, with certainty and file:line.

Parameters stay symbolic, with what the code declares as their default; launch fills them in.
"""

from __future__ import annotations

from enclave_addons.inference.findings import Findings, FoundEndpoint, NodeRecord, OptionDefaults
from enclave_addons.inference.start import LaunchKey
from enclave_addons.inference.text import (
    Hole,
    Input,
    NodePart,
    Piece,
    Text,
    is_condition,
    is_of_inputs,
    text_of,
)
from enclave_addons.inference.values import Unknown, Value
from nodl.name_template import NameTemplate, ParameterPart, Part, UnknownPart, melted
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, Gap, NodeInterface
from nodl.ros_arguments import parse_ros_arguments

MAX_ALTERNATIVES = 64
UNDECIDED = "made only under a condition that is not decided before the start"


def interfaces_of(findings: Findings, origin: LaunchKey) -> list[NodeInterface]:
    """Return one interface for each node (and each name it may have), in the order they were found."""
    interfaces: list[NodeInterface] = []
    for record in findings.nodes:
        if record.created or record.endpoints:
            interfaces.extend(_interfaces_of_node(record, findings, origin))
    return interfaces


def _interfaces_of_node(record: NodeRecord, findings: Findings, origin: LaunchKey) -> list[NodeInterface]:
    gaps = _arguments_in_code(record, findings)
    found_anyway = set(record.endpoints)
    endpoints = tuple(
        dict.fromkeys(
            each
            for found in record.endpoints
            if _without_conditions(found) not in found_anyway - {found}
            for each in _endpoints(found)
        )
    )
    gaps.extend(Gap(source, why) for source, why in record.gaps)
    names: list[str | None] = [*_plain_texts(record.names)] or [None]
    if not record.created:
        gaps.append(Gap(record.source, "the node that these interfaces belong to is not known"))
    elif names == [None]:
        gaps.append(Gap(record.source, "the name of this node is made at run time"))
    made = "of this node is made at run time"
    if not all(atom is None or isinstance(atom, str) for atom in record.namespaces):
        gaps.append(Gap(record.source, f"the namespace {made}{_made_of(record.namespaces)}"))
    if record.created and names != [None] and not all(isinstance(atom, str) for atom in record.names):
        gaps.append(Gap(record.source, f"the name {made}{_made_of(record.names)}"))
    if len(names) > 1 and len(_namespaces(record)) > 1:
        gaps.append(Gap(record.source, "which name of this node goes with which namespace is not known"))
    return [
        NodeInterface(
            package=origin.package,
            executable=origin.executable,
            plugin=origin.plugin,
            name=name,
            namespace=namespace,
            endpoints=endpoints,
            source=record.source,
            library=ClientLibrary.RCLPY,
            lifecycle=record.lifecycle and record.communication_interface,
            parameters=tuple(sorted({*record.parameters, *record.assigned})),
            gaps=tuple(dict.fromkeys(gaps)),
            global_arguments=_hears_launch(record, findings),
        )
        for name in names
        for namespace in _namespaces(record)
    ]


def _made_of(value: Value) -> str:
    """Return the inputs in ``value``, for the reader."""
    shown = [str(template) for atom in value if isinstance(atom, Text) for template in templates(atom)]
    return f": {', '.join(dict.fromkeys(shown))}" if shown else ""


def _namespaces(record: NodeRecord) -> list[str | None]:
    texts: list[str | None] = []
    for atom in record.namespaces or (None,):
        if atom is None or atom == "":
            texts.append("/")
        elif isinstance(atom, str):
            texts.append(atom if atom.startswith("/") else "/" + atom)
        else:
            texts.extend("/" + text.lstrip("/") for text in _plain_texts((atom,)))
    return list(dict.fromkeys(texts)) or [None]


def _plain_texts(value: Value) -> list[str]:
    """Return the texts of ``value`` with defaults filled in; what stays unknown is left out."""
    filled = (template.fill({}) for atom in value for template in templates(atom))
    return list(dict.fromkeys(each.text for each in filled if each.is_literal))


# --- endpoints ----------------------------------------------------------------------------------------------


def _endpoints(found: FoundEndpoint) -> list[Endpoint]:
    return [
        Endpoint(found.kind, each, found.type, found.source, certainty_of(each), qos=found.qos)
        for each in templates(found.name)
    ]


def _without_conditions(found: FoundEndpoint) -> FoundEndpoint:
    if not isinstance(found.name, Text):
        return found
    pieces = (piece for piece in found.name.pieces if not (isinstance(piece, Input) and is_condition(piece)))
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
    """Return the templates of one possible name: several when a parameter has several defaults."""
    if isinstance(name, str):
        return [NameTemplate.literal(name)]
    if isinstance(name, Text):
        results: list[tuple[Part, ...]] = [()]
        for index, piece in enumerate(name.pieces):
            choices = _parts(piece, first=index == 0)
            results = [(*result, choice) for result in results for choice in choices]
            if len(results) > MAX_ALTERNATIVES:
                return [NameTemplate((UnknownPart("too many possible defaults"),))]
        return [NameTemplate(melted(result)) for result in results]
    why = name.why if isinstance(name, Unknown) else "not a text"
    return [NameTemplate((UnknownPart(why),))]


def own_name(what: str, first: bool) -> str:
    """Return what a node says of itself (its ``name``, ``ns`` or ``fqn``) in a template, ``first`` or behind other
    text.
    """
    if what == "fqn":
        return "~" if first else "{ns}/{node}"
    return "{node}" if what == "name" else "{ns}"


def _parts(piece: Piece, first: bool) -> list[Part]:
    if isinstance(piece, str):
        return [piece]
    if isinstance(piece, Hole):
        return [UnknownPart(piece.why)]
    if isinstance(piece, NodePart):
        return [own_name(piece.what, first)]
    return _input_parts(piece)


def _input_parts(piece: Input) -> list[Part]:
    """Return the symbolic part once per default."""
    assert isinstance(piece.owner, (NodeRecord, OptionDefaults))
    defaults = _default_texts(piece.owner.default(piece.name)) or [None]
    return [ParameterPart(piece.name, default, None, piece.edits) for default in defaults]


def _default_texts(value: Value) -> list[str | None]:
    texts: list[str | None] = []
    for atom in value:
        if isinstance(atom, (str, int, float)):
            texts.append(str(atom))
        elif isinstance(atom, Text) and not is_of_inputs(atom):
            texts.extend(_plain_texts((atom,)) or [None])
        else:
            texts.append(None)
    found = list(dict.fromkeys(texts))
    return found if len(found) <= MAX_ALTERNATIVES else [None]


# --- arguments in code --------------------------------------------------------------------------------------


def _arguments_in_code(record: NodeRecord, findings: Findings) -> list[Gap]:
    """Return a gap for remap rules and parameters that the program itself gives: they are not followed."""
    given = [*record.arguments]
    if record.use_global_arguments != (False,):
        given.extend(findings.global_arguments)
    for words in given:
        found = parse_ros_arguments(words) if isinstance(words, tuple) else None
        if found is None or found.remaps or found.parameters:
            return [Gap(record.source, "remap rules or parameters given in code are not followed")]
    return []


def _hears_launch(record: NodeRecord, findings: Findings) -> bool | None:
    """Return whether the launch's arguments reach the node: not with ``use_global_arguments=False``, nor if the program
    hands arguments of its own to ``rclpy.init``, which then ignores the command line. ``None``: undecided."""
    if record.use_global_arguments == (False,) or findings.global_arguments:
        return False
    return True if record.use_global_arguments == (True,) else None
