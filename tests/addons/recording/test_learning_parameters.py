"""A second run with other values decides where names come from."""

from __future__ import annotations

from pathlib import Path

from enclave_launch import LaunchPlan, ResolveOptions, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.plan import InterfaceOrigin
from enclave_launch.report.explained import explained
from enclave_launch.report.tree import plan_tree
from nodl.document import read_document
from nodl.name_template import NameTemplate, ParameterPart
from tests.addons.recording.stand_in_launch import PACKAGE, Program, make_workspace, manifest_text

LEARN = ("--learn-for", "1s", "--learn-isolation", "local")


def learn(folder: Path, stand_in: Path, program: Program, *arguments: str) -> dict[str, NameTemplate]:
    """Names by the text of the standard entry."""
    workspace = make_workspace(folder / "ws", stand_in, [program])
    ran = workspace.run("--learn", str(folder / "learnt"), *LEARN, *arguments)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    (file,) = (folder / "learnt").glob(f"{PACKAGE}__{program.name}*.nodl.yaml")
    (node,) = read_document(file)
    return {endpoint.kind.value: endpoint.name for endpoint in node.interface.endpoints}


def test_a_word_of_the_command_line_beside_a_fixed_name_of_the_same_value(
    stand_in: Path, tmp_path: Path
) -> None:
    """Matching takes both for the argument; the second run sees that one of them stays."""
    program = Program(
        "relay",
        "node relay\nsubscription %1 std_msgs/msg/String\npublisher scan std_msgs/msg/Bool\nwait\n",
        attributes='args="scan"',
    )
    first = learn(tmp_path, stand_in, program)
    assert first["subscription"].parts == first["publisher"].parts == (ParameterPart("<1>"),)
    again = learn(tmp_path, stand_in, program._replace(attributes='args="front"'))
    assert again["subscription"].parts == (ParameterPart("<1>"),)
    assert again["publisher"].parts == ("scan",)


def test_a_parameter_that_only_looks_like_the_source_is_ruled_out(stand_in: Path, tmp_path: Path) -> None:
    program = Program(
        "fixed",
        "node fixed\npublisher map nav_msgs/msg/OccupancyGrid\nwait\n",
        inside='<param name="world" value="map"/>',
    )
    assert learn(tmp_path, stand_in, program)["publisher"].parts == (ParameterPart("world"),)
    decided = learn(tmp_path, stand_in, program._replace(inside='<param name="world" value="hall"/>'))
    assert decided["publisher"].parts == ("map",)


def test_runs_are_united_and_what_a_person_wrote_stays(stand_in: Path, tmp_path: Path) -> None:
    program = Program("talker", "node talker\npublisher one std_msgs/msg/String\nwait\n")
    learn(tmp_path, stand_in, program)
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    added = "service_servers:\n- {name: by_hand, type: std_srvs/srv/Empty, description: mine}\n"
    file.write_text(file.read_text() + added)
    other = program._replace(script="node talker\npublisher two std_msgs/msg/String\nwait\n")
    learn(tmp_path, stand_in, other)
    (node,) = read_document(file)
    assert {str(endpoint.name) for endpoint in node.interface.endpoints} == {"one", "two", "by_hand"}
    assert "description: mine" in file.read_text()
    assert len(list((tmp_path / "learnt" / "records").glob("*.record"))) == 2


def test_a_lifecycle_node_that_was_never_active_is_incomplete(stand_in: Path, tmp_path: Path) -> None:
    program = Program("life", "lifecycle life\nstate 1\npublisher p std_msgs/msg/String\nwait\n")
    learn(tmp_path, stand_in, program)
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    assert "incomplete:\n    - 'a lifecycle node that was never active" in file.read_text()
    (warning,) = [each for each in plan_of(tmp_path).warnings if each.code is Code.RECORDING_INCOMPLETE]
    assert "node /life is learnt incompletely" in str(warning) and "record it again" in str(warning)


def plan_of(folder: Path) -> LaunchPlan:
    """The launch that was learnt, with what was learnt."""
    file = folder / "ws" / "share" / PACKAGE / "launch" / "all.launch.xml"
    options = ResolveOptions(prefixes=(folder / "ws",), manifests=(folder / "learnt",), distro="jazzy")
    return resolve(file, options=options)


def test_the_plan_says_what_was_recorded_and_how_sure_it_is(stand_in: Path, tmp_path: Path) -> None:
    program = Program(
        "fixed",
        "node fixed\npublisher map nav_msgs/msg/OccupancyGrid\npublisher out std_msgs/msg/String\n"
        "subscription goal std_msgs/msg/String\nwait\n",
        inside='<param name="world" value="map"/><param name="a_topic" value="goal"/>'
        '<param name="b_topic" value="goal"/>',
    )
    learn(tmp_path, stand_in, program)
    plan = plan_of(tmp_path)
    assert plan.processes[0].origin is InterfaceOrigin.RECORDED
    assert "recorded in 1 run)" in plan_tree(plan)
    explained_ = "\n".join(explained(plan, "/fixed"))
    assert (
        "parameter world, set by launch; recorded in 1 run; from the parameter as far as one run shows"
        in explained_
    )
    assert "recorded in 1 run; undecided whether it is fixed or comes from a_topic or b_topic" in explained_
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    file.write_text(manifest_text([("publisher", "out")], "package: stand_in_nodes, executable: fixed"))
    by_hand = plan_of(tmp_path)
    assert by_hand.processes[0].origin is InterfaceOrigin.NAMED and "recorded" not in plan_tree(by_hand)


def test_the_node_of_a_transform_listener_has_its_own_row(stand_in: Path, tmp_path: Path) -> None:
    """Its name ends in an address; rules in the code of tf2_ros give it."""
    program = Program(
        "listener",
        "node listener\npublisher p std_msgs/msg/String\n"
        "node transform_listener_impl_5581a2b3c4d0\nsubscription /tf tf2_msgs/msg/TFMessage\nwait\n",
    )
    learn(tmp_path, stand_in, program)
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    (node,) = read_document(file)
    assert node.interface.name == "listener"


def test_a_name_that_ends_in_a_number_is_learnt_without_it(stand_in: Path, tmp_path: Path) -> None:
    program = Program("relay", "node relay_field_31337\npublisher p std_msgs/msg/String\nwait\n")
    learn(tmp_path, stand_in, program)
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    (node,) = read_document(file)
    assert node.interface.name == "relay_field" and node.interface.depends is not None
    assert node.interface.depends.random_name


def test_a_plan_that_was_learnt_needs_nothing_else(stand_in: Path, tmp_path: Path) -> None:
    """Learn unsecured, then start secured under another name: nothing is refused."""
    program = Program(
        "node_a", "node node_a\npublisher %n/out std_msgs/msg/String\nsubscription in m/msg/X\nwait\n"
    )
    learn(tmp_path, stand_in, program)
    renamed = program._replace(attributes='name="other" namespace="/far"', script=program.script[:-5])
    workspace = make_workspace(tmp_path / "ws", stand_in, [renamed])
    ran = workspace.run(*("--secure", "--keystore", str(tmp_path / "ks"), "--nodl", str(tmp_path / "learnt")))
    assert ran.returncode == 0 and "refused" not in ran.stdout + ran.stderr, ran.stdout + ran.stderr


def test_two_words_of_one_value_are_told_apart(stand_in: Path, tmp_path: Path) -> None:
    program = Program(
        "relay",
        "node relay\nsubscription %1 std_msgs/msg/String\npublisher %2 std_msgs/msg/String\nwait\n",
        attributes='args="scan scan"',
    )
    first = learn(tmp_path, stand_in, program)
    assert first["subscription"].parts == first["publisher"].parts == ("scan",), "undecided"
    names = learn(tmp_path, stand_in, program._replace(attributes='args="front rear"'))
    assert names["subscription"].parts == (ParameterPart("<1>"),)
    assert names["publisher"].parts == (ParameterPart("<2>"),)


def test_learning_ends_though_a_process_is_started_again_and_again_and_another_cannot_be_heard(
    stand_in: Path, tmp_path: Path
) -> None:
    """What a new life repeats is not new, and nobody waits for a process with an empty environment."""
    lifecycle = "lifecycle again\nstate 1\nstate 2\npublisher p std_msgs/msg/String\n"
    programs = [
        Program("again", lifecycle, attributes='respawn="true" respawn_delay="0.3"'),
        Program("unheard", "node unheard\nwait\n", attributes='launch-prefix="env -i"'),
    ]
    workspace = make_workspace(tmp_path / "ws", stand_in, programs)
    ran = workspace.run("--learn", str(tmp_path / "learnt"), *LEARN)
    assert "no new endpoint for 1 s" in ran.stdout and "env -i starts programs" in ran.stdout, ran.stdout


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(stand_in: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path / "ws", stand_in, [Program("n", "node n\nwait\n")])
    (tmp_path / "file").touch()
    ran = workspace.run("--learn", str(tmp_path / "file"), *LEARN)
    assert ran.returncode == 1 and "nothing was started" in ran.stderr and "process started" not in ran.stdout
    told = workspace.run("--learn", str(tmp_path / "learnt"), "--learn-for", "ten")
    assert told.returncode == 2 and "not a time such as 20s" in told.stderr


def test_the_value_of_an_option_is_an_input_as_a_parameter_is(stand_in: Path, tmp_path: Path) -> None:
    """The second run gives the option another value, and the name follows."""
    program = Program(
        "relay",
        "node relay\nsubscription %2 std_msgs/msg/String\nwait\n",
        attributes='args="--topic scan"',
    )
    names = learn(tmp_path, stand_in, program)
    assert names["subscription"].parts == (ParameterPart("--topic"),)
    learn(tmp_path, stand_in, program._replace(attributes='args="--topic side"'))
    (file,) = (tmp_path / "learnt").glob("*.nodl.yaml")
    assert "proof: another value was followed" in file.read_text()
    other = program._replace(attributes='args="--topic front"')
    make_workspace(tmp_path / "ws", stand_in, [other])
    (node,) = plan_of(tmp_path).derived.nodes["/"]
    assert "/front" in "\n".join(explained(plan_of(tmp_path), node.fqn))


def test_two_values_within_one_name_are_found_and_a_number_stays_a_number(
    stand_in: Path, tmp_path: Path
) -> None:
    program = Program(
        "agent",
        "node agent\npublisher robot_%2/status std_msgs/msg/String\nsubscription fleet/%1 std_msgs/msg/String\nwait\n",
        attributes='args="alpha 1"',
    )
    first = learn(tmp_path, stand_in, program)
    assert first["publisher"].parts == ("robot_1/status",) and first["subscription"].parts == ("fleet/alpha",)
    names = learn(tmp_path, stand_in, program._replace(attributes='args="beta 2"'))
    assert names["publisher"].parts == ("robot_", ParameterPart("<2>"), "/status")
    assert names["subscription"].parts == ("fleet/", ParameterPart("<1>"))
