"""A launch whose nodes have no manifest of their own: what the library says of them, and what comes before it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ManifestError, UsageError
from enclave_launch.policy.derivation import allowed_names
from enclave_launch.report.explained import explained
from enclave_launch.report.plan_json import plan_json
from enclave_launch.report.tree import plan_tree
from tests.programs import COMPILED, install_package

from .conftest import Launch, allowed

QOS = "{history: SYSTEM_DEFAULT, reliability: SYSTEM_DEFAULT}"


@pytest.fixture
def install(prefix: Path) -> Callable[..., Path]:
    """A package with an executable: compiled, unless a Python source is given."""

    def make(package: str, executable: str, version: str = "1.0.0", source: str = "") -> Path:
        return install_package(prefix, package, {executable: source or COMPILED}, version)

    return make


@pytest.fixture
def document(tmp_path: Path) -> Callable[..., Path]:
    """A document of one publisher in the user's own library."""

    def write(stem: str, topic: str, section: str = "{library: rclcpp}") -> Path:
        path = tmp_path / "own" / f"{stem}.nodl.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(
            f"nodl_version: 2\ncodegen: {{enclave_launch: {section}}}\n"
            f"publishers: [{{name: {topic}, type: p/T, qos: {QOS}}}]\n"
        )
        return tmp_path / "own"

    return write


PYTHON = """#!/usr/bin/env python3
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
rclpy.init()
node = Node('n')
node.create_publisher(String, {topic}, 1)
rclpy.spin(node)
"""
NODE = '<node pkg="pkg" exec="prog" name="n"/>'


def test_the_sources_of_interfaces_have_an_order(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path], tmp_path: Path
) -> None:
    own = (document("pkg/prog", "from_library"),)
    share = install("pkg", "prog")
    assert allowed(launch(NODE, library_folders=own), "publish") == ["/from_library"]
    install("pkg", "prog", source=PYTHON.format(topic="'from_source'"))
    assert allowed(launch(NODE, library_folders=own), "publish") == ["/from_source"]
    document("pkg/prog", "from_record", "{runs: [{id: a}]}")
    plan = launch(NODE, library_folders=own)
    assert allowed(plan, "publish") == ["/from_record"] and str(plan.processes[0].origin) == "recorded"
    manifest = (
        '<interface version="1"><node name="n" executable="prog"><topic name="{}" type="p/msg/T" '
        'role="publisher"/></node></interface>'
    )
    (share / "pkg.nodl.xml").write_text(manifest.format("from_package"))
    assert allowed(launch(NODE, library_folders=own), "publish") == ["/from_package"]
    named = tmp_path / "mine.nodl.xml"
    named.write_text(manifest.format("from_option"))
    plan = launch(NODE, library_folders=own, manifests=(named,))
    assert allowed(plan, "publish") == ["/from_option"]


def test_a_folder_that_learn_wrote_is_a_library_too(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    """``PACKAGE__PROGRAM.NODE.nodl.yaml``: one document for each node of a program."""
    install("pkg", "prog")
    section = "{package: pkg, executable: prog, node: NODE, runs: [{id: a}]}"
    for node in ("one", "two"):
        folder = document(f"pkg__prog.{node}", f"from_{node}", section.replace("NODE", node))
    plan = launch('<node pkg="pkg" exec="prog"/>', library_folders=(folder,))
    assert allowed(plan, "publish") == ["/from_one", "/from_two"]
    assert [node.fqn for node in plan.nodes] == ["/one", "/two"]
    assert str(plan.processes[0].origin) == "recorded"


@pytest.mark.parametrize("file", ["prog.nodl.yaml", "pkg/prog.nodl.xml", "pkg/prog.nodl.json"])
def test_a_document_that_a_library_cannot_have_is_told(
    launch: Launch, install: Callable[..., Path], tmp_path: Path, file: str
) -> None:
    install("pkg", "prog")
    path = tmp_path / "own" / file
    path.parent.mkdir(parents=True)
    path.write_text("nodl_version: 2\n")
    with pytest.raises(ManifestError, match=r"PACKAGE/NAME\.nodl\.yaml"):
        launch(NODE, library_folders=(tmp_path / "own",))


def test_the_library_answers_where_an_analysis_leaves_something_open(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=PYTHON.format(topic="open('topic').read()"))
    assert "is not known" in " ".join(map(str, launch(NODE).problems))
    plan = launch(NODE, library_folders=(document("pkg/prog", "from_library"),))
    assert allowed(plan, "publish") == ["/from_library"] and not plan.problems


def test_the_plan_says_where_interfaces_come_from(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog")
    plan = launch(NODE, library_folders=(document("pkg/prog", "a"),))
    assert "library pkg/prog)" in plan_tree(plan)
    assert "  interfaces of prog-1: library pkg/prog" in explained(plan, "/n")
    assert json.loads(plan_json(plan))["processes"][0]["interfaces"] == "library"
    install("pkg", "prog", source=PYTHON.format(topic="'a'"))
    assert json.loads(plan_json(launch(NODE)))["processes"][0]["interfaces"] == "inferred"


def test_only_what_the_user_allows_is_asked(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("tf2_ros", "static_transform_publisher")
    node = '<node pkg="tf2_ros" exec="static_transform_publisher" name="n"/>'
    assert allowed(launch(node), "publish") == ["/tf_static"]
    assert "no NoDL manifest" in str(launch(node, library=False).problems[0])
    folder = document("tf2_ros/static_transform_publisher", "mine")
    assert allowed(launch(node, library_folders=(folder,)), "publish") == ["/mine"]
    with pytest.raises(UsageError, match="no such directory"):
        launch(node, library_folders=(folder / "absent",))


@pytest.mark.parametrize(("version", "warned"), [("1.3.9", False), ("1.30.0", True), ("2.0.0", True)])
def test_a_document_for_another_version_is_used_with_a_warning_that_names_both(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path], version: str, warned: bool
) -> None:
    install("pkg", "prog", version)
    folder = document("pkg/prog", "a", "{versions: {jazzy: '1.3'}}")
    plan = launch(NODE, library_folders=(folder,))
    assert allowed(plan, "publish") == ["/a"]
    told = [str(warning) for warning in plan.warnings if warning.code == "library-version"]
    assert bool(told) is warned
    if warned:
        assert "pkg/prog was written for 1.3 (jazzy), here is version " + version in told[0]


def test_of_a_package_that_is_not_installed_the_distribution_decides(
    launch: Launch, document: Callable[..., Path]
) -> None:
    folder = document("pkg/prog", "a", "{versions: {jazzy: '1.3'}}")
    for distro, warned in (("jazzy", False), ("humble", True)):
        plan = launch(NODE, library_folders=(folder,), distro=distro)
        assert any(w.code == "library-version" for w in plan.warnings) is warned


def test_remaps_namespaces_and_parameters_apply_as_to_any_manifest(
    launch: Launch, document: Callable[..., Path]
) -> None:
    folder = document("pkg/prog", "scan", "{names: {publishers: {scan: {name: $(param topic)}}}}")
    node = '<node pkg="pkg" exec="prog" name="n" namespace="r1">{}</node>'
    own = (folder,)
    assert allowed(launch(node.format(""), library_folders=own), "publish") == ["/r1/scan"]
    param = '<param name="topic" value="front"/>'
    assert allowed(launch(node.format(param), library_folders=own), "publish") == ["/r1/front"]
    remap = '<remap from="front" to="/moved"/>'
    assert allowed(launch(node.format(param + remap), library_folders=own), "publish") == ["/moved"]
    assert allowed(launch(node.format(remap), library_folders=own), "publish") == ["/r1/scan"]


def test_parameters_in_a_file_reach_a_node_that_launch_does_not_name(
    launch: Launch, document: Callable[..., Path], tmp_path: Path
) -> None:
    folder = document(
        "pkg/prog", "scan", "{node: own_name, names: {publishers: {scan: {name: $(param topic)}}}}"
    )
    file = tmp_path / "p.yaml"
    file.write_text("own_name: {ros__parameters: {topic: front}}\nother: {ros__parameters: {topic: back}}\n")
    plan = launch(f'<node pkg="pkg" exec="prog"><param from="{file}"/></node>', library_folders=(folder,))
    assert allowed(plan, "publish") == ["/front"]


COSTMAP = "{nodes: [{document: pkg/costmap, node: local_costmap, namespace: local_costmap}]}"


@pytest.fixture
def with_costmap(document: Callable[..., Path]) -> Path:
    document("pkg/costmap", "footprint", "{names: {publishers: {footprint: {name: $(param topic)}}}}")
    document("pkg/controller", "cmd_vel", COSTMAP.replace("{nodes", "{plugin: 'pkg::Controller', nodes"))
    return document("pkg/prog", "cmd_vel", COSTMAP)


def test_further_nodes_keep_their_name_and_follow_the_namespace(
    launch: Launch, with_costmap: Path, tmp_path: Path
) -> None:
    file = tmp_path / "p.yaml"
    file.write_text("r1: {local_costmap: {local_costmap: {ros__parameters: {topic: shape}}}}\n")
    plan = launch(
        f'<node pkg="pkg" exec="prog" name="renamed" namespace="r1"><param from="{file}"/></node>',
        library_folders=(with_costmap,),
    )
    assert [node.fqn for node in plan.nodes] == ["/r1/renamed", "/r1/local_costmap/local_costmap"]
    assert allowed(plan, "publish") == ["/r1/cmd_vel", "/r1/local_costmap/shape"]


def test_further_nodes_of_a_component_obey_the_container(
    launch: Launch, with_costmap: Path, tmp_path: Path
) -> None:
    plan = launch(
        '<node_container pkg="rclcpp_components" exec="component_container" name="c" namespace="">'
        '<remap from="footprint" to="moved"/>'
        '<composable_node pkg="pkg" plugin="pkg::Controller" name="x"><remap from="cmd_vel" to="cmd"/>'
        "</composable_node></node_container>",
        library_folders=(with_costmap,),
    )
    assert allowed(plan, "publish") == ["/cmd", "/local_costmap/moved"]


def test_a_name_that_ends_at_random_is_a_pattern_unless_launch_names_the_node(launch: Launch) -> None:
    node = '<node pkg="tf2_ros" exec="static_transform_publisher" {}/>'
    (enclave,) = launch(node.format("")).derived.policy.enclaves
    assert "/static_transform_publisher_*/get_parameters" in allowed_names(enclave)["serve_services"]
    (enclave,) = launch(node.format('name="base"')).derived.policy.enclaves
    assert not any("*" in name for name in allowed_names(enclave)["serve_services"])


def test_a_broken_document_is_told_with_file_and_line(launch: Launch, document: Callable[..., Path]) -> None:
    from enclave_launch import ManifestError

    folder = document("pkg/prog", "a", "{surprise: 1}")
    with pytest.raises(ManifestError, match=r"prog\.nodl\.yaml:2.*surprise"):
        launch(NODE, library_folders=(folder,))


FOLLOWS = "node.declare_parameter('out', {default}).value"
VERSIONED = "{library: rclcpp, versions: {jazzy: '1.0'}NAMES}"
IN_RECORD = "{runs: [{id: a}]}"


def codes(plan: LaunchPlan) -> set[str]:
    return {str(each.code.value) for each in plan.warnings}


def test_a_gap_that_only_this_start_has_sends_it_to_the_next_description(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    """topic_tools: with ``output_topic`` the source is enough, without it only the library knows the name."""
    install("pkg", "prog", source=PYTHON.format(topic="node.get_parameter('out').value"))
    own = (document("pkg/prog", "from_library"),)
    param = '<param name="out" value="given"/>'
    node = '<node pkg="pkg" exec="prog" name="n">{}</node>'
    assert allowed(launch(node.format(param), library_folders=own), "publish") == ["/given"]
    plan = launch(node.format(""), library_folders=own)
    assert allowed(plan, "publish") == ["/from_library"] and not plan.problems
    assert launch(node.format("")).problems


@pytest.mark.parametrize("of_document", ["b", "c"])
def test_a_complete_source_decides_and_its_difference_from_the_library_is_told(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path], of_document: str
) -> None:
    """The user's own copy of a program is what runs, the library knows the original."""
    install("pkg", "prog", source=PYTHON.format(topic="'b'"))
    own = (document("pkg/prog", of_document, VERSIONED.replace("NAMES", "")),)
    plan = launch(NODE, library_folders=own)
    assert allowed(plan, "publish") == ["/b"]
    assert ("descriptions-differ" in codes(plan)) == (of_document == "c")
    assert ("publish /c: library, not granted" in "\n".join(explained(plan, "/n"))) == (of_document == "c")


OPEN = "\nnode.create_publisher(String, open('f').read(), 1)\nrclpy.spin"


def test_an_open_source_with_a_name_that_the_library_lacks_is_another_program(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=PYTHON.format(topic="'b'").replace("rclpy.spin", OPEN))
    own = (document("pkg/prog", "a", VERSIONED.replace("NAMES", "")),)
    plan = launch(NODE, library_folders=own)
    assert plan.problems and "/a" not in allowed(plan, "publish")
    assert "descriptions-differ" in codes(plan)


def test_an_open_source_whose_names_the_library_has_is_what_the_library_describes(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=PYTHON.format(topic="'a'").replace("rclpy.spin", OPEN))
    own = (document("pkg/prog", "a", VERSIONED.replace("NAMES", "")),)
    plan = launch(NODE, library_folders=own)
    assert allowed(plan, "publish") == ["/a"] and not plan.problems


def test_a_document_of_another_version_does_not_contradict_the_source(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", "2.0.0", source=PYTHON.format(topic="'b'"))
    own = (document("pkg/prog", "a", VERSIONED.replace("NAMES", "")),)
    plan = launch(NODE, library_folders=own)
    assert allowed(plan, "publish") == ["/b"]
    assert codes(plan).isdisjoint({"descriptions-differ", "library-version"})


def test_what_a_record_lacks_is_told_with_the_option_that_grants_it(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path], tmp_path: Path
) -> None:
    """The record is named with ``--nodl`` or lies in a folder of the library; both mean the same."""
    install("pkg", "prog", source=PYTHON.format(topic="'unseen'"))
    folder = document("pkg__prog", "seen", IN_RECORD.replace("runs", "package: pkg, executable: prog, runs"))
    for given in ({"manifests": (folder,)}, {"library_folders": (folder,)}):
        plan = launch(NODE, **given)
        assert allowed(plan, "publish") == ["/seen"]
        (told,) = (each for each in plan.warnings if each.code.value == "record-lacks")
        assert "publish /unseen" in told.text and "--also unseen" in told.remedy
        assert "publish /unseen: inferred, not granted" in "\n".join(explained(plan, "/n"))
        granted = launch(NODE, **given, also=("unseen",))
        assert allowed(granted, "publish") == ["/seen", "/unseen"]
        assert "record-lacks" not in codes(granted)


def test_a_record_that_leaves_a_name_open_gives_way_to_who_knows_it(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    section = "{runs: [{id: a}], endpoints: [{in: publishers, name: seen, parameter: out, runs: [a]}]}"
    install("pkg", "prog")
    document("pkg/prog", "seen", section)
    assert launch(NODE, library_folders=(document("pkg/prog", "seen", section),)).problems
    install("pkg", "prog", source=PYTHON.format(topic=FOLLOWS.format(default="'known'")))
    plan = launch(NODE, library_folders=(document("pkg/prog", "seen", section),))
    assert allowed(plan, "publish") == ["/known"] and not plan.problems


def test_readings_of_a_record_that_gave_way_are_decided_as_those_of_one_that_did_not(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    """ekf_node: a record with another sensor than this launch has still says what it knows, by the source's reading."""
    rows = (
        "[{in: publishers, name: seen, parameter: out, runs: [a]}, "
        "{in: publishers, name: status, parameter: label, proof: one run, runs: [a]}]"
    )
    section = f"{{library: rclcpp, runs: [{{id: a}}], endpoints: {rows}}}"
    install("pkg", "prog", source=PYTHON.format(topic="node.declare_parameter('label', 'status').value"))
    own = document("pkg/prog", "seen", section)
    file = own / "pkg" / "prog.nodl.yaml"
    file.write_text(
        file.read_text().replace(
            "[{name: seen,", "[{name: status, type: p/T, qos: " + QOS + "}, {name: seen,"
        )
    )
    node = '<node pkg="pkg" exec="prog" name="n"><param name="label" value="warehouse"/></node>'
    plan = launch(node, library_folders=(own,))
    assert allowed(plan, "publish") == ["/warehouse"] and not plan.problems
    alone = launch(node, library_folders=(own,), infer=False)
    assert alone.problems and allowed(alone, "publish") == ["/status", "/warehouse"]


OPTIONAL = """#!/usr/bin/env python3
import rclpy
from rclpy.exceptions import ParameterUninitializedException
from rclpy.parameter import Parameter
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('n')
node.declare_parameter('lock', Parameter.Type.STRING)
try:
    lock = node.get_parameter('lock').value
except {caught}:
    lock = None
if lock:
    node.create_publisher(String, lock, 1)
rclpy.spin(node)
"""


def test_a_parameter_without_a_value_whose_exception_is_caught_is_a_gap_until_the_launch_sets_it(
    launch: Launch, install: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=OPTIONAL.format(caught="ParameterUninitializedException"))
    unset = launch(NODE)
    assert allowed(unset, "publish") == [] and "lock" in str(unset.problems)
    is_set = launch(f'{NODE[:-2]}><param name="lock" value="l"/></node>')
    assert allowed(is_set, "publish") == ["/l"] and not is_set.problems


def test_a_parameter_without_a_value_that_ends_the_program_is_a_gap(
    launch: Launch, install: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=OPTIONAL.format(caught="KeyError"))
    problems = launch(NODE).problems
    assert any("parameter 'lock' has no value" in problem.text for problem in problems)


def test_explain_says_of_one_name_which_descriptions_have_it(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=PYTHON.format(topic="'a'"))
    own = (document("pkg/prog", "a", VERSIONED.replace("NAMES", "")),)
    lines = explained(launch(NODE, library_folders=own), "/a")
    assert "    publish /a: inferred, library" in lines
    assert not explained(launch(NODE, library_folders=own), "/other")


ROWS = "{{runs: [{{id: a}}], endpoints: [{{in: publishers, name: status, {}, runs: [a]}}]}}"
AFTER_ONE_RUN = ROWS.format("parameter: label, default: status, proof: one run")
PROVEN = ROWS.format("parameter: label, default: status, proof: another value was followed")
BELOW = ROWS.format("candidates: [{parameter: camera, prefix: /, suffix: /status}]")
SEVERAL = ROWS.format("undecided: [a, b], candidates: [{parameter: a}, {parameter: b, each: true}]")


@pytest.mark.parametrize(
    ("section", "parameter", "value", "granted", "told"),
    [
        (AFTER_ONE_RUN, "other", "warehouse", ["/status"], False),
        (AFTER_ONE_RUN, "label", "status", ["/status"], False),
        (AFTER_ONE_RUN, "label", "warehouse", ["/status", "/warehouse"], True),
        (AFTER_ONE_RUN, "label", "robot 7 ok", ["/status"], True),
        (PROVEN, "label", "warehouse", ["/warehouse"], False),
        (SEVERAL, "a", "front", ["/front", "/status"], True),
        (BELOW, "camera", "rgb", ["/rgb/status", "/status"], True),
        (SEVERAL, "b", "[left, right]", ["/left", "/right", "/status"], True),
    ],
)
def test_a_coincidence_of_values_is_not_a_rule(
    launch: Launch,
    document: Callable[..., Path],
    section: str,
    parameter: str,
    value: str,
    granted: list[str],
    told: bool,
) -> None:
    """After one run the name may be fixed or the parameter's value; a text that cannot be a name is neither."""
    node = f'<node pkg="pkg" exec="prog" name="n"><param name="{parameter}" value="{value}"/></node>'
    plan = launch(node, library_folders=(document("pkg/prog", "status", section),))
    assert allowed(plan, "publish") == granted and not plan.problems
    assert ("record-undecided" in codes(plan)) is told


@pytest.mark.parametrize(
    ("topic", "granted"),
    [
        ("node.declare_parameter('label', 'status').value", ["/warehouse"]),
        ("'status'", ["/status"]),
        ("'other'", ["/status", "/warehouse"]),
        ("open('topic').read()", ["/status", "/warehouse"]),
    ],
)
def test_a_source_that_has_one_reading_of_a_recorded_name_decides(
    launch: Launch,
    install: Callable[..., Path],
    document: Callable[..., Path],
    topic: str,
    granted: list[str],
) -> None:
    """Nothing is decided by a source that has neither, or that leaves something open."""
    install("pkg", "prog", source=PYTHON.format(topic=topic))
    own = document("pkg/prog", "status", AFTER_ONE_RUN)
    node = '<node pkg="pkg" exec="prog" name="n"><param name="label" value="warehouse"/></node>'
    plan = launch(node, library_folders=(own,))
    assert allowed(plan, "publish") == granted
    assert ("record-undecided" in codes(plan)) is (len(granted) > 1)


def test_what_others_leave_open_a_record_may_lack(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    install("pkg", "prog", source=PYTHON.format(topic="open('topic').read()"))
    plan = launch(NODE, library_folders=(document("pkg/prog", "seen", IN_RECORD),))
    assert allowed(plan, "publish") == ["/seen"] and not plan.problems
    (told,) = (each for each in plan.warnings if each.code.value == "record-lacks")
    assert "may lack what another description leaves open" in told.text and "is not known" in told.text
    assert "--also unseen" not in told.remedy


def test_further_nodes_stay_as_they_are_where_descriptions_are_joined(
    launch: Launch, install: Callable[..., Path], document: Callable[..., Path]
) -> None:
    """Of two recorded nodes one gets what was never seen; a node that only the source makes comes along."""
    second = "extra = Node('extra')\nextra.create_publisher(String, 'far', 1)\n"
    install(
        "pkg", "prog", source=PYTHON.format(topic="'unseen'").replace("rclpy.spin", f"{second}rclpy.spin")
    )
    section = "{package: pkg, executable: prog, node: NODE, runs: [{id: a}]}"
    for node in ("n", "other"):
        folder = document(f"pkg__prog.{node}", f"of_{node}", section.replace("NODE", node))
    plan = launch('<node pkg="pkg" exec="prog"/>', library_folders=(folder,), also=("unseen",))
    names = {node.fqn: [str(each.name) for each in node.interface.endpoints] for node in plan.nodes}
    assert names == {"/n": ["of_n", "unseen"], "/other": ["of_other"], "/extra": ["far"]}
