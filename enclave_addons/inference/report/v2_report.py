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
    parameters and the tests (in the words of docs/library.md) under which there is such an endpoint; ``release``: the
    first or last one that has it, in those words."""

    kind: EndpointKind
    name: str
    type: str
    template: str = ""
    each: str = ""
    when: tuple[tuple[str, str], ...] = ()
    qos: QosPolicies = ()
    release: str = ""


def to_v2(nodes: Sequence[NodeInterface]) -> dict[str, str]:
    """Map file name to text. Helper nodes of a ``TransformListener`` are in the document of the node beside them."""
    listeners = {program_key(node) for node in nodes if _is_listener(node)}
    documents: dict[str, str] = {}
    for node in nodes:
        if _is_listener(node):
            continue
        file = f"{_stem(node)}.nodl.yaml"
        if file in documents:
            file = f"{_stem(node)}.{node.name or len(documents)}.nodl.yaml"
        documents[file] = _document(node, listener=program_key(node) in listeners)
        listeners.discard(program_key(node))
    return dict(sorted(documents.items()))


def program_key(node: NodeInterface) -> tuple[str | None, str | None, str | None]:
    """Return what the nodes of one program have in common."""
    return node.package, node.executable, node.plugin


def _is_listener(node: NodeInterface) -> bool:
    return (node.name or "").endswith(RANDOM_ENDING) and bool(node.own_rules)


DEAF = "the node does not listen to the launch's arguments, or that is not known"


def _stem(node: NodeInterface) -> str:
    name = node.executable or (node.plugin or node.name or "unknown").rpartition("::")[2]
    return name.removesuffix(".py")


def open_questions(node: NodeInterface) -> list[str]:
    """Return what a document cannot say of ``node``, with the place: its gaps, and names or types not known."""
    questions = [f"{gap.source}: {gap.why}" for gap in node.gaps]
    for endpoint in node.endpoints:
        if _entry(endpoint, node.depends) is None:
            what = f"{endpoint.kind.value.replace('_', ' ')} {endpoint.name}"
            questions.append(f"{endpoint.source}: {what} [{endpoint.type or 'type not known'}]")
    entries = [entry for each in node.endpoints if (entry := _entry(each, node.depends)) is not None]
    for kind, name in _clashing(entries):
        what = f"several interfaces are the {kind.value.replace('_', ' ')} {name} by default, and vary differently"
        questions.append(f"{node.source}: {what}")
    questions += [f"{node.source}: the program gives its node the rule {rule}" for rule in node.own_rules]
    if (node.name or "").endswith(RANDOM_ENDING) and not _is_listener(node):
        questions.append(f"{node.source}: the name of this node is different at each start")
    if node.of_process and node.plugin:
        questions.append(
            f"{node.source}: the node obeys the arguments of the container, not those of the component"
        )
    if not node.global_arguments:
        questions.append(f"{node.source}: {DEAF}")
    return list(dict.fromkeys(questions))


def _document(node: NodeInterface, *, listener: bool) -> str:
    found = (_entry(endpoint, node.depends) for endpoint in node.endpoints)
    entries = list(dict.fromkeys(entry for entry in found if entry is not None))
    lines = [
        f"# Node {node.name or '(name not known)'}, inferred from {node.source}.",
        "# SYSTEM_DEFAULT: quality of service that is not inferred; replace it with what the code requests.",
        "nodl_version: 2",
        "codegen:",
        f"  {IDENTITY_KEY}:",
        *(f"    {line}" for line in _section(node, entries, listener)),
    ]
    defaults = _defaults(node)
    if defaults:
        lines.append("parameters:")
        lines += [
            f"  {name}: {{type: string, default_value: {_quoted(default)}}}"
            for name, default in sorted(defaults.items())
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


def _defaults(node: NodeInterface) -> dict[str, str]:
    """Return the defaults of parameters that decide whether there is an endpoint."""
    found = {name: str(default) for name, default in (node.depends.defaults if node.depends else {}).items()}
    for endpoint in node.endpoints:
        for part in endpoint.name.parts:
            if not isinstance(part, ParameterPart) or not _PARAMETER.match(part.name):
                continue
            if part.is_condition and part.default is not None:
                found[part.name] = part.default
    return found


def _qos(found: set[QosPolicies]) -> str:
    known = next(iter(found)) if len(found) == 1 else ()
    return f", qos: {{{', '.join(f'{name}: {value}' for name, value in known or _UNKNOWN_QOS)}}}"


def _section(node: NodeInterface, entries: Iterable[_Entry], listener: bool) -> list[str]:
    namespace = node.namespace if node.namespace not in (None, "/") else None
    library = node.library.value if node.library is not ClientLibrary.UNKNOWN else None
    fields = {
        "package": node.package,
        "executable": node.executable,
        "plugin": node.plugin,
        "node": node.name,
    }
    fields |= {"namespace": namespace, "library": library}
    lines = [f"{key}: {_quoted(value)}" for key, value in fields.items() if value]
    lines += ["lifecycle: true"] * node.lifecycle + ["tf_listener: true"] * listener
    lines += ["parameter_services: false"] * (not node.parameter_services)
    lines += [f"source_digest: {_quoted(node.source_digest)}"] * bool(node.source_digest)
    lines += _names(entries)
    questions = open_questions(node)
    if questions:
        lines.append("gaps:")
        lines += [f"  - {{why: {_quoted(question)}}}" for question in questions]
    return lines


def _names(entries: Iterable[_Entry]) -> list[str]:
    lines: list[str] = []
    listed = _by_name(entries)
    for category, kind in CATEGORIES.items():
        varying = {name: each for (of, name), each in listed.items() if of is kind and not _is_plain(each)}
        if varying:
            lines.append(f"  {category}:")
        for name, (first, *others) in sorted(varying.items()):
            each = f"each: {_quoted(first.each)}, " if first.each else ""
            tests = [_tests(entry.when) for entry in (first, *others)]
            when = (
                f", when: {tests[0] if len(tests) == 1 else '[' + ', '.join(tests) + ']'}"
                if first.when
                else ""
            )
            varied = f"{each}name: {_quoted(first.template or name)}{when}{first.release}"
            lines.append(f"    {_quoted(name)}: {{{varied}}}")
    return ["names:", *lines] if lines else []


def _tests(when: Iterable[tuple[str, str]]) -> str:
    return "{" + ", ".join(f"{_quoted(parameter)}: {test}" for parameter, test in when) + "}"


def _by_name(entries: Iterable[_Entry]) -> dict[tuple[EndpointKind, str], list[_Entry]]:
    """Return what the document says of each listed name; QoS and type do not make a difference here."""
    found: dict[tuple[EndpointKind, str], dict[_Entry, None]] = {}
    for entry in entries:
        found.setdefault((entry.kind, entry.name), {})[entry._replace(type="", qos=())] = None
    return {key: list(each) for key, each in found.items()}


def _is_plain(entries: list[_Entry]) -> bool:
    """Return True if the name is there in any case: nothing that it varies with matters then."""
    return all(not entry.template for entry in entries) and any(
        not entry.when and not entry.release for entry in entries
    )


def _clashing(entries: Iterable[_Entry]) -> list[tuple[EndpointKind, str]]:
    """Names that stand for endpoints which vary in different ways; a document has one line for each name."""
    return [
        key
        for key, each in _by_name(entries).items()
        if len({(entry.template, entry.each) for entry in each}) > 1
        or (len(each) > 1 and any(not entry.when for entry in each) and not _is_plain(each))
    ]


def _entry(endpoint: Endpoint, depends: Dependence | None = None) -> _Entry | None:
    """Return the entry; ``None`` for what NoDL v2 cannot say."""
    template = endpoint.name.unconditional
    filled = template.fill({})
    name = filled.text
    is_name = filled.is_literal and re.search(NAME_PATTERN, name)
    if not is_name or not re.search(TYPE_PATTERN, endpoint.type):
        return None
    variation = depends.variations.get((endpoint.kind, endpoint.name.text)) if depends is not None else None
    if variation is not None:
        tests = [test for group in variation.when.any_of for test in group]
        told = ((tests[0].parameter, _quoted(tests[0].values[0])),) if tests else ()
        since, until = variation.when.since, variation.when.until
        release = f", since: {since}" * bool(since) + f", until: {until}" * bool(until)
        return _Entry(endpoint.kind, name, endpoint.type, variation.name, "", told, endpoint.qos, release)
    when = _conditions(endpoint.name)
    if when is None:
        return None
    if template.is_literal:
        return _Entry(endpoint.kind, name, endpoint.type, when=when, qos=endpoint.qos)
    written = _written(template)
    return (
        None if written is None else _Entry(endpoint.kind, name, endpoint.type, *written, when, endpoint.qos)
    )


def _conditions(template: NameTemplate) -> tuple[tuple[str, str], ...] | None:
    """Return the tests of parameters on which the name depends; ``None`` where a document cannot say them."""
    parts = [part for part in template.parts if isinstance(part, ParameterPart) and part.is_condition]
    if len({part.name for part in parts}) < len(parts):
        return None
    found: list[tuple[str, str]] = []
    for part in parts:
        (edit, given), *others = part.edits
        if others or not _PARAMETER.match(part.name):
            return None
        listed = "[" + ", ".join(map(_quoted, given)) + "]"
        test = {
            "only if true": '"true"',
            "only if false": '{not: "true"}',
            "only if equal": listed,
            "only if among": listed,
            "only if different": f"{{not: {listed}}}",
            "only if not among": f"{{not: {listed}}}",
        }.get(edit)
        if test is None or any(text != text.lower() for text in given):
            return None  # tests of documents do not tell capital letters from small ones
        found.append((part.name, test))
    return tuple(found)


def _written(template: NameTemplate) -> tuple[str, str] | None:
    """Return the template in the words of docs/library.md, and the list whose entries it repeats for."""
    parameters = [part for part in template.parts if isinstance(part, ParameterPart)]
    lists = [part for part in parameters if part.item is not None]
    if not all(_PARAMETER.match(part.name) for part in parameters) or len(lists) > 1:
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
