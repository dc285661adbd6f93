"""Ends that should meet: topics, services and actions whose other end is missing, misspelt or of another kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from typing import Any, NamedTuple

from enclave_addons.review.checks.rules import finding
from enclave_addons.review.document import KIND_OF, GrantedName, PlanDocument
from enclave_addons.review.quality import INFINITE, Quality, unmet
from enclave_common.words import some_of
from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import Diagnostic, DryRun, Interface, Operation
from keystore.formats.permissions_patterns import can_meet, has_wildcard

_ENDS: tuple[tuple[Operation, Operation, str, str], ...] = (
    ("subscribe", "publish", "no-publisher", "publishes"),
    ("publish", "subscribe", "no-subscriber", "subscribes"),
    ("call_services", "serve_services", "no-server", "serves"),
    ("call_actions", "serve_actions", "no-server", "serves"),
)
_PAIRS: tuple[tuple[Operation, Operation], ...] = (
    ("publish", "subscribe"),
    ("serve_services", "call_services"),
    ("serve_actions", "call_actions"),
)
_SHORTEST = 6  # letters of a name of which one edit is taken for a slip


class _User(NamedTuple):
    """A node that uses a name, and where its description says so."""

    node: str
    program: str
    interface: Interface


_Users = Mapping[tuple[str, str], list[_User]]


def missing_ends(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Find ends that are missing, of what nodes request themselves; what runs outside this launch is not known here.

    If something of the launch itself is not known, the other end may be there: then one finding says so.
    """
    found = list(_missing_ends(plan, document))
    without = (each.subject for each in plan.diagnostics if each.code in _WITHOUT_INTERFACES)
    gaps = sorted(plan.gaps.union(without))
    if not found or not gaps:
        yield from found
        return
    names = sorted({diagnostic.subject for diagnostic in found})
    lonely, open_ones = some_of(names, _NAMED), some_of(gaps, _NAMED)
    text = f"{lonely} have one end only among what is known, but not all is known of {open_ones}"
    yield finding("ends-not-judged", names[0], text)


_NAMED = 5
_WITHOUT_INTERFACES = (Code.COMMAND_NEEDS_ENCLAVE, Code.EXECUTABLE_WITHOUT_ENCLAVE, Code.ENCLAVE_UNGRANTED)
"""Said of an ``executable``: a simulator, a player of a bag."""


def _missing_ends(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    requested, users = _requested_names(plan), _users(document)
    everywhere: dict[Operation, set[str]] = {}
    for grant in frozenset[GrantedName]().union(*plan.enclaves.values()):
        everywhere.setdefault(grant.operation, set()).add(grant.name)
    for here, there, code, verb in _ENDS:
        others = everywhere.get(there, set())
        patterns = {name for name in others if has_wildcard(name)}
        for name in sorted(requested.get(here, ())):
            candidates = others if has_wildcard(name) else patterns
            if name not in others and not any(can_meet(name, other) for other in candidates):
                using = users.get((here, name), ())
                who = sorted({user.node for user in using})
                use = f"{' and '.join(who)} use{'' if len(who) > 1 else 's'}"
                text = f"nothing in this plan {verb} {name}, which {use}"
                yield finding(code, name, text, _first_place(using))


def near_names(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield pairs of names with opposite ends that never meet and differ by a typing error or a namespace."""
    requested, users = _requested_names(plan), _users(document)
    for here, there in _PAIRS:
        lonely_here = requested.get(here, set()) - requested.get(there, set())
        lonely_there = requested.get(there, set()) - requested.get(here, set())
        for one, two in product(sorted(lonely_here), sorted(lonely_there)):
            ends = users.get((here, one), []), users.get((there, two), [])
            if _nearly(one, two):
                how = "are nearly the same"
            elif _differ_by_namespace(one, two) and _may_match(*ends):
                how = "differ by a namespace only"
            else:
                continue
            uses = f"{one} ({here.replace('_', ' ')}) and {two} ({there.replace('_', ' ')})"
            yield finding("nearly-the-same-name", one, f"{uses} never meet and {how}", _first_place(ends[0]))


def _differ_by_namespace(one: str, two: str) -> bool:
    """Return True if one name is the other with a namespace before it: ``/image`` and ``/camera/image``."""
    return one.endswith(two) or two.endswith(one)


def _may_match(some: list[_User], others: list[_User]) -> bool:
    """Return True if the ends are of two nodes, and of one type as far as the types are known."""
    types = (
        (one.interface.type, two.interface.type) for one, two in product(some, others) if one.node != two.node
    )
    return any(one == two or not (one and two) for one, two in types)


def _nearly(one: str, two: str) -> bool:
    """Return True for names one edit apart, or equal but for slashes and capitals; digits count as different on
    purpose."""
    plain_one, plain_two = (name.replace("/", "").replace("_", "").lower() for name in (one, two))
    if plain_one == plain_two:
        return True
    if len(one) < _SHORTEST or abs(len(one) - len(two)) > 1 or _digits(one) != _digits(two):
        return False
    return _one_edit(one, two) and not _other_end(one, two)


def _other_end(one: str, two: str) -> bool:
    """Return True for names that differ in a word of one or two letters: ``rx`` and ``tx``, ``x`` and ``y``."""
    words = [name.replace("_", "/").split("/") for name in (one, two)]
    differing = [pair for pair in zip(*words, strict=False) if pair[0] != pair[1]]
    return len(words[0]) == len(words[1]) and all(len(word) < 3 for pair in differing for word in pair)


def _digits(name: str) -> str:
    return "".join(character for character in name if character.isdigit())


def _one_edit(one: str, two: str) -> bool:
    short, long = sorted((one, two), key=len)
    for index, character in enumerate(short):
        if character != long[index]:
            rest = short[index + 1 :] if len(short) == len(long) else short[index:]
            return rest == long[index + 1 :]
    return len(long) - len(short) <= 1


def types(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield names with different interface types: those endpoints never match.

    Several types at one place of a program are alternatives (a table of types, a parameter that decides): such an
    endpoint differs from another only if none of them fits."""
    found: dict[tuple[str, str], dict[str, list[_User]]] = {}
    for (operation, name), users in _users(document).items():
        if "*" in name:
            continue
        for alternatives in _by_place(users).values():
            written = " or ".join(sorted({user.interface.type for user in alternatives}))
            found.setdefault((KIND_OF[operation], name), {}).setdefault(written, []).extend(alternatives)
    for (kind, name), by_type in sorted(found.items()):
        for one, two in combinations(sorted(by_type), 2):
            if set(one.split(" or ")).isdisjoint(two.split(" or ")):
                who, other = _nodes(by_type[one]), _nodes(by_type[two])
                text = f"{kind} {name} is {one} for {who} and {two} for {other}"
                yield finding("types-differ", name, text, _first_place(by_type[two]))


def _by_place(users: list[_User]) -> dict[tuple[str, str], list[_User]]:
    """Users with a known type, by node and place."""
    found: dict[tuple[str, str], list[_User]] = {}
    for user in users:
        if user.interface.type:
            found.setdefault((user.node, user.interface.place), []).append(user)
    return found


def qos(plan: PlanDocument, document: DryRun) -> Iterator[Diagnostic]:
    """Yield pairs of incompatible QoS, if both descriptions give theirs; what they leave open is not judged."""
    users = _users(document)
    for (operation, name), publishers in sorted(users.items(), key=lambda item: item[0]):
        if operation != "publish":
            continue
        for publisher, subscriber in product(publishers, users.get(("subscribe", name), ())):
            offered, requested = publisher.interface.qos, subscriber.interface.qos
            why = unmet(_quality(offered, requested), _quality(requested, offered))
            if why:
                text = f"{subscriber.node} gets nothing of {name} from {publisher.node}: {'; '.join(why)}"
                yield finding("qos-differs", name, text, _place(subscriber.interface.place))


def _quality(qos: Mapping[str, Any], other: Mapping[str, Any]) -> Quality:
    """Return the quality, with times only if both say one; 0 is rmw's word for none."""

    def time(key: str) -> int:
        return (qos[key] or INFINITE) if key in qos and key in other else INFINITE

    return Quality(
        reliability=qos.get("reliability", ""),
        durability=qos.get("durability", ""),
        deadline=time("deadline_ns"),
        liveliness=qos.get("liveliness", ""),
        lease=time("liveliness_lease_duration_ns"),
    )


def _requested_names(plan: PlanDocument) -> dict[str, set[str]]:
    requested: dict[str, set[str]] = {}
    for node in plan.nodes:
        for grant in node.own:
            requested.setdefault(grant.operation, set()).add(grant.name)
    return requested


def _users(document: DryRun) -> _Users:
    found: dict[tuple[str, str], list[_User]] = {}
    for node in document.nodes:
        for interface in node.interfaces:
            found.setdefault((interface.operation, interface.name), []).append(
                _User(node.fqn, node.program, interface)
            )
    return found


def _nodes(users: list[_User]) -> str:
    return ", ".join(sorted({user.node for user in users}))


def _first_place(users: Any) -> tuple[str | None, int]:
    return next((_place(user.interface.place) for user in users), (None, 0))


def _place(text: str) -> tuple[str | None, int]:
    file, colon, line = text.rpartition(":")
    return (file, int(line)) if colon and line.isdigit() else (None, 0)


CHECKS = (missing_ends, near_names, types, qos)
