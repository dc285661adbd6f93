"""Every declared endpoint can be created, every other one is refused: for every enclave, on both DDS.

The endpoints are written down here by hand, from the launch files and the manifest of the demo workspace
and the naming rules of ROS 2 (ros2/design: topic_and_service_names, actions). No code under test is asked.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

import keystore
from enclave_launch import ResolveOptions, SecurityOptions, resolve
from enclave_launch import provision as provision_launch
from keystore import Domains, EnclavePolicy, Operation, Profile, ProvisionOptions, Qualifier, Rule
from tests.dds.demo import DEMO_WS, LAUNCH_FILES
from tests.dds.our_keystore import PARAMETER_SERVICES, allow, node, provision
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

Endpoints = frozenset[tuple[str, str]]  # ("publish" or "subscribe", DDS topic)


def publisher(topic: str) -> Endpoints:
    return frozenset({("publish", f"rt{topic}")})


def subscription(topic: str) -> Endpoints:
    return frozenset({("subscribe", f"rt{topic}")})


def server(service: str) -> Endpoints:
    return frozenset({("subscribe", f"rq{service}Request"), ("publish", f"rr{service}Reply")})


def swapped(endpoints: Endpoints) -> Endpoints:
    return frozenset(("subscribe" if verb == "publish" else "publish", topic) for verb, topic in endpoints)


def client(service: str) -> Endpoints:
    return swapped(server(service))


def action_server(action: str) -> Endpoints:
    services = [server(f"{action}/_action/{name}") for name in ("send_goal", "get_result", "cancel_goal")]
    topics = [publisher(f"{action}/_action/{name}") for name in ("feedback", "status")]
    return frozenset().union(*services, *topics)


def action_client(action: str) -> Endpoints:
    return swapped(action_server(action))


def every_node(name: str) -> Endpoints:
    """The part that all distributions and client libraries share."""
    discovery = {("publish", "ros_discovery_info"), ("subscribe", "ros_discovery_info")}
    parameters = [server(f"{name}/{service}") for service in PARAMETER_SERVICES]
    return frozenset(discovery).union(publisher("/rosout"), publisher("/parameter_events"), *parameters)


SERVICES_AND_ACTIONS = {
    "/robot1/adder": every_node("/robot1/add_two_ints_server") | server("/robot1/add_two_ints"),
    "/operator": every_node("/add_two_ints_client") | client("/robot1/add_two_ints"),
    "/robot1/arm/counter": every_node("/robot1/arm/fibonacci_server") | action_server("/robot1/arm/count_up"),
    "/robot1/arm/planner": every_node("/robot1/arm/fibonacci_client") | action_client("/robot1/arm/count_up"),
}
TALKERS_AND_LISTENERS = {
    "/speaker": every_node("/front/speaker") | publisher("/conversation"),
    "/ear": every_node("/ear") | subscription("/conversation"),
    "/robot1": every_node("/robot1/talker")
    | every_node("/robot1/listener")
    | publisher("/robot1/chatter")
    | subscription("/robot1/chatter"),
    "/shared": every_node("/talker")
    | every_node("/back/listener")
    | publisher("/chatter")
    | subscription("/chatter"),
}
# Names that somebody might have meant: before the remap, without the namespace, one letter more.
NEIGHBOURS: Endpoints = frozenset().union(
    *(publisher(name) | subscription(name) for name in ("/chatters", "/front/chatter", "/back/chatter")),
    *(server(name) | client(name) for name in ("/add_two_ints", "/robot1/add_two_int")),
    *(
        action_server(name) | action_client(name)
        for name in ("/fibonacci", "/robot1/arm/fibonacci", "/count_up")
    ),
    subscription("/rosout"),
)


def check(dds: Probe, domain: int, root: Path, expected: Mapping[str, Endpoints]) -> None:
    """Try, in every enclave, all that any enclave may do, each in both directions, and all neighbours."""
    declared = frozenset().union(*expected.values())
    universe = declared | (swapped(declared) - _maybe_built_in()) | NEIGHBOURS
    answers = dds.try_endpoints(domain, [_trying(root, enclave, universe) for enclave in expected])
    wrong = [
        f"{enclave} may {'' if verdict else 'not '}{verb} {topic}"
        for enclave, allowed in expected.items()
        for verb, topic in sorted(universe)
        if (verdict := answers.may(enclave, verb, topic)) != ((verb, topic) in allowed)
    ]
    assert all(answers.participants.get(enclave) for enclave in expected), answers.log
    assert len(answers.endpoints) == len(expected) * len(universe)
    assert wrong == [], answers.log


def _maybe_built_in() -> Endpoints:
    """Depends on distribution and client library: an rclcpp node also listens to parameter events."""
    return subscription("/parameter_events")


def _trying(root: Path, enclave: str, universe: Endpoints) -> Participant:
    def topics(wanted: str) -> tuple[str, ...]:
        return tuple(sorted(topic for verb, topic in universe if verb == wanted))

    directory = root / "enclaves" / enclave.lstrip("/")
    return Participant(enclave, directory, publish=topics("publish"), subscribe=topics("subscribe"))


def test_a_policy_grants_its_names_and_no_others(dds: Probe, domain_id: int, tmp_path: Path) -> None:
    """Topics, services and actions of a hand-written policy: absolute, relative and private names."""

    def enclave(path: str, ns: str, name: str, *rules: Iterable[Rule]) -> EnclavePolicy:
        return EnclavePolicy(path, (node(ns, name, *(rule for group in rules for rule in group)),))

    policies = [
        enclave("/robot1/adder", "/robot1", "add_two_ints_server", allow(Operation.REPLY, "add_two_ints")),
        enclave("/operator", "/", "add_two_ints_client", allow(Operation.REQUEST, "/robot1/add_two_ints")),
        enclave(
            "/robot1/arm/counter", "/robot1/arm", "fibonacci_server", allow(Operation.EXECUTE, "count_up")
        ),
        enclave(
            "/robot1/arm/planner",
            "/robot1/arm",
            "fibonacci_client",
            allow(Operation.CALL, "/robot1/arm/count_up"),
        ),
    ]
    provision(tmp_path / "ks", domain_id, policies)
    check(dds, domain_id, tmp_path / "ks", SERVICES_AND_ACTIONS)


def test_denial_of_one_direction_spares_the_other(dds: Probe, domain_id: int, tmp_path: Path) -> None:
    """Cyclone DDS before 11 lets the first rule that mentions a topic decide for both directions."""
    everything = Rule(Operation.PUBLISH, Qualifier.ALLOW, "/*")
    rules = (
        everything,
        Rule(Operation.PUBLISH, Qualifier.DENY, "/cmd_vel"),
        Rule(Operation.SUBSCRIBE, Qualifier.ALLOW, "/cmd_vel"),
    )
    policy = EnclavePolicy("/guard", (Profile("/", "guard", rules),))
    provision(tmp_path / "ks", domain_id, [policy])
    directory = tmp_path / "ks" / "enclaves" / "guard"
    topics = ("rt/cmd_vel", "rt/other")
    answers = dds.try_endpoints(domain_id, [Participant("guard", directory, topics, topics)])
    assert {(verb, topic): allowed for (_, verb, topic), allowed in answers.endpoints.items()} == {
        ("publish", "rt/cmd_vel"): False,
        ("subscribe", "rt/cmd_vel"): True,
        ("publish", "rt/other"): True,
        ("subscribe", "rt/other"): False,
    }


LAUNCHES = {
    "services_actions": SERVICES_AND_ACTIONS,
    "talker_listener_remap": {name: TALKERS_AND_LISTENERS[name] for name in ("/speaker", "/ear")},
    "talker_listener_namespace": {"/robot1": TALKERS_AND_LISTENERS["/robot1"]},
    "shared_enclave": {"/shared": TALKERS_AND_LISTENERS["/shared"]},
}


@pytest.mark.parametrize("distro", ["humble", "rolling"])
def test_launch_files_become_exactly_their_permissions(
    dds: Probe, domain_id: int, tmp_path: Path, distro: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole flow, several launches into one keystore, in the domain that the processes would have."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain_id))
    security = SecurityOptions(keystore=ProvisionOptions(domains=Domains.single(domain_id), durable=False))
    for name in LAUNCHES:
        launch_file = LAUNCH_FILES / f"{name}.launch.xml"
        plan = resolve(launch_file, options=ResolveOptions(prefixes=(DEMO_WS,), distro=distro))
        provision_launch(plan, tmp_path / "ks", options=security)
    together = {enclave: names for expected in LAUNCHES.values() for enclave, names in expected.items()}
    check(dds, domain_id, tmp_path / "ks", together)


def test_compact_permissions_serve_the_parameters_of_their_node_and_of_no_other(
    dds: Probe, domain_id: int, tmp_path: Path
) -> None:
    root = tmp_path / "ks"
    keystore.create_keystore(root, keystore.CreateOptions(durable=False, compact=True))
    provision(root, domain_id, [EnclavePolicy("/cam", (node("/ns", "cam"),))])
    document = (root / "enclaves/cam/permissions.xml").read_text()
    assert "rr/ns/cam/*_parameter*Reply" in document and "get_parameters" not in document
    own = [f"/ns/cam/{service}" for service in PARAMETER_SERVICES]
    others = [f"{name}/get_parameters" for name in ("/ns/cam2", "/ns", "/cam", "/x/ns/cam")] + [
        "/ns/cam/get_type_description",
        "/ns/cam/reset",
    ]
    publish = tuple(f"rr{name}Reply" for name in (*own, *others))
    subscribe = tuple(f"rq{name}Request" for name in (*own, *others))
    cam = Participant("cam", root / "enclaves/cam", publish=publish, subscribe=subscribe)
    answers = dds.try_endpoints(domain_id, [cam])
    for name in (*own, *others):
        expected = name in own
        assert answers.may("cam", "publish", f"rr{name}Reply") is expected, name
        assert answers.may("cam", "subscribe", f"rq{name}Request") is expected, name
