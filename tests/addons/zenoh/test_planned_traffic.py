"""All that the plan of a system grants gets through: topics, services, actions, parameters, history, the graph."""

from __future__ import annotations

import pytest

from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import SYSTEM, System
from tests.addons.zenoh.kit import Heard, answers, passes, serving, token, topic, wait_for

PLAN = "/plan/_action"
TOPICS = [
    ("/talker", "/chatter", "/listener"),
    ("/robot/planner", "/clock", "/listener"),
    ("/robot/planner", f"{PLAN}/feedback", "/robot/pilot"),
    ("/robot/planner", f"{PLAN}/status", "/robot/pilot"),
    ("/tools", "/fleet/a/b/c", "/tools"),
]
SERVICES = [
    ("/client", "/add", "/server"),
    ("/client", "/server/get_parameters", "/server"),
    *(
        ("/robot/pilot", f"{PLAN}/{part}", "/robot/planner")
        for part in ("send_goal", "get_result", "cancel_goal")
    ),
]


@pytest.mark.parametrize(("publisher", "name", "subscriber"), TOPICS)
def test_messages_of_a_topic_arrive(system: System, publisher: str, name: str, subscriber: str) -> None:
    heard, receiver = Heard(), kit.opened(kit.session_text(system.keystore, subscriber))
    with kit.closing(receiver):
        kept = receiver.declare_subscriber(topic(name), heard)
        declared = system[publisher].declare_publisher(topic(name))
        text = kit.mark()
        assert wait_for(lambda: declared.put(text) or text in heard.texts())
        assert passes(system[publisher], topic(name), heard) and kept is not None


@pytest.mark.parametrize(("client", "name", "server"), SERVICES)
def test_calls_of_a_service_are_answered(system: System, client: str, name: str, server: str) -> None:
    key = topic(name, type_and_hash=kit.TRIGGER)
    client_of_it = kit.client_of(system[client], key)
    server_of_it = serving(system[server], key, "answer")
    assert wait_for(lambda: client_of_it.matching_status.matching)
    assert kit.called(client_of_it) == ["answer"] and answers(system[client], key) == ["answer"]
    server_of_it.undeclare()
    client_of_it.undeclare()


def test_who_joins_late_gets_the_history_of_a_transient_local_topic(system: System) -> None:
    publisher = kit.transient_local_publisher(system["/talker"], topic("/latched"))
    publisher.put("map")
    late = Heard()
    system.flush(system["/talker"], "/listener")
    kept = kit.transient_local_subscription(system["/listener"], topic("/latched"), late)
    assert late.waits_for("map")
    publisher.undeclare()
    kept.undeclare()


def test_a_transient_local_publisher_that_comes_later_is_asked_for_what_it_has(system: System) -> None:
    heard = Heard()
    kept = kit.transient_local_subscription(system["/listener"], topic("/latched"), heard)
    publisher = kit.transient_local_publisher(system["/talker"], topic("/latched"))
    publisher.put("at once")  # before the publisher can know that anybody listens
    assert heard.waits_for("at once")
    publisher.undeclare()
    kept.undeclare()


def test_the_graph_is_asked_for_once_and_then_followed(system: System) -> None:
    present, later = token("/talker", "NN"), token("/talker", "MP", "/chatter")
    held = [system["/talker"].liveliness().declare_token(present)]
    looking = system["/listener"].liveliness()
    assert wait_for(lambda: present in kit.graph(system["/listener"], "@ros2_lv/0/**"))
    seen: set[str] = set()
    kept = looking.declare_subscriber(
        "@ros2_lv/0/**",
        lambda sample: seen.add(f"{sample.kind} {sample.key_expr}"),
        history=True,  # a token that comes before the router knows the subscriber is told, too
    )
    held.append(system["/talker"].liveliness().declare_token(later))
    assert wait_for(lambda: f"SampleKind.PUT {later}" in seen)
    held.pop().undeclare()
    assert wait_for(lambda: f"SampleKind.DELETE {later}" in seen)
    kept.undeclare()


@pytest.mark.parametrize(
    ("enclave", "kind", "name"),
    [
        ("/talker", "MP", "/chatter"),
        ("/listener", "MS", "/chatter"),
        ("/server", "SS", "/add"),
        ("/client", "SC", "/add"),
        ("/robot/planner", "SS", f"{PLAN}/send_goal"),
        ("/robot/pilot", "SC", f"{PLAN}/get_result"),
        ("/robot/pilot", "MS", f"{PLAN}/feedback"),
        ("/tools", "MP", "/fleet/a/b"),
        *((enclave, "NN", "") for enclave in SYSTEM if enclave != "/elsewhere"),
    ],
)
def test_each_node_and_endpoint_is_seen(system: System, enclave: str, kind: str, name: str) -> None:
    key = token(enclave, kind, name)
    held = system[enclave].liveliness().declare_token(key)
    looking = system["/client" if enclave != "/client" else "/server"]
    assert wait_for(lambda: key in kit.graph(looking, "@ros2_lv/0/**"))
    held.undeclare()
