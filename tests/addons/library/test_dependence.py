"""What of a document follows parameters, arguments and plugins: each name that is there beside one that is not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.library import Library, LibraryDocuments
from enclave_addons.library.apply import applied
from enclave_addons.library.document import read_library_document
from enclave_addons.library.scope import Scope
from nodl.dependence import Dependence, PluginList, Situation
from nodl.errors import InvalidNoDLError
from nodl.node_interface import EndpointKind, NodeInterface

WriteDocument = Callable[..., Path]


class Documents:
    """Only the user's folder."""

    def __init__(self, folder: Path):
        self._library = Library([folder], None)

    def of_class(self, plugin_class: str, instance: str = "") -> NodeInterface | None:
        hit = self._library.of_class(plugin_class)
        return hit.document.interface if hit else None

    def named(self, name: str) -> NodeInterface | None:
        hit = self._library.named(name)
        return hit.document.interface if hit else None

    def transports(self) -> tuple[tuple[str, str, NodeInterface], ...]:
        return self._library.transports()


def in_situation(path: Path, distro: str = "jazzy", words: str = "", **parameters: Any) -> NodeInterface:
    """The node of a document as it is with these parameters; ``__`` stands for the dot."""
    given = {name.replace("__", "."): value for name, value in parameters.items()}
    situation = Situation(distro, "n", "/", given, tuple(words.split()), frozenset({"p", "zip_transport"}))
    return applied(
        read_library_document(str(path.parents[1]), f"{path.parent.name}/{path.name}").interface,
        situation,
        Documents(path.parents[1]),
    ).interface


def names(node: NodeInterface) -> list[str]:
    return sorted(str(endpoint.name) for endpoint in node.endpoints)


def why(node: NodeInterface) -> str:
    return " ".join(gap.why for gap in node.gaps)


def test_a_name_follows_its_parameter_and_is_the_listed_one_without(write_document: WriteDocument) -> None:
    path = write_document(
        "p/n", "names: {subscriptions: {scan: {name: $(param scan_topic)}}}", "subscriptions: scan"
    )
    assert names(in_situation(path, scan_topic="front/scan")) == ["front/scan"]
    assert names(in_situation(path)) == ["scan"]
    assert names(in_situation(path, other="front/scan")) == ["scan"]


def test_an_empty_name_switches_an_endpoint_off(write_document: WriteDocument) -> None:
    path = write_document(
        "p/n", "names: {subscriptions: {scan: {name: $(param scan_topic)}}}", "subscriptions: scan"
    )
    assert names(in_situation(path, scan_topic="")) == []


def test_an_endpoint_repeats_for_each_entry_of_a_list(write_document: WriteDocument) -> None:
    section = "names: {subscriptions: {source: {each: source_list, name: $(item)}}}"
    path = write_document("p/n", section, "subscriptions: source")
    assert names(in_situation(path, source_list=("a", "~/b"))) == ["a", "~/b"]
    assert names(in_situation(path, source_list="a b")) == ["a", "b"]  # as costmaps write their sources
    assert names(in_situation(path)) == []


def test_a_pattern_of_parameter_names_gives_an_entry_for_each(write_document: WriteDocument) -> None:
    section = "names: {subscriptions: {cmd: {each: topics.*.topic, name: $(param topics.$(item).topic)}}}"
    path = write_document("p/n", section, "subscriptions: cmd")
    found = in_situation(
        path, topics__joy__topic="joy_vel", topics__nav__topic="nav_vel", locks__e__topic="stop"
    )
    assert names(found) == ["joy_vel", "nav_vel"]


@pytest.mark.parametrize(
    ("condition", "holding", "failing"),
    [
        ("{mode: closed}", "closed", "open"),
        ("{mode: [a, b]}", "b", "c"),
        ("{mode: {not: a}}", "b", "a"),
        ("{mode: true}", True, False),
        ("{mode: {set: true}}", "x", ""),
        ("{mode: {contains: x}}", ("w", "x"), ("w",)),
        ("{mode: {contains: x}}", "w|x", "w|xy"),
        ("[{mode: a}, {mode: b}]", "b", "c"),
    ],
)
def test_a_condition_decides_whether_an_endpoint_exists(
    write_document: WriteDocument, condition: str, holding: Any, failing: Any
) -> None:
    path = write_document(
        "p/n", f"names: {{subscriptions: {{odom: {{when: {condition}}}}}}}", "subscriptions: odom"
    )
    assert names(in_situation(path, mode=holding)) == ["odom"]
    assert names(in_situation(path, mode=failing)) == []


def test_a_condition_knows_the_default_of_its_parameter(write_document: WriteDocument) -> None:
    section = "names: {subscriptions: {odom: {when: {mode: closed}}}}"
    path = write_document(
        "p/n", section, "subscriptions: odom", parameters="mode: {type: string, default_value: closed}"
    )
    assert names(in_situation(path)) == ["odom"]
    assert names(in_situation(path, mode="open")) == []


def test_an_endpoint_of_some_distributions_is_not_in_others(write_document: WriteDocument) -> None:
    section = "names: {publishers: {new: {since: jazzy}, old: {until: humble}}}"
    path = write_document("p/n", section, "publishers: new old")
    assert names(in_situation(path, "humble")) == ["old"]
    assert names(in_situation(path, "jazzy")) == ["new"]


def test_words_of_the_command_line_name_endpoints(write_document: WriteDocument) -> None:
    section = """
options: {manager: [-c, --manager]}
names:
  subscriptions: {in: {name: $(argument 1)}}
  service_clients: {manager/list: {name: $(option manager /cm)/list}}
"""
    path = write_document("p/n", section, "subscriptions: in", "service_clients: manager/list")
    assert names(in_situation(path, words="-c /left front --loud")) == ["/left/list", "front"]
    assert names(in_situation(path, words="front --manager=/left")) == ["/left/list", "front"]
    assert names(in_situation(path, words="front")) == ["/cm/list", "front"]


def test_a_value_that_nobody_gives_is_unknown_not_guessed(write_document: WriteDocument) -> None:
    path = write_document("p/n", "names: {subscriptions: {in: {name: $(argument 1)/x}}}", "subscriptions: in")
    (endpoint,) = in_situation(path).endpoints
    assert not endpoint.name.is_literal
    assert "argument '1' has no value" in str(endpoint.name.parts)


PLUGINS = "plugins: [{parameter: loaded, default: [Grid], types: {Grid: p::Grid}}]"


def test_plugins_bring_their_names_under_those_of_the_caller(write_document: WriteDocument) -> None:
    write_document(
        "q/Grid",
        "classes: [p::Grid]\nnames: {publishers: {plan: {name: $(plugin)/plan}}}",
        "publishers: plan",
    )
    write_document("q/Other", "classes: [p::Other]", "publishers: other")
    path = write_document("p/n", PLUGINS)
    assert names(in_situation(path)) == ["Grid/plan"]
    assert names(in_situation(path, loaded=("Fine", "X"), Fine__plugin="p::Grid", X__plugin="p::Other")) == [
        "Fine/plan",
        "other",
    ]
    assert names(in_situation(path, loaded=())) == []


def test_a_plugin_that_nobody_describes_is_a_gap(write_document: WriteDocument) -> None:
    path = write_document("p/n", PLUGINS)
    assert "class my::Own, which no document describes" in why(in_situation(path, Grid__plugin="my::Own"))
    assert "the class of plugin 'Fine' is not known" in why(in_situation(path, loaded=("Fine",)))


def test_a_stated_gap_is_told_only_where_it_holds(write_document: WriteDocument) -> None:
    path = write_document("p/n", "gaps: [{why: any topic, when: {all: true}}]")
    assert why(in_situation(path, all=True)) == "any topic"
    assert why(in_situation(path, all=False)) == ""


def test_image_transports_are_those_that_are_installed_and_enabled(write_document: WriteDocument) -> None:
    write_document("zip_transport/pub", "transport: zip", "publishers: base/zip")
    write_document("odd_transport/pub", "transport: odd", "publishers: base/odd")
    path = write_document("p/n", "transports: [{side: publishers, base: image}]")
    assert names(in_situation(path)) == ["image/zip"]
    assert names(in_situation(path, image__enable_pub_plugins=("image_transport/raw",))) == []


@pytest.mark.parametrize(
    "section",
    [
        "names: {publishers: {a: {unless: {b: c}}}}",
        "names: {topics: {a: {}}}",
        "names: {publishers: {a: {since: tomorrow}}}",
        "plugins: [{default: [a]}]",
        "evidence: {how: rumour, repository: r, version: '1', commit: abcdef1}",
    ],
)
def test_a_section_that_says_something_unknown_is_refused(
    write_document: WriteDocument, section: str
) -> None:
    with pytest.raises(InvalidNoDLError, match=r"n\.nodl\.yaml:\d+"):
        path = write_document("p/n", section, "publishers: a")
        read_library_document(str(path.parents[1]), "p/n.nodl.yaml")


@given(st.text(max_size=20))
def test_a_value_is_never_read_as_a_reference(value: str) -> None:
    situation = Situation("jazzy", "n", "/", {"a": value, "b": "secret"})
    assert Scope(situation, {}, {}).fill("$(param a)").text == value


def test_not_even_one_that_looks_like_it() -> None:
    situation = Situation("jazzy", "n", "/", {"a": "$(param b)", "b": "secret"})
    assert Scope(situation, {}, {}).fill("x/$(param a)").text == "x/$(param b)"


def names_of(package: str, program: str, parameters: dict[str, object]) -> dict[EndpointKind, list[str]]:
    """Return what the shipped document of a program gives under parameters."""
    hit = Library().find(package, program)
    assert hit
    situation = Situation("jazzy", "node", "/", parameters)
    endpoints = applied(
        hit.document.interface, situation, LibraryDocuments(Library(), "jazzy")
    ).interface.endpoints
    return {kind: [str(e.name) for e in endpoints if e.kind is kind] for kind in {e.kind for e in endpoints}}


def test_a_command_of_joy_teleop_is_of_the_kind_that_its_type_says() -> None:
    found = names_of(
        "joy_teleop",
        "joy_teleop",
        {
            "walk.type": "topic",
            "walk.topic_name": "cmd_vel",
            "torso.type": "action",
            "torso.action_name": "up",
            "torso.topic_name": "not_used",
        },
    )
    assert found == {
        EndpointKind.PUBLISHER: ["cmd_vel"],
        EndpointKind.ACTION_CLIENT: ["up"],
        EndpointKind.SUBSCRIPTION: ["joy"],
    }


def test_a_merger_of_scans_subscribes_to_each_word_of_its_parameter() -> None:
    found = names_of("ira_laser_tools", "laserscan_multi_merger", {"laserscan_topics": "/front /rear"})
    assert found[EndpointKind.SUBSCRIPTION] == ["/front", "/rear"]
    assert EndpointKind.SUBSCRIPTION not in names_of("ira_laser_tools", "laserscan_multi_merger", {})


def test_a_voxel_layer_has_a_switch_for_each_of_its_sources() -> None:
    layer = LibraryDocuments(Library(), "jazzy").of_class(
        "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer"
    )
    assert layer and layer.depends
    given = {"stvl.observation_sources": "near far", "stvl.near.topic": "/points", "stvl.far.topic": ""}
    costmap = layer._replace(depends=Dependence(plugins=(PluginList("plugins"),)))
    situation = Situation(
        "jazzy",
        "local_costmap",
        "/local_costmap",
        {**given, "plugins": ["stvl"], "stvl.plugin": "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer"},
    )
    found = applied(costmap._replace(endpoints=()), situation, LibraryDocuments(Library(), "jazzy")).interface
    assert [str(e.name) for e in found.endpoints if e.kind is EndpointKind.SUBSCRIPTION] == ["/points"]
    services = {str(e.name) for e in found.endpoints if e.kind is EndpointKind.SERVICE_SERVER}
    assert services == {"near/toggle_enabled", "far/toggle_enabled", "save_grid"}


def test_a_camera_of_orbbec_publishes_the_streams_that_are_enabled() -> None:
    def published(**parameters: object) -> set[str]:
        return set(names_of("orbbec_camera", "orbbec_camera_node", dict(parameters))[EndpointKind.PUBLISHER])

    assert {"depth/image_raw", "/tf_static"} <= published()
    assert "color/image_raw" not in published()
    given = published(
        enable_color=True, enable_depth=False, enable_sync_output_accel_gyro=True, enable_gyro=True
    )
    assert {"color/image_raw", "gyro_accel/sample", "accel/imu_info"} <= given
    assert not {"depth/image_raw", "gyro/sample", "depth_to_color"} & given


def test_a_compliant_controller_has_the_inputs_of_motion_and_of_force_below_its_own_name() -> None:
    documents = LibraryDocuments(Library(), "jazzy")

    def subscribed(kind: str) -> set[str]:
        node = documents.of_class(f"cartesian_{kind.lower()}_controller/Cartesian{kind}Controller")
        assert node
        return {str(e.name) for e in node.endpoints if e.kind is EndpointKind.SUBSCRIPTION}

    assert subscribed("Motion") == {"~/target_frame"}
    assert subscribed("Force") == {"~/target_wrench", "~/ft_sensor_wrench"}
    assert subscribed("Compliance") == subscribed("Motion") | subscribed("Force")
