"""Checks of a plan beyond what planning itself tells. Pure; each check is one function from a plan to findings.

A finding has a stable code (``RULES`` says what each means), a place where there is one, and what to do next.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any

from enclave_launch.review.document import Grant, Operation, PlanDocument, Told, plan_from_document
from enclave_launch.review.similarity import splits
from keystore.formats.permissions_patterns import can_meet

RULES: Mapping[str, str] = {
    "no-publisher": "A topic is subscribed and nothing in this plan publishes it.",
    "no-subscriber": "A topic is published and nothing in this plan subscribes it.",
    "no-server": "A service or action is called and nothing in this plan serves it.",
    "nearly-the-same-name": "Two names that never meet differ by one slash, letter or capital only.",
    "types-differ": "Both ends of a topic, service or action have different types: they never match.",
    "node-name-twice": "Two nodes have the same full name: rcl warns, tools confuse them.",
    "wildcard": "A permission holds a wildcard: it covers names that nobody may have thought of.",
    "enclave-shared": "Nodes of one enclave may do what only others of it ask for.",
    "security-variable-set": "The launch file itself sets a ROS_SECURITY_ variable of a process.",
    "secret-in-parameters": "A parameter looks like a secret: parameters are readable over the network and in files.",
    "flow-forbidden": "An influence that the repository's rules forbid is possible.",
    "rule-idle": "A rule of the repository names nothing in this plan.",
}
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
_SECRET = re.compile(r"(^|[._])(password|passwd|secret|token|api_?key|private_?key)$", re.IGNORECASE)


def check_plan(document: Mapping[str, Any]) -> list[Told]:
    """All findings of the dry run's JSON ``document``: what planning told first, then each check's, sorted."""
    plan = plan_from_document(document)
    own = [
        *_ends(plan, document),
        *_near_names(plan),
        *_types(document),
        *_twice(plan),
        *_wildcards(plan),
        *_shared(plan),
        *_environment(document),
        *_secrets(document),
    ]
    return [*plan.told, *sorted(own)]


def finding(
    code: str, subject: str, text: str, remedy: str, place: tuple[str | None, int] = (None, 0)
) -> Told:
    """A warning of this module's."""
    return Told("warning", code, subject, *place, text, remedy)


def _asked_for(plan: PlanDocument) -> dict[Operation, set[str]]:
    asked: dict[Operation, set[str]] = {}
    for node in plan.nodes:
        for grant in node.own:
            asked.setdefault(grant.operation, set()).add(grant.name)
    return asked


def _ends(plan: PlanDocument, document: Mapping[str, Any]) -> Iterator[Told]:
    """Only what nodes ask for themselves; what runs outside of this launch is not known here."""
    asked = _asked_for(plan)
    everywhere: dict[Operation, set[str]] = {}
    for grant in frozenset[Grant]().union(*plan.enclaves.values()):
        everywhere.setdefault(grant.operation, set()).add(grant.name)
    for here, there, code, verb in _ENDS:
        for name in sorted(asked.get(here, ())):
            if not any(can_meet(name, other) for other in everywhere.get(there, ())):
                users, place = _users(document, here, name)
                yield finding(
                    code,
                    name,
                    f"nothing in this plan {verb} {name}, which {users} {'use' if ' and ' in users else 'uses'}",
                    "look for a slip in the name, or accept it if the other end runs elsewhere",
                    place,
                )


def _users(document: Mapping[str, Any], operation: str, name: str) -> tuple[str, tuple[str | None, int]]:
    users: list[str] = []
    place: tuple[str | None, int] = (None, 0)
    for node in document.get("nodes", ()):
        for interface in node["interfaces"]:
            if (interface["operation"], interface["name"]) == (operation, name):
                users.append(node["fqn"])
                place = _place(interface["place"])
    return " and ".join(sorted(set(users))), place


def _place(text: str) -> tuple[str | None, int]:
    file, colon, line = text.rpartition(":")
    return (file, int(line)) if colon and line.isdigit() else (None, 0)


def _near_names(plan: PlanDocument) -> Iterator[Told]:
    asked = _asked_for(plan)
    for here, there in (
        ("publish", "subscribe"),
        ("serve_services", "call_services"),
        ("serve_actions", "call_actions"),
    ):
        lonely_here = asked.get(here, set()) - asked.get(there, set())  # type: ignore[call-overload]
        lonely_there = asked.get(there, set()) - asked.get(here, set())  # type: ignore[call-overload]
        for one in sorted(lonely_here):
            for two in sorted(lonely_there):
                if _nearly(one, two):
                    yield finding(
                        "nearly-the-same-name",
                        one,
                        f"{one} ({here.replace('_', ' ')}) and {two} ({there.replace('_', ' ')}) never meet and "
                        "are nearly the same",
                        "if they are meant to be one, write or remap both alike",
                    )


def _nearly(one: str, two: str) -> bool:
    """One edit apart, or the same but for slashes and capitals; digits count as different on purpose."""
    plain_one, plain_two = (name.replace("/", "").replace("_", "").lower() for name in (one, two))
    if plain_one == plain_two:
        return True
    if len(one) < 6 or abs(len(one) - len(two)) > 1 or _digits(one) != _digits(two):
        return False
    return _one_edit(one, two)


def _digits(name: str) -> str:
    return "".join(character for character in name if character.isdigit())


def _one_edit(one: str, two: str) -> bool:
    short, long = sorted((one, two), key=len)
    for index, character in enumerate(short):
        if character != long[index]:
            rest = short[index + 1 :] if len(short) == len(long) else short[index:]
            return rest == long[index + 1 :]
    return len(long) - len(short) <= 1


def _types(document: Mapping[str, Any]) -> Iterator[Told]:
    types: dict[tuple[str, str], dict[str, set[str]]] = {}
    for node in document.get("nodes", ()):
        for interface in node["interfaces"]:
            kind = _KINDS[interface["operation"]]
            if interface["type"] and "*" not in interface["name"]:
                by_type = types.setdefault((kind, interface["name"]), {})
                by_type.setdefault(interface["type"], set()).add(node["fqn"])
    for (kind, name), by_type in sorted(types.items()):
        for one, two in combinations(sorted(by_type), 2):
            yield finding(
                "types-differ",
                name,
                f"{kind} {name} is {one} for {', '.join(sorted(by_type[one]))} and {two} for "
                f"{', '.join(sorted(by_type[two]))}",
                "they never match: correct one of them",
            )


_KINDS = {
    "publish": "topic",
    "subscribe": "topic",
    "call_services": "service",
    "serve_services": "service",
    "call_actions": "action",
    "serve_actions": "action",
}


def _twice(plan: PlanDocument) -> Iterator[Told]:
    names = [node.fqn for node in plan.nodes]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield finding(
            "node-name-twice",
            name,
            f"{names.count(name)} nodes are called {name}",
            "give each a name of its own",
        )


def _wildcards(plan: PlanDocument) -> Iterator[Told]:
    for enclave, grants in sorted(plan.enclaves.items()):
        for grant in sorted(grants):
            if any(character in grant.name for character in "*?["):
                yield finding(
                    "wildcard",
                    grant.name,
                    f"enclave {enclave} may {grant}",
                    "name what is meant, or accept it with the reason why that is not possible",
                )


def _shared(plan: PlanDocument) -> Iterator[Told]:
    for split in splits(plan):
        gains = "; ".join(f"{node} gains {len(grants)}" for node, grants in split.saved)
        yield finding(
            "enclave-shared",
            split.enclave,
            f"{len(plan.nodes_of(split.enclave))} nodes share enclave {split.enclave}: {gains} permissions",
            "give them enclaves of their own (enclave=, --enclave-scope node); secure-plan suggest shows the gain",
        )


def _environment(document: Mapping[str, Any]) -> Iterator[Told]:
    for process in document["processes"]:
        for name, value in sorted(process["environment"].items()):
            if name.startswith("ROS_SECURITY_"):
                yield finding(
                    "security-variable-set",
                    process["fqn"] or process["executable"],
                    f"the launch file sets {name}={value}",
                    "leave it to --secure",
                    (process["launch_file"], process["line"]),
                )


def _secrets(document: Mapping[str, Any]) -> Iterator[Told]:
    for item in _launched(document):
        for name, value in sorted(item["parameters"].items()):
            if _SECRET.search(name) and isinstance(value, str) and value:
                yield finding(
                    "secret-in-parameters",
                    item["fqn"] or item.get("executable", ""),
                    f"parameter {name} holds what looks like a secret",
                    "let the node read it from a file or variable that only it can read",
                    (item["launch_file"], item["line"]),
                )


def _launched(document: Mapping[str, Any]) -> Iterable[Mapping[str, Any]]:
    return (*document["processes"], *document["components"])
