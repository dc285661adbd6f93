"""From running nodes to the smallest policy: final names, built-in interfaces, union, what is not known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta, timezone
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from enclave_common.source_location import SourceLocation
from enclave_launch.policy import DerivedPolicy, PolicyOptions, RunningNode, derive_policy
from keystore import Domains, Validity
from keystore.formats.permissions import permissions_document
from keystore.formats.policy_xml import parse_policy, policy_xml
from nodl.builtin_interfaces import DISTROS, TABLE, built_in_interfaces
from nodl.name_template import NameTemplate, ParameterPart, UnknownPart
from nodl.names import MAX_NAME_LENGTH
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, EndpointKind, Gap

NodeMaker = Callable[..., RunningNode]
START = datetime(2026, 1, 1, tzinfo=timezone.utc)
VALIDITY = Validity(START, START + timedelta(days=1))


def derive(*nodes: RunningNode, distro: str = "jazzy", options: PolicyOptions | None = None) -> DerivedPolicy:
    return derive_policy(nodes, distro=distro, options=options)


def declared(derived: DerivedPolicy, enclave: str = "/") -> set[str]:
    """``publish /chatter`` and so on: all that some manifest or policy file asks for."""
    return {
        f"{rule.operation.value} {rule.expression}"
        for rule, reasons in derived.reasons[enclave].items()
        if any(reason.origin != "built-in" for reason in reasons)
    }


def everything(derived: DerivedPolicy, enclave: str = "/") -> set[str]:
    return {f"{rule.operation.value} {rule.expression}" for rule in derived.reasons[enclave]}


def test_every_kind_of_interface(node: NodeMaker) -> None:
    found = derive(node("pub a", "sub b", "serve c", "call d", "action e", "goal f"))
    assert declared(found) == {
        "publish /a",
        "subscribe /b",
        "reply /c",
        "request /d",
        "execute /e",
        "call /f",
    }


NAMES = [
    # written, final name with node name mouth in /tester
    ("chatter", "/tester/chatter"),
    ("/chatter", "/chatter"),
    ("~/chatter", "/tester/mouth/chatter"),
    ("{node}/chatter", "/tester/mouth/chatter"),
    ("sensors/front", "/tester/sensors/front"),
]


@pytest.mark.parametrize(("written", "final"), NAMES)
def test_names_follow_the_final_node_name_and_namespace(node: NodeMaker, written: str, final: str) -> None:
    found = derive(node(f"pub {written}", name="mouth", namespace="/tester"))
    assert declared(found) == {f"publish {final}"}


def test_remap_rules_apply_after_expansion(node: NodeMaker) -> None:
    found = derive(
        node(
            *("pub chatter", "sub /tf", "serve ~/reset", "call chatter"),
            name="mouth",
            namespace="/tester",
            remap=("chatter:=blather", "/tf:=tf", "rosservice://chatter:=ask", "~/reset:=/reset"),
        )
    )
    assert declared(found) == {
        *("publish /tester/blather", "subscribe /tester/tf"),
        *("reply /reset", "request /tester/blather"),  # the first matching rule wins, also for services
    }


def test_built_in_interfaces_are_remapped_too(node: NodeMaker) -> None:
    found = derive(node(remap=("/rosout:=/logs", "~/get_parameters:=ask")))
    assert {"publish /logs", "reply /ask"} <= everything(found)
    assert not {"publish /rosout", "reply /talker/get_parameters"} & everything(found)


@pytest.mark.parametrize(
    ("rule", "moved", "stays"),
    [
        ("rostopic://a:=b", {"publish /b", "subscribe /b"}, {"reply /a", "request /a"}),
        ("rosservice://a:=b", {"reply /b", "request /b"}, {"publish /a", "subscribe /a"}),
        ("a:=b", {"publish /b", "subscribe /b", "reply /b", "request /b"}, set()),
    ],
)
def test_a_rule_of_one_kind_moves_names_of_that_kind(
    rule: str, moved: set[str], stays: set[str], node: NodeMaker
) -> None:
    assert declared(derive(node("pub a", "sub a", "serve a", "call a", remap=(rule,)))) == moved | stays


def test_built_in_topics_and_services_obey_rules_of_their_kind(node: NodeMaker) -> None:
    rules = ("rosservice:///rosout:=/logs", "rostopic://~/get_parameters:=ask")
    assert everything(derive(node(remap=rules))) == everything(derive(node()))


def test_rules_of_a_component_come_before_those_of_its_process(node: NodeMaker) -> None:
    found = derive(node("pub a", "pub b", local=("a:=own",), remap=("a:=global", "b:=global")))
    assert declared(found) == {"publish /own", "publish /global"}


def test_actions_in_humble_are_remapped_part_by_part(node: NodeMaker) -> None:
    rules = ("fib:=whole", "fib/_action/feedback:=news")
    server = derive(node("action fib", remap=rules), distro="humble")
    assert declared(server) == {
        *("reply /fib/_action/send_goal", "reply /fib/_action/cancel_goal", "reply /fib/_action/get_result"),
        *("publish /news", "publish /fib/_action/status"),
    }
    client = derive(node("goal fib", remap=rules), distro="humble")
    assert {"request /fib/_action/send_goal", "subscribe /news"} <= declared(client)
    (warning,) = client.warnings
    assert str(warning).startswith("demo.launch.xml:7: remap rule fib:=whole has no effect on action /fib")


def test_five_rules_that_move_an_action_as_one_give_one_permission(node: NodeMaker) -> None:
    parts = ("send_goal", "cancel_goal", "get_result", "feedback", "status")
    rules = tuple(f"fib/_action/{part}:=count/_action/{part}" for part in parts)
    found = derive(node("action fib", namespace="/arm", remap=rules))
    assert declared(found) == {"execute /arm/count"}
    (reasons,) = (why for rule, why in found.reasons["/"].items() if rule.expression == "/arm/count")
    assert {rule.text for rule in reasons[0].rules} == set(rules)
    apart = derive(node("action fib", remap=rules[:4]))
    assert "publish /fib/_action/status" in declared(apart) and "execute /count" not in declared(apart)


@pytest.mark.parametrize("distro", ["jazzy", "kilted", "lyrical", "rolling"])
def test_actions_of_newer_releases_are_remapped_as_a_whole(node: NodeMaker, distro: str) -> None:
    found = derive(node("action fib", remap=("fib:=whole",)), distro=distro)
    assert declared(found) == {"execute /whole"}
    assert found.warnings == ()


@pytest.mark.parametrize(("rcl", "name"), [((9, 2, 8), "/fib"), ((9, 2, 9), "/whole")])
def test_jazzys_rcl_remaps_whole_actions_since_9_2_9(
    node: NodeMaker, rcl: tuple[int, ...], name: str
) -> None:
    found = derive_policy([node("action fib", remap=("fib:=whole",))], distro="jazzy", rcl=rcl)
    assert declared(found) == {f"execute {name}"}


# -- built-in interfaces ---------------------------------------------------------------------------

SIX = (
    *("describe_parameters", "get_parameter_types", "get_parameters"),
    *("list_parameters", "set_parameters", "set_parameters_atomically"),
)
PLAIN = {"publish /rosout", "publish /parameter_events", *(f"reply /talker/{name}" for name in SIX)}
TYPE_DESCRIPTION = {"reply /talker/get_type_description"}
LIFECYCLE = {
    "publish /talker/transition_event",
    *(
        f"reply /talker/{name}"
        for name in (
            *("change_state", "get_state", "get_available_states"),
            *("get_available_transitions", "get_transition_graph"),
        )
    ),
}
CONTAINER = {f"reply /talker/_container/{name}" for name in ("load_node", "unload_node", "list_nodes")}
PY, CPP, ANY = ClientLibrary.RCLPY, ClientLibrary.RCLCPP, ClientLibrary.UNKNOWN
EVENTS = {"subscribe /parameter_events"}

BUILT_IN: dict[str, tuple[dict[str, Any], str, set[str]]] = {
    "rclpy, humble": ({"library": PY}, "humble", PLAIN),
    "rclpy, iron": ({"library": PY}, "iron", PLAIN | TYPE_DESCRIPTION),
    "rclcpp, humble": ({"library": CPP}, "humble", PLAIN | EVENTS),
    "rclcpp, rolling": ({"library": CPP}, "rolling", PLAIN | EVENTS | TYPE_DESCRIPTION),
    "unknown library: the union": ({"library": ANY}, "jazzy", PLAIN | EVENTS | TYPE_DESCRIPTION),
    "simulated time": (
        {"parameters": {"use_sim_time": True}},
        "humble",
        PLAIN | {"subscribe /clock"},
    ),
    "real time": ({"parameters": {"use_sim_time": False}}, "humble", PLAIN),
    "type description switched off": (
        {"parameters": {"start_type_description_service": False}},
        "jazzy",
        PLAIN,
    ),
    "lifecycle by launch": ({"role": "lifecycle_node"}, "humble", PLAIN | LIFECYCLE),
    "lifecycle by manifest": ({"lifecycle": True}, "humble", PLAIN | LIFECYCLE),
    "container": ({"role": "container", "library": CPP}, "humble", PLAIN | EVENTS | CONTAINER),
    "component": ({"role": "component", "library": CPP}, "humble", PLAIN | EVENTS),
}


@pytest.mark.parametrize("case", BUILT_IN)
def test_what_every_node_has(node: NodeMaker, case: str) -> None:
    changes, distro, expected = BUILT_IN[case]
    assert everything(derive(node(**changes), distro=distro)) == expected


def test_tf_where_declared(node: NodeMaker) -> None:
    assert "subscribe /tf_static" in everything(derive(node("sub /tf")))
    assert "subscribe /tf_static" not in everything(derive(node("pub /tf")))


def test_every_row_of_the_table_has_its_source() -> None:
    assert all(row.source and row.type.count("/") == 2 and row.since in DISTROS for row in TABLE)


def test_an_unknown_distribution_is_an_error() -> None:
    with pytest.raises(ValueError, match="unknown ROS distribution 'dashing'"):
        built_in_interfaces("dashing", PY)


def test_interfaces_that_a_manifest_repeats_are_not_doubled(node: NodeMaker) -> None:
    found = derive(node("pub /rosout", "pub /rosout", "serve ~/get_parameters"))
    (profile,) = found.policy.enclaves[0].profiles
    assert len(profile.rules) == len(set(profile.rules)) == len(PLAIN | TYPE_DESCRIPTION)
    assert ("publish", "/rosout") not in found.built_in_names("/")  # a manifest asks for it as well
    assert ("publish", "/parameter_events") in found.built_in_names("/")


# -- what is not known, and what must not be ---------------------------------------------------------


INTROSPECTED = {
    "serve": {"publish /a/_service_event": "p/srv/T_Event"},
    "call": {"publish /a/_service_event": "p/srv/T_Event"},
    "action": {
        "publish /a/_action/send_goal/_service_event": "p/action/T_SendGoal_Event",
        "publish /a/_action/cancel_goal/_service_event": "action_msgs/srv/CancelGoal_Event",
        "publish /a/_action/get_result/_service_event": "p/action/T_GetResult_Event",
    },
}


@pytest.mark.parametrize("kind", INTROSPECTED)
def test_what_is_introspected_publishes_its_calls(kind: str, node: NodeMaker) -> None:
    (found,) = node(f"{kind} a").interface.endpoints
    found = found._replace(type=f"p/{'action' if kind == 'action' else 'srv'}/T")
    silent, told = (derive(node(found._replace(introspected=each))) for each in (False, True))
    assert declared(told) - declared(silent) == set(INTROSPECTED[kind])
    for rule, (reason, *_) in told.reasons["/"].items():
        if rule.expression.endswith("/_service_event"):
            assert reason.note == "the service's calls are published (introspection)"
            assert reason.type == INTROSPECTED[kind][f"publish {rule.expression}"]


def test_a_name_as_long_as_dds_takes_is_granted_and_a_longer_one_is_not(node: NodeMaker) -> None:
    room = MAX_NAME_LENGTH - len("//set_parameters_atomically")
    fits, too_long = derive(node(name="n" * room)), derive(node(name="n" * (room + 1)))
    assert fits.problems == () and any("set_parameters_atomically" in name for name in everything(fits))
    assert len(too_long.problems) == 1


def endpoint(*parts: str | ParameterPart | UnknownPart, certainty: Certainty = Certainty.EXACT) -> Endpoint:
    return Endpoint(
        EndpointKind.PUBLISHER, NameTemplate(parts), "x/msg/Y", SourceLocation("talker.py", 12), certainty
    )


def test_names_from_parameters_follow_what_launch_sets(node: NodeMaker) -> None:
    topic = endpoint("cam/", ParameterPart("topic", "image"))
    given_value = derive(node(topic, parameters={"topic": "raw"}))
    assert declared(given_value) == {"publish /cam/raw"}
    assert declared(derive(node(topic))) == {"publish /cam/image"}
    (reasons,) = (r for rule, r in given_value.reasons["/"].items() if rule.expression == "/cam/raw")
    assert (reasons[0].written, reasons[0].note) == ("cam/param:topic", "parameter topic, set by launch")


def test_what_is_known_of_quality_follows_the_names_but_not_against_parameters_that_may_override_it(
    node: NodeMaker,
) -> None:
    known = (("depth", 5), ("reliability", "RELIABLE"))

    def quality(**parameters: object) -> dict[str, str | int]:
        topic = endpoint("chatter")._replace(qos=known)
        derived = derive(node(topic, remap=("chatter:=blather",), parameters=parameters))
        (reasons,) = (r for rule, r in derived.reasons["/"].items() if rule.expression == "/blather")
        return dict(reasons[0].qos)

    assert quality() == dict(known)
    assert quality(**{"qos_overrides./blather.publisher.reliability": "best_effort"}) == {"depth": 5}
    assert quality(**{"qos_overrides./blather.publisher_main.depth": 9}) == {"reliability": "RELIABLE"}
    assert quality(**{"qos_overrides./chatter.publisher.depth": 9}) == dict(known), "the name before the rule"
    assert quality(**{"qos_overrides./blather.subscription.depth": 9}) == dict(known), "of the other end"


@pytest.mark.parametrize(
    ("certainty", "note"),
    [(Certainty.EXACT, ""), (Certainty.FROM_DEFAULT, "from a default value in the source")],
)
def test_a_reason_says_where_a_name_comes_from(certainty: Certainty, note: str, node: NodeMaker) -> None:
    plain = endpoint("chatter", certainty=certainty)
    said = plain._replace(note="as its file says")
    for one, expected in ((plain, note), (said, "as its file says")):
        (reasons,) = (
            r for rule, r in derive(node(one)).reasons["/"].items() if rule.expression == "/chatter"
        )
        assert reasons[0].note == expected


def test_names_from_a_list_parameter_are_one_for_each_element(node: NodeMaker) -> None:
    each = node(endpoint("cam/", ParameterPart("cameras", item="each")), parameters={"cameras": ("l", "r")})
    assert declared(derive(each)) == {"publish /cam/l", "publish /cam/r"}
    assert declared(derive(each._replace(parameters={"cameras": ()}))) == set()
    assert len(derive(each._replace(parameters={})).problems) == 1


def test_a_name_that_is_not_known_is_a_problem_with_its_place_and_remedy(node: NodeMaker) -> None:
    found = derive(node(endpoint(UnknownPart("read from a file"))))
    assert declared(found) == set()
    (problem,) = found.problems
    assert str(problem).startswith(
        "talker.py:12: node /talker: the name of what it would publish is not known"
    )
    assert "read from a file" in problem.text and "--nodl" in problem.remedy and "--policy" in problem.remedy


def test_a_parameter_without_value_is_a_problem(node: NodeMaker) -> None:
    (problem,) = derive(node(endpoint(ParameterPart("topic")))).problems
    assert "parameter 'topic' has no value" in problem.text


def test_partly_known_names_are_problems_unless_accepted_as_patterns(node: NodeMaker) -> None:
    partly = node(endpoint("~/cam_", UnknownPart("loop variable"), "/image"), namespace="/ns")
    assert len(derive(partly).problems) == 1
    accepted = derive(partly, options=PolicyOptions(accept_patterns=True))
    assert declared(accepted) == {"publish /ns/talker/cam_*/image"}
    assert accepted.problems == ()
    assert "may publish /ns/talker/cam_*/image: a pattern, because loop variable" in accepted.warnings[0].text


def test_a_wholly_unknown_name_is_never_accepted(node: NodeMaker) -> None:
    found = derive(node(endpoint(UnknownPart())), options=PolicyOptions(accept_patterns=True))
    assert len(found.problems) == 1 and declared(found) == set()


@pytest.mark.parametrize("name", ["/*", "a?", "[ab]", "a b", "a//b", "1a", "", "a\n", "x" * 250])
def test_bad_names_are_problems_and_grant_nothing(node: NodeMaker, name: str) -> None:
    found = derive(node(f"pub {name}"))
    assert declared(found) == set()
    assert len(found.problems) == 1 and str(found.problems[0]).startswith("demo.nodl.xml:1: node /talker: ")


def test_double_underscores_are_warned_of(node: NodeMaker) -> None:
    found = derive(node("pub a__b"))
    assert declared(found) == {"publish /a__b"}
    assert "'a__b' contains '__'" in found.warnings[0].text


def test_a_wildcard_in_a_parameter_value_is_no_way_around(node: NodeMaker) -> None:
    found = derive(node(endpoint(ParameterPart("topic")), parameters={"topic": "/*"}))
    assert declared(found) == set() and len(found.problems) == 1


def test_gaps_of_inference_are_problems(node: NodeMaker) -> None:
    gap = Gap(SourceLocation("talker.py", 30), "eval() cannot be followed")
    (problem,) = derive(node(gaps=(gap,))).problems
    assert str(problem).startswith(
        "talker.py:30: node /talker: eval() cannot be followed; let it run once with --learn"
    )


def test_a_name_that_leaves_no_room_for_its_services_is_a_problem(node: NodeMaker) -> None:
    """rcl creates ``~/set_parameters_atomically`` for every node, and refuses names over 247 characters."""
    derived = derive(node(name="n" * 60, namespace="/" + "a" * 170))
    (problem,) = derived.problems
    assert str(problem).startswith("demo.launch.xml:5: <node> node /aaa")
    assert str(problem).endswith(
        "is longer than 247 characters; it could not start: give it another name or namespace"
    )
    assert not derive(node(name="n" * 40, namespace="/" + "a" * 170)).problems


@pytest.mark.parametrize(
    ("name", "namespace"), [("a b", "/"), ("n", "/a/"), ("<node_name_unspecified>", "/")]
)
def test_a_node_with_an_impossible_name_gets_nothing(node: NodeMaker, name: str, namespace: str) -> None:
    found = derive(node("pub a", name=name, namespace=namespace))
    assert found.reasons["/"] == {} and len(found.problems) == 1


# -- union, order, and taking nodes away --------------------------------------------------------------


def permissions(derived: DerivedPolicy) -> dict[str, bytes]:
    return {
        enclave.path: permissions_document("CN=x", enclave, validity=VALIDITY, domains=Domains.single(0))
        for enclave in derived.policy.enclaves
    }


def topics_of(document: bytes) -> set[str]:
    return {line for line in document.decode().splitlines() if line.startswith("<topic>")}


def test_two_nodes_sharing_an_enclave_get_the_union(node: NodeMaker) -> None:
    talker, listener = node("pub chatter"), node("sub chatter", name="listener")
    both = derive(talker, listener)
    assert declared(both) == {"publish /chatter", "subscribe /chatter"}
    assert [profile.node for profile in both.policy.enclaves[0].profiles] == ["listener", "talker"]
    (document,) = permissions(both).values()
    assert topics_of(document) == topics_of(permissions(derive(talker))["/"]) | topics_of(
        permissions(derive(listener))["/"]
    )


def test_enclaves_without_a_known_node_exist_and_allow_nothing() -> None:
    found = derive_policy((), distro="jazzy", also=["/tool"])
    assert [(enclave.path, enclave.profiles) for enclave in found.policy.enclaves] == [("/tool", ())]
    assert topics_of(permissions(found)["/tool"]) == {"<topic>ros_discovery_info</topic>"}


words = st.sampled_from(["a", "b", "/a", "~/a", "c/d"])
kinds = st.sampled_from(["pub", "sub", "serve", "call", "action", "goal"])
interfaces = st.lists(st.builds(lambda k, n: f"{k} {n}", kinds, words), max_size=4)
specs = st.lists(
    st.tuples(interfaces, st.sampled_from(["n1", "n2", "n3"]), st.sampled_from(["/", "/e"])), max_size=4
)
FIXTURE_IS_PURE = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def build(make: NodeMaker, found: Iterable[tuple[list[str], str, str]]) -> list[RunningNode]:
    return [make(*endpoints, name=name, enclave=enclave) for endpoints, name, enclave in found]


@FIXTURE_IS_PURE
@given(specs)
def test_law_the_policy_of_many_is_the_union_of_each(
    node: NodeMaker, found: list[tuple[list[str], str, str]]
) -> None:
    nodes = build(node, found)
    together = derive(*nodes)
    for enclave in {each.enclave for each in nodes}:
        alone = [everything(derive(each), enclave) for each in nodes if each.enclave == enclave]
        assert everything(together, enclave) == set().union(*alone)


@FIXTURE_IS_PURE
@given(specs.filter(bool))
def test_law_taking_a_node_away_takes_exactly_what_only_it_needed(
    node: NodeMaker, found: list[tuple[list[str], str, str]]
) -> None:
    nodes = build(node, found)
    gone, rest = nodes[0], nodes[1:]
    before, after = permissions(derive(*nodes)), permissions(derive(*rest))
    remaining = after.get(gone.enclave)
    lost = topics_of(before[gone.enclave]) - (topics_of(remaining) if remaining else set())
    needed_by_others = set().union(
        *(topics_of(permissions(derive(each))[each.enclave]) for each in rest if each.enclave == gone.enclave)
    )
    assert lost == topics_of(permissions(derive(gone))[gone.enclave]) - needed_by_others
    assert {path: text for path, text in before.items() if path != gone.enclave} == {
        path: text for path, text in after.items() if path != gone.enclave
    }


@FIXTURE_IS_PURE
@given(specs)
def test_law_the_order_of_nodes_does_not_matter_and_every_rule_has_a_reason(
    node: NodeMaker, found: list[tuple[list[str], str, str]]
) -> None:
    nodes = build(node, found)
    derived = derive(*nodes)
    reverse = derive(*reversed(nodes))
    assert derived.policy == reverse.policy and derived.reasons == reverse.reasons
    for enclave in derived.policy.enclaves:
        rules = {rule for profile in enclave.profiles for rule in profile.rules}
        assert rules == set(derived.reasons[enclave.path])
        assert all(derived.reasons[enclave.path].values())
    if derived.policy.enclaves:
        assert parse_policy(policy_xml(derived.policy)).policy == derived.policy


def test_an_enclave_too_large_for_fast_dds_is_told_at_once(node: NodeMaker) -> None:
    many = [node(*(f"action task{i}_{j}" for j in range(10)), name=f"n{i}") for i in range(12)]
    (warning,) = derive(*many, distro="rolling").warnings
    assert "the permissions of enclave / take" in warning.text and "Give some of its 12 nodes" in warning.text
    assert derive(*many[:3], distro="rolling").warnings == ()


def test_renaming_a_node_renames_its_private_names_only(node: NodeMaker) -> None:
    one = node("pub ~/state", "pub state")
    two = one._replace(name="other")
    assert declared(derive(one)) == {"publish /talker/state", "publish /state"}
    assert declared(derive(two)) == {"publish /other/state", "publish /state"}
