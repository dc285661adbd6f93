"""A description of a node held against what the node was recorded to ask, with each name as rcl would resolve it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from enum import Enum
from functools import partial
from typing import NamedTuple

from enclave_addons.recording.record.requested import RequestedEndpoint, RequestedNode
from nodl.builtin_interfaces import LOGGER_SERVICES
from nodl.name_template import NameTemplate
from nodl.names import InvalidNameError, split_fqn
from nodl.node_interface import RANDOM_ENDING, Endpoint, EndpointKind, NodeInterface
from nodl.remap import NodeNames
from nodl.ros_arguments import arguments_as_inputs


class Verdict(Enum):
    """How a description and a record differ."""

    MISSING = "missing"  # recorded and not described: it would be refused
    NEVER_SEEN = "never seen"  # described and not recorded: more than this run needed
    WRONG = "wrong"  # both know it and say different things
    NOT_KNOWN = "not known"  # the description itself has a gap there


class Difference(NamedTuple):
    """A difference between description and record. ``kind`` ``None``: about the node as a whole."""

    verdict: Verdict
    node: str
    kind: EndpointKind | None
    name: str
    detail: str = ""

    def __str__(self) -> str:
        what = f"{self.kind.value.replace('_', ' ')} {self.name}" if self.kind else self.name
        return f"{self.verdict.value}: {self.node}: {what}{f' ({self.detail})' if self.detail else ''}"


class Comparison(NamedTuple):
    """The comparison of a node with its description. ``agreed``: how many endpoints both have."""

    agreed: int
    differences: tuple[Difference, ...]

    @property
    def fits(self) -> bool:
        """Return True if nothing is missing or wrong; that more is described than was seen is for the reader."""
        return not any(d.verdict in (Verdict.MISSING, Verdict.WRONG) for d in self.differences)


class _Described(NamedTuple):
    kind: EndpointKind
    pattern: re.Pattern[str]
    shown: str
    endpoint: Endpoint

    @property
    def is_pattern(self) -> bool:
        return "*" in self.shown


def compare(node: RequestedNode, interfaces: Sequence[NodeInterface]) -> Comparison:
    """Hold the one of ``interfaces`` that describes ``node`` against its record."""
    interface = _matching(node, interfaces)
    if interface is None:
        names = ", ".join(str(each.name) for each in interfaces)
        missing = [_difference(Verdict.MISSING, node, requested) for requested in _granted(node)]
        about = Difference(Verdict.WRONG, node.fqn, None, f"node name {node.name}", f"described: {names}")
        return Comparison(0, (about, *missing))
    described = [
        each
        for endpoint in interface.endpoints
        for each in _described(node, endpoint)
        if not (node.logger_services and each.shown in _logger_services(node))
    ]
    requested = _granted(node)
    differences = [*_about_the_node(node, interface)]
    differences += [
        _difference(Verdict.MISSING, node, each) for each in requested if not _find(each, described)
    ]
    differences += _types(node, requested, described)
    differences += _never_seen(node, requested, described)
    differences += [
        Difference(Verdict.NOT_KNOWN, node.fqn, None, gap.why, str(gap.source)) for gap in interface.gaps
    ]
    agreed = sum(1 for each in requested if _find(each, described))
    return Comparison(agreed, tuple(dict.fromkeys(differences)))


def _logger_services(node: RequestedNode) -> tuple[str, ...]:
    """Return the logger services, an attribute of the recorded node and not endpoints of its own."""
    return tuple(f"{node.fqn}/{name}" for name in LOGGER_SERVICES)


def _matching(node: RequestedNode, interfaces: Sequence[NodeInterface]) -> NodeInterface | None:
    same = [each for each in interfaces if _is_named(node, each.name)]
    if len(same) > 1:
        same = [each for each in same if (each.namespace or "") == node.namespace] or same
    return same[0] if same else (interfaces[0] if len(interfaces) == 1 else None)


def _is_named(node: RequestedNode, described: str | None) -> bool:
    if described is None or not described.endswith(RANDOM_ENDING):
        return described == node.name
    stem = described.removesuffix(RANDOM_ENDING) + "_"
    return node.name.startswith(stem) or split_fqn(node.fqn)[1].startswith(stem)


def _granted(node: RequestedNode) -> list[RequestedEndpoint]:
    """Return what rcl took, or refused: a name that it calls invalid needs no permission."""
    seen = {(each.kind, each.final): each for each in node.endpoints if each.rc in (0, 1) and each.final}
    return list(seen.values())


def _about_the_node(node: RequestedNode, interface: NodeInterface) -> Iterable[Difference]:
    wrong = partial(Difference, Verdict.WRONG, node.fqn, None)
    if interface.name and node.name and not _is_named(node, interface.name):
        yield wrong(f"node name {interface.name}", f"recorded: {node.name}")
    if (interface.namespace or "/").strip("/") != node.namespace.strip("/"):
        yield wrong(f"namespace {interface.namespace or '/'}", f"recorded: {node.namespace or '/'}")
    if interface.lifecycle != node.lifecycle:
        said = "a lifecycle node" if interface.lifecycle else "not a lifecycle node"
        yield wrong(said, "the record says otherwise")


def _difference(verdict: Verdict, node: RequestedNode, requested: RequestedEndpoint) -> Difference:
    return Difference(
        verdict, node.fqn, requested.kind, requested.final, f"written {requested.written!r}, {requested.type}"
    )


def _types(
    node: RequestedNode, requested: Iterable[RequestedEndpoint], described: Sequence[_Described]
) -> Iterable[Difference]:
    for each in requested:
        found = _find(each, described)
        if found is None or found.is_pattern:
            continue  # what only fits a pattern may be another endpoint than the one described
        if found.endpoint.type and each.type and found.endpoint.type != each.type:
            detail = f"type {found.endpoint.type}, recorded {each.type}; {found.endpoint.source}"
            yield Difference(Verdict.WRONG, node.fqn, each.kind, each.final, detail)


def _never_seen(
    node: RequestedNode, requested: Sequence[RequestedEndpoint], described: Iterable[_Described]
) -> Iterable[Difference]:
    for item in described:
        if not any(item.kind is each.kind and item.pattern.fullmatch(each.final) for each in requested):
            yield Difference(Verdict.NEVER_SEEN, node.fqn, item.kind, item.shown, str(item.endpoint.source))


def _find(requested: RequestedEndpoint, described: Iterable[_Described]) -> _Described | None:
    """Return the one that is named so, rather than one whose pattern fits."""
    fitting = [e for e in described if e.kind is requested.kind and e.pattern.fullmatch(requested.final)]
    return min(fitting, key=lambda each: each.is_pattern, default=None)


def _described(node: RequestedNode, endpoint: Endpoint) -> Iterable[_Described]:
    inputs = {**arguments_as_inputs(node.start.arguments), **node.start.parameters}
    readings = (endpoint.name, *endpoint.readings)
    for template in (each for reading in readings for each in reading.fill_each(inputs)):
        for final in _finals(node, endpoint.kind, template):
            pattern = re.compile(".+".join(re.escape(part) for part in final.split("*")))
            yield _Described(endpoint.kind, pattern, final, endpoint)


_STAND_IN = "STAR_OF_A_PATTERN"


def _finals(node: RequestedNode, kind: EndpointKind, template: NameTemplate) -> set[str]:
    """Return the final name; of an action, with and without its remapping, as the distribution is not known here."""
    namespace, name = split_fqn(node.fqn)
    names = NodeNames(name, namespace, node.start.rules)
    text = template.text.replace("*", _STAND_IN)
    try:
        if kind.family == "action":
            recorded = {each.final for each in node.endpoints if each.kind is kind}
            both = {names.action(text, as_a_whole=whole).name for whole in (True, False)}
            found = both & recorded or {names.action(text, as_a_whole=False).name}
        else:
            found = {(names.topic(text) if kind.family == "topic" else names.service(text)).name}
    except InvalidNameError:
        return set()
    return {final.replace(_STAND_IN, "*") for final in found}
