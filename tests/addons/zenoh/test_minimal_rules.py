"""Each message of each rule is needed: without it something planned fails, and with all of them everything works.

One router serves a copy of the system in each domain; in every domain but the first one message is missing. So all
are tried at once, and what works in the first domain is the signal that the others had their chance.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.zenoh.configuration import Subject, access_control
from enclave_addons.zenoh.grants import Grants, Use
from enclave_addons.zenoh.rules import AccessRule, access_rules
from keystore import Domains
from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import keystore_of
from tests.addons.zenoh.kit import Heard, topic, wait_for

SIDES = {
    "/giver": Grants({Use.PUBLISH: ("/topic",), Use.SERVE: ("/service",)}),
    "/taker": Grants({Use.SUBSCRIBE: ("/topic",), Use.CALL: ("/service",)}),
}
Atom = tuple[str, str, str]
"""Enclave, rule, message."""
ATOMS: list[Atom] = [
    (enclave, rule.name, message)
    for enclave, grants in SIDES.items()
    for rule in access_rules(enclave, grants, Domains.single(0))
    for message in rule.messages
]
LIVE: Atom = ("/giver", "publish", "put")
"""Without it messages arrive only as history that is asked for: what that takes shows."""
WAYS: list[tuple[frozenset[Atom], Atom | None]] = [
    (base, atom) for base in (frozenset[Atom](), frozenset({LIVE})) for atom in (None, *ATOMS)
]
PLAIN, ASKED = range(len(ATOMS) + 1), range(len(ATOMS) + 1, len(WAYS))


def rules(enclave: str) -> Iterator[AccessRule]:
    for domain, (base, atom) in enumerate(WAYS):
        for rule in access_rules(enclave, SIDES[enclave], Domains.single(domain)):
            kept = tuple(one for one in rule.messages if (enclave, rule.name, one) not in base | {atom})
            if kept:
                yield rule._replace(name=f"{rule.name} {domain}", messages=kept)


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, Any]]:
    keystore: Path = keystore_of(tmp_path_factory.mktemp("minimal") / "ks", {"/giver": {}, "/taker": {}})
    text = json.loads((keystore / "zenoh/router.json5").read_text())
    names = {"/giver": "ros.giver", "/taker": "ros.taker"}
    subjects = [Subject(enclave, name, tuple(rules(enclave))) for enclave, name in names.items()]
    text["access_control"] = access_control(subjects)
    router = kit.router(keystore, json.dumps(text))
    pair = tuple(kit.opened(kit.session_text(keystore, enclave)) for enclave in SIDES)
    with kit.closing(*pair, router):
        yield pair[0], pair[1]


def needed(domains: range, works: Callable[[int], object]) -> set[Atom]:
    """The messages without which it does not work; with all of them it must."""
    assert works(domains[0]), "it does not work with all rules"
    return {atom for domain in domains[1:] if (atom := WAYS[domain][1]) and not works(domain)}


def settled(sessions: tuple[Any, Any]) -> None:
    """Both sessions have dealt with all they were sent so far: a call there and back, through the router, each way."""
    giver, taker = sessions
    for one, other in ((giver, taker), (taker, giver)):
        _told(one, other, kit.token("/giver" if one is giver else "/taker", "NN"))


def _told(one: Any, other: Any, key: str) -> None:
    held = one.liveliness().declare_token(key)
    assert wait_for(lambda: kit.graph(other, key))
    held.undeclare()


def heard_in(domains: range) -> dict[int, Heard]:
    return {domain: Heard() for domain in domains}


def topics(sessions: tuple[Any, Any]) -> set[Atom]:
    giver, taker = sessions
    heard = heard_in(PLAIN)
    kept = [taker.declare_subscriber(topic("/topic", domain), heard[domain]) for domain in PLAIN]
    publishers = {domain: giver.declare_publisher(topic("/topic", domain)) for domain in PLAIN}
    settled(sessions)
    for publisher in (*list(publishers.values())[1:], publishers[0]):
        publisher.put("message")
    assert heard[0].waits_for("message")
    settled(sessions)
    del kept
    return needed(PLAIN, lambda domain: heard[domain].samples)


def late_joiners(sessions: tuple[Any, Any]) -> set[Atom]:
    giver, taker = sessions
    heard = heard_in(PLAIN)
    publishers = [kit.transient_local_publisher(giver, topic("/topic", domain)) for domain in PLAIN]
    for publisher in publishers:
        publisher.put("old")
    settled(sessions)
    kept = [
        kit.transient_local_subscription(taker, topic("/topic", domain), heard[domain])
        for domain in (*PLAIN[1:], 0)
    ]
    assert heard[0].waits_for("old")
    settled(sessions)
    del kept
    return needed(PLAIN, lambda domain: heard[domain].samples)


def late_publishers(sessions: tuple[Any, Any]) -> set[Atom]:
    """A publisher that comes later is asked for what it has. Without heartbeats, which would tell of it too."""
    giver, taker = sessions
    heard = heard_in(ASKED)
    kept = [
        kit.transient_local_subscription(taker, topic("/topic", domain), heard[domain]) for domain in ASKED
    ]
    settled(sessions)
    publishers = [
        kit.transient_local_publisher(giver, topic("/topic", domain), heartbeats=False)
        for domain in (*ASKED[1:], ASKED[0])
    ]
    for publisher in publishers:
        publisher.put("at once")
    assert heard[ASKED[0]].waits_for("at once")
    settled(sessions)
    del kept
    return needed(ASKED, lambda domain: heard[domain].samples)


def losses(sessions: tuple[Any, Any]) -> set[Atom]:
    """That a message was lost is noticed by the next heartbeat, and the message asked for."""
    giver, taker = sessions
    heard = heard_in(ASKED)
    kept = [
        kit.transient_local_subscription(taker, topic("/topic", domain), heard[domain]) for domain in ASKED
    ]
    publishers = [
        kit.transient_local_publisher(giver, topic("/topic", domain)) for domain in (*ASKED[1:], ASKED[0])
    ]
    for publisher in publishers:
        publisher.put("first")
    assert heard[ASKED[0]].waits_for("first")
    settled(sessions)
    for publisher in publishers:
        publisher.put("lost")
    assert heard[ASKED[0]].waits_for("lost")
    settled(sessions)
    del kept
    return needed(ASKED, lambda domain: "lost" in heard[domain].texts())


def services(sessions: tuple[Any, Any]) -> set[Atom]:
    giver, taker = sessions
    kept = [kit.serving(giver, topic("/service", domain), "answer") for domain in PLAIN]
    clients = [kit.client_of(taker, topic("/service", domain)) for domain in PLAIN]
    settled(sessions)
    assert wait_for(lambda: clients[0].matching_status.matching)
    found = needed(PLAIN, lambda domain: kit.called(clients[domain]))
    del kept
    return found


def graph(sessions: tuple[Any, Any]) -> set[Atom]:
    giver, taker = sessions
    return _seen(sessions, "/giver", giver, taker) | _seen(sessions, "/taker", taker, giver)


def _seen(sessions: tuple[Any, Any], enclave: str, one: Any, other: Any) -> set[Atom]:
    def told() -> list[Any]:
        return [one.liveliness().declare_token(kit.token(enclave, "NN", domain=domain)) for domain in PLAIN]

    held = told()
    settled(sessions)
    found = needed(PLAIN, lambda domain: kit.graph(other, f"@ros2_lv/{domain}/**"))
    seen = heard_in(PLAIN)
    kept = [other.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", seen[domain]) for domain in PLAIN]
    settled(sessions)
    held += told()
    settled(sessions)
    del kept
    return found | needed(PLAIN, lambda domain: seen[domain].samples)


def test_without_any_single_message_something_planned_fails(sessions: tuple[Any, Any]) -> None:
    functions = (topics, services, late_joiners, late_publishers, losses, graph)
    found = set(itertools.chain.from_iterable(function(sessions) for function in functions))
    assert set(ATOMS) - found == set(), "these are granted without need"
