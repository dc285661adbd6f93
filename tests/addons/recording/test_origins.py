"""Which parameter a name came from: candidates after one observation, decided by a second one."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.recording.record.origins import (
    FIXED,
    Name,
    NameOrigin,
    Observation,
    Source,
    candidates,
    origins_of,
)
from nodl.node_interface import EndpointKind
from nodl.ros_arguments import arguments_as_inputs

P, S = EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION


def name(text: str, kind: EndpointKind = S, type_name: str = "m/msg/A") -> Name:
    return Name(kind, text, type_name)


def seen(inputs: Mapping[str, object], *names: str | Name) -> Observation:
    return Observation(inputs, frozenset(name(each) if isinstance(each, str) else each for each in names))


def origin(text: str, *observations: Observation) -> NameOrigin:
    return origins_of(observations)[name(text)]


def test_a_name_that_no_value_explains_is_fixed() -> None:
    assert origin("scan", seen({"topic": "laser"}, "scan")) == FIXED


def test_one_candidate_is_the_source_as_far_as_one_run_tells() -> None:
    assert origin("scan", seen({"scan_topic": "scan"}, "scan")) == NameOrigin(Source("scan_topic"))


def test_another_value_that_was_followed_proves_it() -> None:
    first, second = seen({"scan_topic": "scan"}, "scan"), seen({"scan_topic": "front"}, "front")
    assert origin("scan", first, second) == NameOrigin(Source("scan_topic"), proven=True)


def test_another_value_that_was_not_followed_makes_it_fixed() -> None:
    """A frame called ``map`` beside a topic that is always called ``map``."""
    first, second = seen({"world": "map"}, "map"), seen({"world": "earth"}, "map")
    assert origin("map", first, second) == FIXED


def test_a_value_that_was_not_changed_proves_nothing() -> None:
    same = seen({"scan_topic": "scan"}, "scan")
    assert origin("scan", same, same) == NameOrigin(Source("scan_topic"))


@pytest.mark.parametrize("parameter", ["global_frame", "odom.frame_id", "scan.type"])
def test_frames_and_types_are_no_candidates(parameter: str) -> None:
    assert origin("map", seen({parameter: "map"}, "map")) == FIXED


def test_what_is_called_a_topic_goes_before_other_values() -> None:
    assert origin("scan", seen({"scan.topic": "scan", "label": "scan"}, "scan")) == NameOrigin(
        Source("scan.topic")
    )


def test_several_candidates_are_undecided_and_no_source() -> None:
    undecided = origin("odom", seen({"odom0": "odom", "other": "odom"}, "odom"))
    assert undecided.undecided and undecided.source is None
    assert undecided.candidates == (Source("odom0"), Source("other"))


def test_a_second_run_decides_between_several() -> None:
    first = seen({"odom0": "odom", "other": "odom"}, "odom")
    second = seen({"odom0": "wheels", "other": "odom"}, "wheels")
    assert origin("odom", first, second) == NameOrigin(Source("odom0"), proven=True)


def test_one_start_gives_a_word_another_a_parameter_and_both_are_sources() -> None:
    """topic_tools: relay in out, or input_topic."""
    word, parameter = seen({"<1>": "scan"}, "scan"), seen({"input_topic": "scan"}, "scan")
    assert origin("scan", word, parameter) == NameOrigin(candidates=(Source("<1>"), Source("input_topic")))
    copied = word._replace(defaults={"input_topic": "scan"})
    assert origin("scan", copied, parameter) == NameOrigin(candidates=(Source("<1>"), Source("input_topic")))
    other = seen({"input_topic": "front"}, "scan")
    assert origin("scan", word, other) == FIXED, "it did not follow the parameter"


def test_a_value_in_the_middle_of_a_word_is_a_coincidence() -> None:
    assert origin("front/scan2", seen({"b": "scan", "c": "can2", "d": "fro"}, "front/scan2")) == FIXED


@pytest.mark.parametrize(
    ("prefix", "suffix"), [("/fleet/", "/orders"), ("front/", ""), ("", "_0"), ("part_", "_0"), ("/", "")]
)
def test_a_name_that_holds_a_value_as_a_word_is_decided_by_another_run(prefix: str, suffix: str) -> None:
    source = Source("fleet", suffix=suffix, prefix=prefix)
    first = seen({"fleet": "alpha"}, f"{prefix}alpha{suffix}")
    assert origin(f"{prefix}alpha{suffix}", first) == NameOrigin(candidates=(source,))
    followed = seen({"fleet": "beta"}, f"{prefix}beta{suffix}")
    assert origin(f"{prefix}alpha{suffix}", first, followed) == NameOrigin(source, proven=True)
    stayed = seen({"fleet": "beta"}, f"{prefix}alpha{suffix}")
    assert origin(f"{prefix}alpha{suffix}", first, stayed) == FIXED


def test_an_integer_within_a_name_is_decided_by_another_run_and_a_truth_value_is_none() -> None:
    source = Source("robot_id", prefix="robot_", suffix="/status")
    first = seen({"robot_id": 1, "use_odom": True}, "robot_1/status")
    assert origin("robot_1/status", first) == NameOrigin(candidates=(source,))
    followed = seen({"robot_id": 7}, "robot_7/status")
    assert origin("robot_1/status", first, followed) == NameOrigin(source, proven=True)
    assert origin("robot_1/status", first, seen({"robot_id": 7}, "robot_1/status")) == FIXED
    assert origin("robot1", seen({"robot_id": 1}, "robot1")) == FIXED, "not a word of the name"


TWO = {"fleet": "alpha", "robot_id": 1}
FLEET = Source("fleet", prefix="/fleet/", suffix="/robot_1/status")
BOTH = Source("fleet", prefix="/fleet/", suffix="/robot_$(param robot_id)/status")


def test_two_parameters_in_one_name_are_decided_by_runs_that_change_them() -> None:
    robot = Source("robot_id", prefix="/fleet/alpha/robot_", suffix="/status")
    name_, first = "/fleet/alpha/robot_1/status", seen(TWO, "/fleet/alpha/robot_1/status")
    assert origin(name_, first).candidates == (FLEET, BOTH, robot)
    one_changed = seen({"fleet": "beta", "robot_id": 1}, "/fleet/beta/robot_1/status")
    assert origin(name_, first, one_changed) == NameOrigin(FLEET, proven=True, candidates=(BOTH,))
    both_changed = seen({"fleet": "beta", "robot_id": 7}, "/fleet/beta/robot_7/status")
    assert origin(name_, first, both_changed) == NameOrigin(BOTH, proven=True)
    only_one_followed = seen({"fleet": "beta", "robot_id": 7}, "/fleet/beta/robot_1/status")
    assert origin(name_, first, only_one_followed) == NameOrigin(FLEET, proven=True)


def test_the_defaults_of_all_parameters_in_a_name_are_kept() -> None:
    left = declared(TWO, "/fleet/alpha/robot_1/status")
    given_ = seen({"fleet": "beta", "robot_id": 7}, "/fleet/beta/robot_7/status")
    expected = BOTH._replace(suffix="/robot_$(param robot_id 1)/status")
    found = origin("/fleet/alpha/robot_1/status", left, given_)
    assert found == NameOrigin(expected, proven=True, default="alpha")


@pytest.mark.parametrize("before", ["", "/", "~/"])
def test_a_name_below_a_value_is_decided_by_another_run(before: str) -> None:
    """A camera's name before ``image_raw``: by chance more often than not, and yet what some programs do."""
    source = Source("camera", suffix="/image_raw", prefix=before)
    first = seen({"camera": "cam"}, f"{before}cam/image_raw")
    assert origin(f"{before}cam/image_raw", first) == NameOrigin(candidates=(source,))
    followed = seen({"camera": "rgb"}, f"{before}rgb/image_raw")
    assert origin(f"{before}cam/image_raw", first, followed) == NameOrigin(source, proven=True)
    stayed = seen({"camera": "rgb"}, f"{before}cam/image_raw")
    assert origin(f"{before}cam/image_raw", first, stayed) == FIXED


def test_names_below_every_entry_of_a_list_may_be_absolute() -> None:
    run = seen({"robots": ("r1", "r2")}, "/r1/order", "/r2/order")
    assert origin("/r1/order", run) == NameOrigin(Source("robots", True, "/order", "/"))


def test_values_are_names_verbatim() -> None:
    assert origin("~/p", seen({"a": "~/p"}, "~/p")) == NameOrigin(Source("a"))
    assert origin("/p", seen({"a": "p"}, "/p")).source is None


def test_each_entry_of_a_list() -> None:
    origins = origins_of([seen({"sources": ("a", "b")}, "a", "b")])
    assert set(origins.values()) == {NameOrigin(Source("sources", each=True))}


def test_types_keep_two_names_of_one_value_apart() -> None:
    twist, lock = name("joy", type_name="m/msg/Twist"), name("joy", type_name="m/msg/Bool")
    first = seen({"topics.a.topic": "joy", "locks.a.topic": "joy"}, twist, lock)
    second = seen(
        {"topics.a.topic": "one", "locks.a.topic": "two"},
        twist._replace(name="one"),
        lock._replace(name="two"),
    )
    origins = origins_of([first, second])
    assert origins[twist] == NameOrigin(Source("topics.a.topic"), proven=True)
    assert origins[lock] == NameOrigin(Source("locks.a.topic"), proven=True)


def test_keys_that_are_data_become_a_star_where_two_were_seen() -> None:
    two = seen({"topics.joy.topic": "a", "topics.nav.topic": "b"}, "a", "b")
    assert origins_of([two])[name("a")] == NameOrigin(Source("topics.*.topic"))
    one = seen({"topics.joy.topic": "a"}, "a")
    assert origins_of([one])[name("a")] == NameOrigin(Source("topics.joy.topic"))


def test_the_name_where_nothing_is_set_is_the_default() -> None:
    set_, unset = seen({"scan_topic": "front"}, "front", "odom"), seen({}, "scan", "odom")
    origins = origins_of([set_, unset])
    assert origins[name("front")] == NameOrigin(Source("scan_topic"), proven=True, default="scan")
    assert name("scan") not in origins
    assert origins[name("odom")] == FIXED


def test_words_of_a_command_line_count_by_their_place() -> None:
    assert candidates("out", arguments_as_inputs(["in", "out"])) == (Source("<2>"),)
    words = ["--rate", "5", "in", "-v", "--to=out"]
    assert arguments_as_inputs(words) == {"--rate": "5", "-v": "", "--to": "out"}
    assert arguments_as_inputs([]) == {}
    assert arguments_as_inputs(["in", "--rate", "5", "out"]) == {"<1>": "in", "--rate": "5"}


def test_a_name_from_another_parameter_in_each_run_is_undecided_though_one_of_them_is_followed() -> None:
    runs = [
        seen({"p": "front"}, "front"),
        seen({"p": "front", "q_topic": "rear"}, "front", "rear"),
        seen({"p": "rear"}, "rear"),
    ]
    assert origins_of(runs)[name("rear")] == NameOrigin(candidates=(Source("q_topic"), Source("p")))
    assert origins_of(runs[::2])[name("rear")] == NameOrigin(Source("p"), proven=True), (
        "without the second run"
    )


texts = st.sampled_from(["a", "b", "c", "d"])
inputs = st.dictionaries(st.sampled_from(["p", "q_topic", "r.s.topic"]), texts, max_size=3)
observations = st.lists(
    st.builds(
        lambda given_inputs, names: Observation(given_inputs, frozenset(name(each) for each in names)),
        inputs,
        st.frozensets(texts, max_size=3),
    ),
    min_size=1,
    max_size=4,
)


@given(observations)
def test_every_name_that_was_seen_is_granted_for_what_it_was_seen_with(seen_all: list[Observation]) -> None:
    """A manifest made of the origins allows each recorded name under the recorded inputs."""
    from nodl.name_template import ParameterPart

    origins = origins_of(seen_all)
    for observation in seen_all:
        granted = set()
        for each, found in origins.items():
            if found.source is None:
                granted.add(each.name)
            else:
                item = "each" if found.source.each else None
                part = ParameterPart(found.source.parameter, found.default, item)
                granted.update(part.texts(observation.inputs))
        assert {each.name for each in observation.names} <= granted


MANAGED = ("map_server/get_state", "amcl/get_state")


def test_names_below_every_entry_of_a_list_follow_the_list() -> None:
    """nav2's lifecycle_manager has a client below the name of each node in ``node_names``."""
    run = seen({"node_names": ("map_server", "amcl")}, *MANAGED, "bond")
    assert origin("amcl/get_state", run) == NameOrigin(Source("node_names", each=True, suffix="/get_state"))
    assert origin("bond", run) == FIXED


def test_a_name_below_one_entry_only_is_a_coincidence() -> None:
    assert origin("scan/front", seen({"sources": ("scan", "points")}, "scan/front")) == FIXED


def test_a_list_of_one_entry_leaves_open_what_a_second_run_decides() -> None:
    source = Source("node_names", each=True, suffix="/get_state")
    one = seen({"node_names": ("amcl",)}, "amcl/get_state")
    assert origin("amcl/get_state", one) == NameOrigin(candidates=(source,))
    other = seen({"node_names": ("planner",)}, "planner/get_state")
    assert origin("amcl/get_state", one, other) == NameOrigin(source, proven=True)
    fixed = seen({"node_names": ("planner",)}, "amcl/get_state")
    assert origin("amcl/get_state", one, fixed) == FIXED


def declared(defaults: Mapping[str, object], *names: str, **given_too: object) -> Observation:
    return seen(given_too, *names)._replace(defaults=defaults)


def test_a_parameter_that_the_program_declares_and_nobody_sets_is_a_source_with_its_default() -> None:
    run = declared({"map_topic": "map", "frame_id": "map"}, "map")
    assert origin("map", run) == NameOrigin(Source("map_topic"), default="map")


def test_a_declared_value_that_is_another_one_explains_nothing() -> None:
    assert origin("map", declared({"map_topic": "floor"}, "map")) == FIXED


def test_a_run_that_sets_what_another_one_left_proves_it_and_keeps_the_default() -> None:
    left, given_ = declared({"map_topic": "map"}, "map"), seen({"map_topic": "floor"}, "floor")
    expected = NameOrigin(Source("map_topic"), proven=True, default="map")
    assert origin("map", left, given_) == expected == origin("floor", left, given_)


def test_what_the_program_declares_from_its_command_line_comes_from_there() -> None:
    assert origin("scan", declared({"input_topic": "scan"}, "scan", **{"<1>": "scan"})) == NameOrigin(
        Source("<1>")
    )


def test_declared_and_given_parameters_of_one_value_are_undecided() -> None:
    run = declared({"goal_topic": "goal"}, "goal", start_topic="goal")
    assert origin("goal", run) == NameOrigin(candidates=(Source("goal_topic"), Source("start_topic")))


def test_parameters_with_defaults_are_not_made_a_pattern() -> None:
    """The program knows them by name: without the defaults a launch that sets none of them would have no names."""
    run = declared({"front.topic": "a", "rear.topic": "b"}, "a", "b")
    assert origin("a", run) == NameOrigin(Source("front.topic"), default="a")
