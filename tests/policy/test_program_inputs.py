"""Names that are inputs of the program: what launch passes counts, what it may pass unseen is not guessed."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch.policy import DerivedPolicy, derive_policy
from enclave_launch.policy.program_inputs import program_inputs
from enclave_launch.policy.running_node import node_of_process
from enclave_launch.process import EnclaveRequest, ResolvedProcess
from nodl.name_template import NameTemplate, ParameterPart
from nodl.node_interface import Endpoint, EndpointKind, NodeInterface

HERE = SourceLocation("talker.py", 9)


def process(*arguments: str, environment: Mapping[str, str] | None = None) -> ResolvedProcess:
    return ResolvedProcess(
        number=1,
        kind="node",
        package="demo",
        executable="talker",
        process_name="talker-1",
        name="talker",
        namespace=None,
        fqn="/talker",
        cmd=(
            "gdb",
            "-ex",
            "run",
            "--args",
            "/lib/demo/talker",
            *arguments,
            "--ros-args",
            "-r",
            "__node:=talker",
        ),
        remaps=(),
        parameters={},
        environment={},
        enclave=EnclaveRequest(),
        location=SourceLocation("demo.launch.xml", 3),
        final_environment=environment or {},
    )


def derive(name: str, started: ResolvedProcess) -> DerivedPolicy:
    topic = NameTemplate((ParameterPart(name, "chatter"),))
    endpoint = Endpoint(EndpointKind.PUBLISHER, topic, "x/msg/Y", HERE)
    interface = NodeInterface("demo", "talker", None, "talker", None, (endpoint,), HERE)
    return derive_policy([node_of_process(started, interface, "/", "node")], distro="humble")


def topics(derived: DerivedPolicy) -> list[str]:
    return [
        rule.expression for rule, reasons in derived.reasons["/"].items() if reasons[0].origin == "declared"
    ]


KNOWN = {
    "an option": ("--topic", process("--topic", "loud"), "/loud"),
    "an option with =": ("--topic", process("--topic=loud"), "/loud"),
    "an option with one dash": ("-t", process("-t", "loud"), "/loud"),
    "the last of two equal options": ("--topic", process("--topic", "old", "--topic", "loud"), "/loud"),
    "an option beside a flag without value": ("--topic", process("--verbose", "--topic", "loud"), "/loud"),
    "an option that launch leaves alone": ("--topic", process("--rate", "5"), "/chatter"),
    "no arguments at all": ("<topic>", process(), "/chatter"),
    "another option that begins likewise": ("--topic", process("--topic-type", "x"), "/chatter"),
    "a positional argument by its place": ("<1>", process("loud", "other"), "/loud"),
    "the next by its place": ("<2>", process("other", "loud"), "/loud"),
    "a place after the last word": ("<2>", process("loud"), "/chatter"),
    "what follows ROS arguments": ("--topic", process("--ros-args", "--", "--topic", "loud"), "/loud"),
    "a variable": ("$TOPIC", process(environment={"TOPIC": "loud"}), "/loud"),
    "a variable that nobody sets": ("$TOPIC", process(environment={"OTHER": "x"}), "/chatter"),
}


@pytest.mark.parametrize("case", KNOWN)
def test_values_that_launch_passes(case: str) -> None:
    name, started, expected = KNOWN[case]
    derived = derive(name, started)
    assert topics(derived) == [expected]
    assert derived.problems == ()


DOUBTFUL = {
    "a positional argument": ("<topic>", process("loud")),
    "a word after a flag that may take no value": ("<topic>", process("--verbose", "loud")),
    "a place beside options, of which one may take the word": ("<1>", process("--verbose", "loud")),
    "a place after the last word, with an option whose value it may be": (
        "<2>",
        process("a", "--verbose", "b"),
    ),
    "an option, shortened": ("--topic", process("--top", "loud")),
    "an option, shortened, with =": ("--topic", process("--top=loud")),
    "an option that may have a short spelling": ("--topic", process("-t", "loud")),
}


@pytest.mark.parametrize("case", DOUBTFUL)
def test_a_default_is_not_believed_where_launch_may_pass_something_else(case: str) -> None:
    name, started = DOUBTFUL[case]
    derived = derive(name, started)
    assert topics(derived) == []
    assert f"the command line may set {name}" in derived.problems[0].text


def test_ros_arguments_and_the_prefix_are_no_inputs() -> None:
    found = program_inputs(process("old:=new"))
    assert (dict(found.values), found.bare_words, found.short_flags) == ({}, False, False)
