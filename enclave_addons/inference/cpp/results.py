"""Findings of a program become ``NodeInterface`` values: names as templates, with certainty and place. Pure."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from itertools import pairwise

from enclave_addons.inference.cpp.engine.values import NodeNamePart, Text, Value, concatenated, plain
from enclave_addons.inference.cpp.entry import FixedMapping
from enclave_addons.inference.cpp.findings import AllocatedNode, PossibleEndpoint
from enclave_addons.inference.cpp.program import ProgramFindings
from enclave_addons.inference.kernel.findings import Gaps
from enclave_addons.inference.kernel.results import UNDECIDED, certainty_of, own_name
from enclave_addons.inference.start import Start
from nodl.dependence import Dependence, Variation, When
from nodl.name_template import NameTemplate, ParameterPart, Part, UnknownPart, melted
from nodl.node_interface import (
    RANDOM_ENDING,
    Certainty,
    ClientLibrary,
    Endpoint,
    EndpointKind,
    Gap,
    NodeInterface,
)
from nodl.remap import InvalidRemapRuleError, parse_rule


def interfaces_of(
    findings: ProgramFindings,
    package: str | None,
    executable: str | None,
    plugin: str | None,
    start: Start | None = None,
) -> list[NodeInterface]:
    """Return one interface for each node and each name that it may have; gaps of the whole program go to the first.

    ``start``: the launch that gives the first node its parameters, which those beside it may use in their names.
    """
    found: list[NodeInterface] = []
    for record in findings.nodes:
        unreached = _unreached(record, findings)
        given = _given_to_the_first(findings, start) if record is not findings.nodes[0] else {}
        found += [_opened(each, unreached, given) for each in _of_node(record, package, executable, plugin)]
    if found:
        found[0] = found[0]._replace(gaps=(*found[0].gaps, *_program_gaps(findings)))
    return [each._replace(gaps=grouped(each.gaps)) for each in found]


def grouped(gaps: Sequence[Gap]) -> tuple[Gap, ...]:
    """Return one gap for each cause, with the number of its places and the first of them."""
    causes = Gaps()
    causes.include(gaps)
    return tuple(causes.listed())


def _unreached(record: AllocatedNode, findings: ProgramFindings) -> set[str]:
    """Return the parameters that a plan, which knows one node's parameters at a time, would not find in the launch: all
    of a further node or of one that renames itself, and what only another node declares.
    """
    every = {name for each in findings.nodes for name in each.parameters}
    renamed = any("__n" in (word or "") for words in record.arguments for word in words)
    return every - set(record.parameters) if record is findings.nodes[0] and not renamed else every


def _given_to_the_first(findings: ProgramFindings, start: Start | None) -> dict[str, object]:
    """Return the parameters that only the first node has and that a launch alone decides, with what it sets for each
    (``None``: nothing, so that the default counts)."""
    first = findings.nodes[0]
    names = _texts(first.names, first)
    if start is None or first.arguments or not first.use_global_arguments or len(names) != 1:
        return {}
    others = {name for each in findings.nodes[1:] for name in each.parameters}
    in_code = {*first.overrides, *first.set_values}
    set_by_launch = start.parameters(names[0])
    return {name: set_by_launch.get(name) for name in set(first.parameters) - others - in_code}


def _opened(
    interface: NodeInterface, unreached: Container[str], given: Mapping[str, object]
) -> NodeInterface:
    """Return the interface with what launch gives to the parameters ``unreached`` not known, unless it is ``given``."""
    endpoints = []
    for each in interface.endpoints:
        parts = tuple(_reached(part, unreached, given) for part in each.name.parts)
        name = NameTemplate(melted(parts))
        endpoints.append(
            each if parts == each.name.parts else each._replace(name=name, certainty=certainty_of(name))
        )
    return interface._replace(endpoints=tuple(dict.fromkeys(endpoints)))


def _reached(part: Part, unreached: Container[str], given: Mapping[str, object]) -> Part:
    if not isinstance(part, ParameterPart) or part.name not in unreached:
        return part
    texts: tuple[str, ...] = ()
    if part.name in given:
        value = given[part.name]
        texts = part.texts({} if value is None else {part.name: value})
    return texts[0] if len(texts) == 1 else UnknownPart(f"parameter {part.name} of a node beside it")


def program_gaps(findings: ProgramFindings) -> tuple[Gap, ...]:
    """Return what belongs to no single node, and every place without a result, one gap for each cause."""
    return grouped(_program_gaps(findings))


def _program_gaps(findings: ProgramFindings) -> list[Gap]:
    gaps = [Gap(source, why) for source, why in findings.gaps]
    gaps += [Gap(answer.source, answer.reason) for answer in findings.answers if not answer.dead]
    if findings.from_default and findings.nodes:
        why = f"what is made depends on {_listed(findings.from_default)}; listed is what the defaults make"
        gaps.append(Gap(findings.nodes[0].source, why))
    return list(dict.fromkeys(gaps))


def _listed(names: Sequence[str]) -> str:
    words = [name if name.startswith("the ") else f"parameter {name}" for name in names]
    return ", ".join(words)


def _of_node(
    record: AllocatedNode, package: str | None, executable: str | None, plugin: str | None
) -> list[NodeInterface]:
    gaps = [Gap(source, why) for source, why in record.gaps]
    rules = _rules(record, gaps)
    endpoints = tuple(dict.fromkeys(e for found in record.endpoints for e in _endpoint(found, record)))
    unnamed = [endpoint for endpoint in endpoints if not endpoint.name.parts]
    endpoints = tuple(endpoint for endpoint in endpoints if endpoint.name.parts)
    for endpoint in unnamed:  # rcl refuses an empty name, so that nothing is made under it
        if not any(each.source == endpoint.source for each in endpoints):
            what = endpoint.kind.value.replace("_", " ")
            gaps.append(Gap(endpoint.source, f"the name of this {what} is empty: rcl refuses it"))
    names: list[str | None] = [*_texts(record.names, record)]
    if not names and record.description:  # a library names it by an address
        names = [f"{_known_beginning(record)}{RANDOM_ENDING}"]
        rules = (*rules, f"__node:={names[0]}")
    elif not names or len(names) < len(record.names):
        gaps.append(Gap(record.source, "the name of this node is made at run time"))
        names = names or [None]
    namespaces: list[str | None] = ["/" + text.lstrip("/") for text in _texts(record.namespaces, record)]
    if record.namespaces and len(namespaces) < len(record.namespaces):
        gaps.append(Gap(record.source, "the namespace of this node is made at run time"))
    depends = _dependence(record, gaps)
    return [
        NodeInterface(
            package=package, executable=executable, plugin=plugin, name=name, namespace=namespace,
            endpoints=endpoints, source=record.source, library=ClientLibrary.RCLCPP, lifecycle=record.lifecycle,
            parameters=tuple(sorted(record.parameters)), gaps=tuple(dict.fromkeys(gaps)),
            own_rules=rules, global_arguments=record.use_global_arguments, depends=depends,
            parameter_services=record.parameter_services, of_process=plugin is not None and record.of_process,
        )
        for name in dict.fromkeys(names)
        for namespace in dict.fromkeys(namespaces or ["/"])
    ]  # fmt: skip


def _known_beginning(record: AllocatedNode) -> str:
    """Return what the name of a node begins with that a library names by an address, without the last ``_``."""
    (template,) = (each for atom in record.names for each in _templates(atom, record))
    first = template.parts[0]
    return first.rstrip("_") if isinstance(first, str) else ""


def _texts(value: Value, record: AllocatedNode) -> list[str]:
    filled = (template.fill({}) for atom in value for template in _templates(atom, record))
    return list(dict.fromkeys(each.text for each in filled if each.is_literal))


def _endpoint(found: PossibleEndpoint, record: AllocatedNode) -> list[Endpoint]:
    return [
        Endpoint(
            found.kind,
            template,
            found.type,
            found.source,
            _certainty(template, found),
            note="" if found in record.unconditional else UNDECIDED,
        )
        for template in _templates(found.name, record)
    ]


def _dependence(record: AllocatedNode, gaps: list[Gap]) -> Dependence | None:
    """Return the names that follow the final name of another topic or the release, for launch to decide."""
    found_here: dict[tuple[EndpointKind, str], Variation] = {}
    for found in record.endpoints:
        for template in _templates(found.name, record):
            variation = _variation(found, record)
            if variation is None:
                continue
            if found_here.setdefault((found.kind, template.text), variation) != variation:
                why = f"{template} is made in more than one way, which follow different topics or releases"
                gaps.append(Gap(found.source, why))
    variations = {key: variation for key, variation in found_here.items() if variation != Variation()}
    if not variations:
        return None
    return Dependence(variations=FixedMapping(variations), defaults=FixedMapping(), options=FixedMapping())


def _variation(found: PossibleEndpoint, record: AllocatedNode) -> Variation | None:
    """Return the variation; ``None`` if the topic's name has parts that launch does not fill in, which are reported."""
    follows = found.follows
    if follows is None:
        return Variation(when=found.when)
    (template, *others) = _templates(follows.topic, record)
    parts = [_reference(part) for part in template.parts]
    if others or None in parts:
        return None
    name = f"$({follows.how} {''.join(part or '' for part in parts)}){follows.ending}"
    return Variation(name, when=When(()))


def _reference(part: Part) -> str | None:
    """Return a part in the words of descriptions (docs/library.md)."""
    if isinstance(part, ParameterPart) and not part.edits and part.item is None:
        return f"$(param {part.name} {part.default})" if part.default is not None else f"$(param {part.name})"
    return part if isinstance(part, str) and "{" not in part else None


def _certainty(template: NameTemplate, found: PossibleEndpoint) -> Certainty:
    certainty = certainty_of(template)
    return Certainty.FROM_DEFAULT if certainty is Certainty.EXACT and not found.exact else certainty


def _templates(atom: object, record: AllocatedNode) -> list[NameTemplate]:
    texts = [atom] if isinstance(atom, Text) else concatenated((atom,))
    return [NameTemplate(melted(_parts(each, record))) for each in texts if isinstance(each, Text)]


def _parts(text: Text, record: AllocatedNode) -> Iterator[Part]:
    for index, part in enumerate(text.parts):
        if not isinstance(part, NodeNamePart):
            yield part
        elif part.record is record:
            yield own_name(part.what, index == 0)
        else:
            names = [plain(each) for each in part.record.names]
            known = names[0] if len(names) == 1 else None
            node = f"the {part.what} of node {known or 'that is not known'}"
            yield UnknownPart(f"{node}, which the launch file may change")


# --- remap rules in code ----------------------------------------------------------------------------------------


def _rules(record: AllocatedNode, gaps: list[Gap]) -> tuple[str, ...]:
    """Return the remap rules in the options of the node; what cannot be read as one is a gap."""
    rules: dict[str, None] = {}
    for words in record.arguments:
        for before, word in pairwise(words):
            if before in ("-r", "--remap") and word is not None:
                try:
                    parse_rule(word)
                    rules.setdefault(word)
                except InvalidRemapRuleError as error:
                    gaps.append(Gap(record.source, str(error)))
        if any(word is None and before not in ("-p", "--param") for before, word in pairwise(("", *words))):
            gaps.append(Gap(record.source, "an argument that the program gives to the node is not known"))
    return tuple(rules)
