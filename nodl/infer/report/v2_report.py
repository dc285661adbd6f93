"""NoDL v2 documents of inferred nodes: one for each executable and component, its parameters kept.

A name that follows a parameter is listed under its default; our section says which parameter (docs/library.md). What is
not known stands there as a gap, so that the document does not claim more than the analysis knows. Pure.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from nodl.dependence import Dependence
from nodl.document.v2_schema import NAME_PATTERN, TYPE_PATTERN
from nodl.document.v2_section import CATEGORIES, IDENTITY_KEY
from nodl.name_template import NameTemplate, ParameterPart
from nodl.node_interface import (
    RANDOM_ENDING,
    ClientLibrary,
    Endpoint,
    EndpointKind,
    NodeInterface,
    QosPolicies,
)

_PARAMETER = re.compile(r"[A-Za-z_][\w.\-/]*\Z")
_UNKNOWN_QOS = (("history", "SYSTEM_DEFAULT"), ("reliability", "SYSTEM_DEFAULT"))


class _Entry(NamedTuple):
    """``name``: as listed, the default; ``template``: how it varies, empty if it does not; ``each``: a list; ``when``:
    a parameter and the value with which there is such an endpoint."""

    kind: EndpointKind
    name: str
    type: str
    template: str = ""
    each: str = ""
    when: tuple[str, str] = ("", "")
    qos: QosPolicies = ()


def to_v2(nodes: Sequence[NodeInterface]) -> dict[str, str]:
    """File name -> text. Helper nodes of a ``TransformListener`` are said in the document of the node beside them."""
    listeners = {_key(node) for node in nodes if (node.name or "").endswith(RANDOM_ENDING)}
    documents: dict[str, str] = {}
    for node in nodes:
        if (node.name or "").endswith(RANDOM_ENDING):
            continue
        file = f"{_stem(node)}.nodl.yaml"
        if file in documents:
            file = f"{_stem(node)}.{node.name or len(documents)}.nodl.yaml"
        documents[file] = _document(node, listener=_key(node) in listeners)
        listeners.discard(_key(node))
    return dict(sorted(documents.items()))


def _key(node: NodeInterface) -> tuple[str | None, str | None, str | None]:
    return node.package, node.executable, node.plugin


DEAF = "the node does not listen to the launch's arguments, or that is not known"


def _stem(node: NodeInterface) -> str:
    name = node.executable or (node.plugin or node.name or "unknown").rpartition("::")[2]
    return name.removesuffix(".py")


def open_questions(node: NodeInterface) -> list[str]:
    """What a document cannot say of ``node``, with the place: its gaps, and names or types that are not known."""
    questions = [f"{gap.source}: {gap.why}" for gap in node.gaps]
    for endpoint in node.endpoints:
        if _entry(endpoint, node.depends) is None:
            what = f"{endpoint.kind.value.replace('_', ' ')} {endpoint.name}"
            questions.append(f"{endpoint.source}: {what} [{endpoint.type or 'type not known'}]")
    questions += [f"{node.source}: the program gives its node the rule {rule}" for rule in node.own_rules]
    if not node.global_arguments:
        questions.append(f"{node.source}: {DEAF}")
    return list(dict.fromkeys(questions))


def _document(node: NodeInterface, *, listener: bool) -> str:
    found = (_entry(endpoint, node.depends) for endpoint in node.endpoints)
    entries = list(dict.fromkeys(entry for entry in found if entry is not None))
    lines = [
        f"# Node {node.name or '(name not known)'}, inferred from {node.source}.",
        "# SYSTEM_DEFAULT: quality of service that is not inferred; put in what the code asks for.",
        "nodl_version: 2",
        "codegen:",
        f"  {IDENTITY_KEY}:",
        *(f"    {line}" for line in _section(node, entries, listener)),
    ]
    if node.depends is not None and node.depends.defaults:
        lines.append("parameters:")
        lines += [
            f"  {name}: {{type: string, default_value: {_quoted(str(default))}}}"
            for name, default in sorted(node.depends.defaults.items())
        ]
    for category, kind in CATEGORIES.items():
        listed: dict[tuple[str, str], set[QosPolicies]] = {}
        for entry in entries:
            if entry.kind is kind:
                listed.setdefault((entry.name, entry.type), set()).add(entry.qos)
        if listed:
            lines.append(f"{category}:")
        lines += [
            f"  - {{name: {_quoted(name)}, type: {_quoted(type_)}{_qos(found) if kind.family == 'topic' else ''}}}"
            for (name, type_), found in sorted(listed.items())
        ]
    return "\n".join([*lines, ""])


def _qos(found: set[QosPolicies]) -> str:
    known = next(iter(found)) if len(found) == 1 else ()
    return f", qos: {{{', '.join(f'{name}: {value}' for name, value in known or _UNKNOWN_QOS)}}}"


def _section(node: NodeInterface, entries: Iterable[_Entry], listener: bool) -> list[str]:
    namespace = node.namespace if node.namespace not in (None, "/") else None
    library = node.library.value if node.library is not ClientLibrary.UNKNOWN else None
    fields = {"executable": node.executable, "plugin": node.plugin, "node": node.name}
    fields |= {"namespace": namespace, "library": library}
    lines = [f"{key}: {_quoted(value)}" for key, value in fields.items() if value]
    lines += ["lifecycle: true"] * node.lifecycle + ["tf_listener: true"] * listener
    lines += _names(entries)
    questions = open_questions(node)
    if questions:
        lines.append("gaps:")
        lines += [f"  - {{why: {_quoted(question)}}}" for question in questions]
    return lines


def _names(entries: Iterable[_Entry]) -> list[str]:
    lines: list[str] = []
    varying = [entry for entry in entries if entry.template]
    for category, kind in CATEGORIES.items():
        listed = {entry.name: entry for entry in varying if entry.kind is kind}
        if listed:
            lines.append(f"  {category}:")
        for name, entry in sorted(listed.items()):
            each = f"each: {_quoted(entry.each)}, " if entry.each else ""
            parameter, value = entry.when
            when = f", when: {{{_quoted(parameter)}: {_quoted(value)}}}" if parameter else ""
            lines.append(f"    {_quoted(name)}: {{{each}name: {_quoted(entry.template)}{when}}}")
    return ["names:", *lines] if lines else []


def _entry(endpoint: Endpoint, depends: Dependence | None = None) -> _Entry | None:
    """``None`` for what NoDL v2 cannot say."""
    template = endpoint.name.unconditional
    filled = template.fill({})
    name = filled.text
    is_name = filled.is_literal and re.search(NAME_PATTERN, name)
    if not is_name or not re.search(TYPE_PATTERN, endpoint.type):
        return None
    variation = depends.variations.get((endpoint.kind, endpoint.name.text)) if depends is not None else None
    if variation is not None:
        tests = [test for group in variation.when.any_of for test in group]
        when = (tests[0].parameter, tests[0].values[0]) if tests else ("", "")
        return _Entry(endpoint.kind, name, endpoint.type, variation.name, "", when, endpoint.qos)
    if template.is_literal:
        return _Entry(endpoint.kind, name, endpoint.type, qos=endpoint.qos)
    written = _written(template)
    return None if written is None else _Entry(endpoint.kind, name, endpoint.type, *written, qos=endpoint.qos)


def _written(template: NameTemplate) -> tuple[str, str] | None:
    """The template in the words of docs/library.md, and the list whose entries it repeats for."""
    parameters = [part for part in template.parts if isinstance(part, ParameterPart)]
    lists = [part for part in parameters if part.item is not None]
    if any(part.edits or not _PARAMETER.match(part.name) for part in parameters) or len(lists) > 1:
        return None
    pieces = [part if isinstance(part, str) else _piece(part, len(template.parts) == 1) for part in template.parts
              if isinstance(part, str | ParameterPart)]  # fmt: skip
    return "".join(pieces), lists[0].name if lists else ""


def _piece(part: ParameterPart, alone: bool) -> str:
    if part.item is not None:
        return "$(item)"
    return f"$(param {part.name})" if alone else f"$(param {part.name} {part.default})"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
