"""What the plan does not grant fails on real Zenoh, each beside an allowed neighbour that works.

The attacker has a valid certificate of an enclave and obeys no file of ours. Nothing is waited for in vain: what must
not arrive is followed, in the same session, by something that may, and that arrives.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
import zenoh

from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import System
from tests.addons.zenoh.kit import Heard, answers, passes, serving, token, topic, wait_for

SERVICE = kit.TRIGGER
PLAN = "/plan/_action"
FEEDBACK = f"{PLAN}/feedback"


class Message(NamedTuple):
    """``sender`` puts to ``key``, where ``victim`` rightly listens to ``at``; ``neighbour``: what ``sender`` may."""

    sender: str
    key: str
    victim: str
    at: str


MESSAGES = {
    "on a topic of others": Message("/talker", topic("/gossip"), "/spy", "/gossip"),
    "by somebody with no part in the topic": Message("/client", topic("/chatter"), "/listener", "/chatter"),
    "by a subscriber of the topic": Message("/listener", topic("/clock"), "/listener", "/clock"),
    "below a name that it may publish": Message("/talker", topic("/chatter/below"), "/spy", "/chatter/below"),
    "on everything": Message("/talker", "**", "/spy", "/gossip"),
    "on everything of the domain": Message("/talker", "0/**", "/spy", "/gossip"),
    "on all topics": Message("/talker", "0/*/*/*", "/spy", "/gossip"),
    "on a prefix that holds its own name": Message("/talker", "0/$*atter/*/*", "/spy", "/gossip"),
    "on everything below its own name": Message("/talker", "0/chatter/**", "/spy", "/chatter/below"),
    "as feedback of another's action": Message("/server", topic(FEEDBACK), "/robot/pilot", FEEDBACK),
    "as status of an action": Message("/spy", topic(f"{PLAN}/status"), "/robot/pilot", f"{PLAN}/status"),
    "as the clock": Message("/talker", topic("/clock"), "/listener", "/clock"),
    "beside a wildcard that it has": Message("/tools", topic("/chatter"), "/listener", "/chatter"),
}  # fmt: skip


@pytest.mark.parametrize("what", MESSAGES)
def test_a_message_is_dropped(system: System, what: str) -> None:
    attack = MESSAGES[what]
    victim = kit.opened(kit.session_text(system.keystore, attack.victim))
    with kit.closing(victim):
        heard, barrier = Heard(), Heard()
        kept = [
            victim.declare_subscriber(topic(attack.at), heard),
            victim.declare_subscriber(topic("/barrier"), barrier),
        ]
        attacker = system[attack.sender]
        assert passes(attacker, topic("/barrier"), barrier)
        attacker.put(attack.key, "forged")
        declared = attacker.declare_publisher(attack.key)
        declared.put("forged")
        assert passes(attacker, topic("/barrier"), barrier) and kept
        assert "forged" not in heard.texts()


def test_deleting_on_its_own_topic_is_no_publishing(system: System) -> None:
    heard = system.hears("/listener", topic("/chatter"))
    assert passes(system["/talker"], topic("/chatter"), heard)
    before = len(heard.samples)
    system["/talker"].delete(topic("/chatter"))
    system.flush(system["/talker"], "/listener")
    assert all(text for text in heard.texts()[before:])


SUBSCRIPTIONS = (
    topic("/chatter"), "**", "*/**", "0/**", "0/chatter/**", "0/*/*/*", "*/chatter/*/*", "0/chat$*/*/*", "0/*/**",
    "0/*/std_msgs::msg::dds_::String_/*", "@$*/**", topic("/latched") + "/@adv/**", topic("/latched"),
)  # fmt: skip


@pytest.mark.parametrize("key", SUBSCRIPTIONS)
def test_a_subscription_gets_nothing_of_what_is_not_granted(system: System, key: str) -> None:
    spied = Heard()
    kept = system["/spy"].declare_subscriber(key, spied)
    heard = system.hears("/listener", topic("/chatter"))
    latched = kit.transient_local_publisher(system["/talker"], topic("/latched"))
    latched.put("secret")
    assert passes(system["/talker"], topic("/chatter"), heard)
    system.flush(system["/talker"], "/spy")
    assert not [key for key, _ in spied.samples if "/barrier/" not in key]
    kept.undeclare()
    latched.undeclare()


def test_the_history_of_a_topic_is_not_given_to_others(system: System) -> None:
    latched = kit.transient_local_publisher(system["/talker"], topic("/latched"))
    latched.put("secret")
    question = f"{topic('/latched')}/@adv/**"
    assert wait_for(lambda: _replies(system["/listener"], question))
    assert not _replies(system["/spy"], question)
    latched.undeclare()


def test_history_is_not_taken_from_somebody_who_is_no_publisher(system: System) -> None:
    forged = f"{topic('/latched')}/@adv/pub/a/b/_"
    kept = system["/client"].declare_queryable(
        forged, lambda query: query.reply(topic("/latched"), "forged"), complete=True
    )
    latched = kit.transient_local_publisher(system["/talker"], topic("/latched"))
    latched.put("true")
    question = f"{topic('/latched')}/@adv/**"
    assert wait_for(lambda: "true" in _replies(system["/listener"], question))
    system.flush(system["/client"], "/listener")
    assert "forged" not in _replies(system["/listener"], question)
    kept.undeclare()
    latched.undeclare()


def _replies(session: Any, selector: str) -> list[str]:
    """As an advanced subscriber asks: the answers come on the plain key."""
    replies = session.get(f"{selector}?_anyke", accept_replies=zenoh.ReplyKeyExpr.ANY, timeout=kit.PATIENCE)
    return [reply.ok.payload.to_string() for reply in replies if reply.ok is not None]


@pytest.fixture(scope="module")
def served(system: System) -> Iterator[System]:
    """Every service has its server."""
    kept = [
        serving(system[enclave], topic(name, type_and_hash=SERVICE), name)
        for enclave, names in {
            "/server": ("/add", "/server/get_parameters", "/server/set_parameters"),
            "/robot/planner": tuple(
                f"/plan/_action/{part}" for part in ("send_goal", "cancel_goal", "get_result")
            ),
        }.items()
        for name in names
    ]
    assert wait_for(lambda: answers(system["/client"], topic("/add", type_and_hash=SERVICE)))
    assert wait_for(
        lambda: answers(system["/robot/pilot"], topic("/plan/_action/get_result", type_and_hash=SERVICE))
    )
    yield system
    for one in kept:
        one.undeclare()


CALLS = {
    "of a service that it may not call": ("/client", topic("/server/set_parameters", type_and_hash=SERVICE)),
    "by an enclave that calls nothing": ("/talker", topic("/add", type_and_hash=SERVICE)),
    "by the server itself": ("/server", topic("/plan/_action/send_goal", type_and_hash=SERVICE)),
    "of an action that is somebody else's": (
        "/client",
        topic("/plan/_action/send_goal", type_and_hash=SERVICE),
    ),
    "that cancels the goal of another": (
        "/listener",
        topic("/plan/_action/cancel_goal", type_and_hash=SERVICE),
    ),
    "of everything": ("/client", "**"),
    "of everything in the domain": ("/client", "0/**"),
    "of everything below its service": ("/client", "0/add/**"),
    "of a node's parameters as a whole": ("/client", "0/server/*/*/*"),
}


@pytest.mark.parametrize("what", CALLS)
def test_a_call_is_not_answered(served: System, what: str) -> None:
    client, key = CALLS[what]
    assert answers(served["/client"], topic("/add", type_and_hash=SERVICE)) == ["/add"]
    assert answers(served[client], key) == []


@pytest.mark.parametrize("key", [topic("/add", type_and_hash=SERVICE), "**", "0/**", "0/add/*/*"])
def test_nobody_else_is_asked_in_place_of_the_server(served: System, key: str) -> None:
    played = serving(served["/talker"], key, "forged")
    served.flush(served["/talker"], "/client")
    assert answers(served["/client"], topic("/add", type_and_hash=SERVICE)) == ["/add"]
    played.undeclare()


TOKENS = {
    "in another enclave's name": ("/spy", token("/talker", "NN")),
    "of an enclave below its own": ("/spy", token("/spy/below", "NN")),
    "of a publisher that it may not be": ("/spy", token("/spy", "MP", "/chatter")),
    "of a subscription that it may not have": ("/talker", token("/talker", "MS", "/chatter")),
    "of a server that it is not": ("/client", token("/client", "SS", "/add")),
    "of a client that it is not": ("/talker", token("/talker", "SC", "/add")),
    "in another domain": ("/talker", token("/talker", "NN", domain=1)),
    "of nobody": ("/talker", "@ros2_lv/0/a/b/c/NN"),
    "of everybody": ("/talker", "@ros2_lv/0/**"),
    "of history that it does not have": ("/client", f"{topic('/latched')}/@adv/pub/a/b/_"),
}


@pytest.mark.parametrize("what", TOKENS)
def test_a_token_is_not_seen(system: System, what: str) -> None:
    enclave, key = TOKENS[what]
    own = token(enclave, "NN")
    held = [
        system[enclave].liveliness().declare_token(each) for each in (key, own)
    ]  # the second follows the first
    assert wait_for(lambda: own in kit.graph(system["/listener"], "@ros2_lv/0/**"))
    domain = "@ros2_lv/1/**" if "domain" in what else "@ros2_lv/0/**"
    assert key not in kit.graph(system["/elsewhere" if "domain" in what else "/listener"], domain)
    assert key not in kit.graph(system["/listener"], f"{topic('/latched')}/@adv/pub/**")
    for each in held:
        each.undeclare()


@pytest.mark.parametrize("asked", ["@ros2_lv/1/**", "@ros2_lv/**", "@ros2_lv/*/**", "**", "@$*/**"])
def test_the_graph_of_another_domain_is_not_shown(system: System, asked: str) -> None:
    other = token("/elsewhere", "NN", domain=1)
    held = system["/elsewhere"].liveliness().declare_token(other)
    assert wait_for(lambda: other in kit.graph(system["/elsewhere"], "@ros2_lv/1/**"))
    followed: list[str] = []
    kept = (
        system["/talker"]
        .liveliness()
        .declare_subscriber(asked, lambda one: followed.append(str(one.key_expr)), history=True)
    )
    assert other not in kit.graph(system["/talker"], asked)
    assert kit.graph(system["/talker"], "@ros2_lv/0/**") is not None and other not in followed
    kept.undeclare()
    held.undeclare()


def test_domains_do_not_hear_each_other(system: System) -> None:
    here, there = (
        system.hears("/listener", topic("/chatter")),
        system.hears("/elsewhere", topic("/chatter", 1)),
    )
    crossing = system.hears("/elsewhere", topic("/chatter", 0))
    system["/talker"].put(topic("/chatter", 1), "forged")
    system["/elsewhere"].put(topic("/chatter", 0), "forged")
    assert passes(system["/talker"], topic("/chatter"), here)
    other = kit.opened(kit.session_text(system.keystore, "/elsewhere"))
    with kit.closing(other):
        assert passes(other, topic("/chatter", 1), there)
    assert "forged" not in here.texts() + there.texts()
    assert not [text for text in crossing.texts() if text != "forged"]  # its own it hears without any router


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_another_mode_gets_no_more(system: System, mode: str) -> None:
    """The router asks for the certificate, not for what somebody says he is."""
    text = json.loads(kit.session_text(system.keystore, "/spy"))
    text["scouting"]["gossip"]["enabled"] = True
    text["access_control"] = {
        "enabled": False,
        "default_permission": "allow",
        "rules": [],
        "subjects": [],
        "policies": [],
    }
    endpoint = f"tls/localhost:{kit.free_port()}"
    tls = text["transport"]["link"]["tls"]
    tls |= {
        "listen_certificate": tls["connect_certificate"],
        "listen_private_key": tls["connect_private_key"],
    }
    attacker = kit.opened(
        json.dumps(text), mode=mode, **{"listen/endpoints": [endpoint], "scouting/delay": 0}
    )
    with kit.closing(attacker):
        spied, heard, gossip = Heard(), system.hears("/listener", topic("/chatter")), Heard()
        kept = [attacker.declare_subscriber(key, spied) for key in ("**", topic("/chatter"))]
        kept.append(attacker.declare_subscriber(topic("/gossip"), gossip))
        assert passes(system["/talker"], topic("/chatter"), heard)
        assert not [key for key, _ in spied.samples if "/chatter/" in key] and kept
        attacker.put(topic("/chatter"), "forged")
        if mode == "peer":
            system.flush(attacker, "/listener")
        assert passes(system["/talker"], topic("/chatter"), heard)
        assert "forged" not in heard.texts()


def test_nobody_can_connect_to_a_process(system: System) -> None:
    """Processes listen nowhere, so that there is no way around the router."""
    text = json.loads(kit.session_text(system.keystore, "/talker"))
    assert text["mode"] == "client" and text["listen"]["endpoints"] == []
    assert len(list(system["/talker"].info.routers_zid())) == 1 and not list(
        system["/talker"].info.peers_zid()
    )


def test_the_admin_space_shows_nothing_of_the_router(system: System) -> None:
    zid = str(system.router.info.zid())
    keys = {str(one.ok.key_expr) for one in system["/spy"].get("@/**", timeout=kit.PATIENCE) if one.ok}
    assert not [key for key in keys if key.startswith(f"@/{zid}")]
