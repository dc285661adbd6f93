"""What stands between us and a program must be known to keep its environment, else the process is refused."""

from __future__ import annotations

import shlex
from xml.sax.saxutils import quoteattr

import pytest

from enclave_launch import LaunchPlan
from enclave_launch.diagnostics import Code

from .conftest import Plan

REFUSED = {
    "env -u ROS_SECURITY_ENABLE": "env",
    "env -i": "env",
    "env ROS_SECURITY_ENABLE=false": "env",
    "/usr/bin/env -S -u ROS_SECURITY_ENABLE": "env",
    'bash -c \'unset ROS_SECURITY_ENABLE; exec "$0" "$@"\'': "bash",
    "sh -c": "sh",
    "sudo": "sudo",
    "sudo -E": "sudo",
    "su robot -c": "su",
    "ssh other": "ssh",
    "docker exec robot": "docker",
    "gnome-terminal --": "gnome-terminal",
    "tmux new-window": "tmux",
    "./my_wrapper.sh": "my_wrapper.sh",
    "nice -n 5 env -i": "env",
    "xterm -e sudo": "sudo",
    "nice -n 5 my_wrapper": "my_wrapper",
    "gdb -ex 'unset environment ROS_SECURITY_ENABLE' -ex run --args": "gdb",
    "strace -E ROS_SECURITY_ENABLE": "strace",
    "gdbserver --wrapper env -u ROS_SECURITY_ENABLE -- :3000": "gdbserver",
    "python3 -c 'import os; os.environ.clear()'": "python3",
}
KEPT = [
    "gdb -ex run --args",
    "xterm -e gdb -ex run --args",
    "gdbserver localhost:3000",
    "valgrind --tool=memcheck --leak-check=full",
    "perf record -g -o out.data --",
    "strace -f -o trace.txt",
    "nice -n 5",
    "nice",
    "ionice -c 2 -n 0",
    "taskset -c 0,1",
    "taskset 0x3",
    "chrt -f 50",
    "stdbuf -oL",
    "timeout -k 5 60",
    "setsid nice -n -5 taskset -c 3",
    "python3 -m debugpy --listen 5678 --wait-for-client",
    "python3.11 -X dev",
]


def prefixed(prefix: str) -> str:
    return f'<node pkg="demo_nodes" exec="talker" launch-prefix={quoteattr(prefix)}/>'


def refused(plan: LaunchPlan) -> list[str]:
    return [problem.text.split("'")[1] for problem in plan.problems if problem.code is Code.PREFIX_REFUSED]


@pytest.mark.parametrize("prefix", REFUSED)
def test_a_prefix_that_may_change_the_environment_is_refused_by_name(prefix: str, plan: Plan) -> None:
    assert refused(plan(prefixed(prefix))) == [REFUSED[prefix]]
    accepted = plan(prefixed(prefix), accept_prefixes=(REFUSED[prefix],))
    assert not accepted.problems


@pytest.mark.parametrize("prefix", KEPT)
def test_reviewed_prefixes_keep_it(prefix: str, plan: Plan) -> None:
    found = plan(prefixed(prefix))
    assert not found.problems
    assert found.processes[0].process.prefix == tuple(shlex.split(prefix))


def test_accepting_one_prefix_accepts_no_other(plan: Plan) -> None:
    assert refused(plan(prefixed("nice sudo"), accept_prefixes=("env",))) == ["sudo"]


@pytest.mark.parametrize(
    "words",
    ["launch_configurations={'launch-prefix': 'env -i'}", "set_env"],
)
def test_a_prefix_for_all_processes_is_asked_about_as_well(words: str, plan: Plan) -> None:
    text = '<node pkg="demo_nodes" exec="talker"/>'
    if words == "set_env":
        found = plan(f'<let name="launch-prefix" value="env -i"/>{text}')
    else:
        found = plan(text, launch_configurations={"launch-prefix": "env -i"})
    assert refused(found) == ["env"]


@pytest.mark.parametrize(
    ("args", "expected"),
    [
        ("", []),
        ("--rate 5", []),
        ("'a;b'", []),
        ("; true", ["shell"]),
        ("| tee log", ["shell"]),
        ("`unset_all`", ["shell"]),
        ("x;true", ["shell"]),
        ("x & unset_all", ["shell"]),
        ("'\\$(unset_all)'", ["shell"]),
        ("'one\ntwo'", ["shell"]),
        ("; x 'that is not closed", ["shell"]),
        ("x" * 50_000, ["shell"]),
        ("a-b {c} x#y", []),
    ],
)
def test_a_node_behind_a_shell_is_one_command_or_refused(args: str, expected: list[str], plan: Plan) -> None:
    arguments = quoteattr(shlex.quote(args) if args[:1] in (";", "|", "`", "'") else args)
    text = f'<node pkg="demo_nodes" exec="talker" shell="true" args={arguments}/>'
    assert refused(plan(text)) == expected
    assert refused(plan(text, accept_prefixes=("shell",))) == []
    assert refused(plan(text.replace(' shell="true"', ""))) == [], "without a shell they are words"


@pytest.mark.parametrize(
    ("cmd", "expected"),
    [
        ("env -u ROS_SECURITY_ENABLE talker", ["env"]),
        ("sudo ip link set can0 up", ["sudo"]),
        ("nice -n 5 sudo talker", ["sudo"]),
        ("env", []),
        ("rviz2 -d x.rviz", []),
        ("bash -c 'echo hello'", []),
        ("gdb --args talker", []),
    ],
)
@pytest.mark.parametrize("enclave", ["", 'enclave="/x"'])
def test_an_executable_that_starts_another_program_is_asked_about_it(
    cmd: str, expected: list[str], enclave: str, plan: Plan
) -> None:
    assert refused(plan(f"<executable cmd={quoteattr(cmd)} {enclave}/>")) == expected


def test_a_shell_cuts_the_words_of_an_executable_anew(plan: Plan) -> None:
    text = "entities = [ExecuteProcess(cmd=['{} talker --flag'], shell=True)]"
    assert refused(plan(text.format("env -u ROS_SECURITY_ENABLE"))) == ["env"]
    assert refused(plan(text.format("nice -n 5"))) == []
