"""``secure-launch`` as a user meets it: what it prints, what it refuses, what it leaves behind."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import DryRun

from .conftest import DEMO, SecureLaunch

Write = Callable[..., Path]

TALKER = '<node pkg="demo_nodes" exec="talker"/>'


def files_below(folder: Path) -> set[str]:
    return {
        os.path.relpath(os.path.join(base, name), folder)
        for base, _, names in os.walk(folder)
        for name in names
    }


# --- the dry run -----------------------------------------------------------------------------------------------


def test_a_dry_run_prints_the_tree_and_writes_nothing_anywhere(
    secure_launch: SecureLaunch, tmp_path: Path
) -> None:
    before = files_below(tmp_path), files_below(DEMO)
    run = secure_launch(
        "--dry-run", "--secure", "--keystore", tmp_path / "ks", "demo_nodes", "talker_listener.launch.xml"
    )
    assert run.returncode == 0
    assert "enclave /  (shared by 2 processes)" in run.stdout
    assert "[talker-1] demo_nodes/talker as /talker" in run.stdout
    assert "publish: /chatter" in run.stdout
    assert (files_below(tmp_path), files_below(DEMO)) == before


def test_the_json_is_what_the_contract_says(secure_launch: SecureLaunch) -> None:
    run = secure_launch(
        "--dry-run", "--format", "json", "demo_nodes", "talker_listener_namespace.launch.xml", "count:=3"
    )
    document = DryRun(**json.loads(run.stdout))
    talker, listener = document.processes
    assert (talker.fqn, talker.enclave, listener.enclave) == ("/robot1/talker", "/robot1", "/robot1")
    assert talker.cmd[:4] == [f"{DEMO}/lib/demo_nodes/talker", "--ros-args", "-r", "__ns:=/robot1"]
    assert "--enclave" not in talker.cmd
    assert listener.parameters == {"count": 3, "seconds": 20}
    assert (Path(talker.launch_file).name, talker.on_event) == ("talker_listener_namespace.launch.xml", None)
    enclave = document.enclaves["/robot1"]
    assert enclave.nodes == ["/robot1/listener", "/robot1/talker"]
    assert "/robot1/chatter" in enclave.publish and "/robot1/chatter" in enclave.subscribe
    assert "/rosout" in enclave.publish and "/robot1/talker/get_parameters" in enclave.serve_services
    assert document.warnings == [] and document.diagnostics == []


def test_under_secure_the_json_shows_the_enclave_and_its_variables(
    secure_launch: SecureLaunch, tmp_path: Path
) -> None:
    words = ("--dry-run", "--secure", "--keystore", tmp_path / "ks", "--format", "json")
    run = secure_launch(*words, "demo_nodes", "talker_listener_namespace.launch.xml")
    process = DryRun(**json.loads(run.stdout)).processes[0]
    assert process.cmd[-2:] == ["--enclave", "/robot1"]
    assert process.environment == {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_KEYSTORE": str(tmp_path / "ks"),
        "ROS_SECURITY_STRATEGY": "Enforce",
    }


def test_the_three_front_ends_give_the_same_plan(secure_launch: SecureLaunch) -> None:
    plans = []
    for kind in ("xml", "yaml", "py"):
        run = secure_launch("--dry-run", "--format", "json", "demo_nodes", f"talker_listener.launch.{kind}")
        document = DryRun(**json.loads(run.stdout))
        plans.append([(p.fqn, p.cmd[0], p.parameters, p.enclave) for p in document.processes])
    assert plans[0] == plans[1] == plans[2]


def test_an_executable_is_no_node(secure_launch: SecureLaunch, write: Write) -> None:
    file = write('<executable cmd="echo hello"/>\n<executable cmd="ls -l" enclave="/files"/>')
    run = secure_launch("--dry-run", "--format", "json", file)
    echo, ls = DryRun(**json.loads(run.stdout)).processes
    assert (echo.package, echo.executable, echo.fqn, echo.enclave) == (None, "echo", None, None)
    assert (ls.executable, ls.enclave) == ("ls", "/files")


def test_explain_names_manifest_and_remap_rule(secure_launch: SecureLaunch) -> None:
    run = secure_launch("--explain", "/conversation", "demo_nodes", "talker_listener_remap.launch.xml")
    assert "demo_nodes.nodl.xml:" in run.stdout
    assert "remapped by chatter:=/conversation at " in run.stdout


def test_the_derived_policy_can_be_committed_and_read_again(
    secure_launch: SecureLaunch, tmp_path: Path
) -> None:
    words = ("--dry-run", "--format", "policy", "demo_nodes", "talker_listener.launch.xml")
    first, second = secure_launch(*words), secure_launch(*words)
    assert first.stdout == second.stdout and first.stdout.startswith("<?xml")
    (tmp_path / "policy.xml").write_text(first.stdout)
    merged = secure_launch("--policy", tmp_path / "policy.xml", *words)
    assert merged.stdout == first.stdout


def test_show_args_and_help_tell_a_person_what_to_do(secure_launch: SecureLaunch) -> None:
    shown = secure_launch("-s", "demo_nodes", "talker_listener.launch.xml")
    assert "'count':" in shown.stdout and "(default: '5')" in shown.stdout
    assert "--secure --keystore ks demo_nodes" in secure_launch("--help").stdout
    assert secure_launch("--version").stdout.startswith("secure-launch ")


# --- refusals: one clear message, exit status not 0, nothing started, nothing written ------------------------------

BAD_FILES = {
    "an unknown package": ('<node pkg="nosuch_package" exec="e"/>', ":2: <node>", "'nosuch_package' not found"),
    "an unknown executable": ('<node pkg="demo_nodes" exec="nosuch"/>', ":2: <node>", "'nosuch' not found"),
    "malformed XML": ('<node pkg="a"', ":3:", "not well-formed"),
    "an unknown attribute": ('<node pkg="demo_nodes" exec="talker" foo="1"/>', ":2: <node>", "{'foo'}"),
    "an unknown element": ('<nodes pkg="a" exec="b"/>', ":2: <nodes>", "Unrecognized entity of the type: nodes"),
    "a missing required argument": (f'<arg name="robot"/>{TALKER}', "test.launch.xml", "required argument 'robot'"),
    "an invalid node name": ('<node pkg="demo_nodes" exec="talker" name="a-b"/>', ":2: <node>", "Invalid node name"),
    "an invalid namespace": ('<node pkg="demo_nodes" exec="talker" namespace="a b"/>', ":2: <node>", "namespace"),
    "an invalid enclave": ('<node pkg="demo_nodes" exec="talker" enclave="../x"/>', ":2: <node>", "'/../x'"),
    "an undefined variable": ('<node pkg="demo_nodes" exec="$(var x)"/>', ":2: <node>", "'x' does not exist"),
    "a remap rule rcl refuses": (
        '<node pkg="demo_nodes" exec="talker"><remap from="a b" to="c"/></node>',
        "test.launch.xml:2",
        "invalid remap rule",
    ),
    "a later broken element": (f'{TALKER}\n<node pkg="nosuch_package" exec="e"/>', ":3: <node>", "not found"),
    "a file that includes itself": (
        '<include file="$(dirname)/test.launch.xml"/>', ":2: <include>", "include each other without end"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_launch_file_is_refused(
    case: str, secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    text, place, message = BAD_FILES[case]
    run = secure_launch("--secure", "--keystore", tmp_path / "ks", write(text))
    assert run.returncode == 1
    assert run.stderr.startswith("secure-launch: error: ") and "Traceback" not in run.stderr
    assert place in run.stderr and message in run.stderr
    assert run.stdout == "" and not (tmp_path / "ks").exists()


def test_an_error_in_an_included_file_shows_the_way_there(secure_launch: SecureLaunch, write: Write) -> None:
    write('<node pkg="demo_nodes" exec="talker" foo="1"/>', "inner.launch.xml")
    run = secure_launch("--dry-run", write('<include file="$(dirname)/inner.launch.xml"/>'))
    assert "inner.launch.xml:2: <node>" in run.stderr
    assert run.stderr.rstrip().endswith("test.launch.xml:2")


BAD_WORDS = {
    "--secure without a keystore": (["--secure"], 2, "give --keystore DIR or set ROS_SECURITY_KEYSTORE"),
    "a keystore that must exist": (
        ["--secure", "--keystore", "{tmp}/ks", "--no-create-keystore"], 1, "secure-keystore create"
    ),
    "a directory that is no keystore": (["--secure", "--keystore", "{tmp}/other"], 1, "is not a keystore"),
    "a keystore below a file": (["--secure", "--keystore", "{tmp}/other/file/ks"], 1, "ks"),
    "a bad domain": (["--secure", "--keystore", "{tmp}/ks", "--domain-id", "7;8"], 2, "domain ids"),
    "a bad duration": (["--secure", "--keystore", "{tmp}/ks", "--valid-for", "soon"], 2, "soon"),
    "a bad margin": (["--secure", "--keystore", "{tmp}/ks", "--warn-expiry", "soon"], 2, "not a duration"),
    "a bad filter": (["--launch-prefix", "gdb", "--launch-prefix-filter", "("], 2, "not a regular expression"),
    "a policy that is not there": (["--dry-run", "--policy", "{tmp}/nosuch.xml"], 2, "nosuch.xml"),
    "a manifest that is not there": (["--dry-run", "--nodl", "{tmp}/nosuch.nodl.xml"], 2, "nosuch.nodl.xml"),
    "an unknown subject to explain": (["--explain", "/nosuch"], 2, "'/nosuch' is not an enclave"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_WORDS)
def test_bad_options_are_refused(case: str, secure_launch: SecureLaunch, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").write_text("something else")
    words, status, message = BAD_WORDS[case]
    run = secure_launch(
        *(word.format(tmp=tmp_path) for word in words), "demo_nodes", "talker_listener.launch.xml"
    )
    assert run.returncode == status
    assert message in run.stderr and "Traceback" not in run.stderr
    assert run.stdout == "" and not (tmp_path / "ks").exists()
    assert files_below(tmp_path / "other") == {"file"}


def test_a_program_that_is_not_there_is_known_before_anything_secured_starts(
    secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    started = tmp_path / "started"
    file = write(f'<executable cmd="touch {started}"/>\n<executable cmd="no_such_program"/>')
    place = f"{file}:3: <executable> program 'no_such_program' cannot be executed"
    looked = secure_launch("--dry-run", file)
    assert (looked.returncode, f"warning: {place}" in looked.stdout) == (0, True)
    run = secure_launch("--secure", "--keystore", tmp_path / "ks", file)
    assert run.returncode == 1
    assert place in run.stderr
    assert "nothing was started" in run.stderr
    assert not started.exists()


def test_a_program_that_is_not_there_stops_an_unsecured_launch_as_little_as_it_stops_ros2_launch(
    secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    started = tmp_path / "started"
    run = secure_launch(write(f'<executable cmd="no_such_program"/>\n<executable cmd="touch {started}"/>'))
    assert run.returncode == 1
    assert "cannot start process: No such file or directory: 'no_such_program'" in run.stdout
    assert started.exists()


def test_secure_refuses_to_start_anything_when_one_node_has_no_manifest(
    secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    (prefix := tmp_path / "prefix" / "lib" / "bare").mkdir(parents=True)
    marker = tmp_path / "prefix" / "share" / "ament_index" / "resource_index" / "packages" / "bare"
    marker.parent.mkdir(parents=True)
    marker.touch()
    (prefix / "compiled").write_bytes(b"\x7fELF")
    (prefix / "compiled").chmod(0o755)
    file = write(f'{TALKER}\n<node pkg="bare" exec="compiled"/>')
    words = ("--prefix", tmp_path / "prefix", file)
    looked = secure_launch("--dry-run", *words)
    assert looked.returncode == 0 and "no NoDL manifest for bare/compiled" in looked.stdout
    refused = secure_launch("--secure", "--keystore", tmp_path / "ks", *words)
    assert refused.returncode == 1
    compiled = f"{prefix}/compiled is a compiled program"
    assert f"{file}:3: <node> no NoDL manifest for bare/compiled: {compiled}" in refused.stderr
    assert "looked for a manifest at " in refused.stderr
    assert "process started" not in refused.stdout and not (tmp_path / "ks").exists()


def test_a_plain_launch_asks_nobody_what_its_nodes_say(secure_launch: SecureLaunch, write: Write) -> None:
    file = write('<node exec="true" name="unknown_to_all"/>\n<executable cmd="echo plainly"/>')
    run = secure_launch(file)
    assert run.returncode == 0
    assert "process has finished cleanly" in run.stdout and "warning" not in run.stderr


@pytest.mark.parametrize(("scope", "shared"), [((), True), (("--enclave-scope", "node"), False)])
def test_a_secured_start_says_what_processes_gain_by_sharing_an_enclave(
    scope: tuple[str, ...],
    shared: bool,
    secure_launch: SecureLaunch,
    write: Callable[..., Path],
    tmp_path: Path,
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker"/><node pkg="demo_nodes" exec="listener"/>')
    file.write_text(file.read_text().replace("</launch>", '<shutdown reason="enough"/></launch>'))
    run = secure_launch("--secure", "--keystore", tmp_path / "ks", *scope, file)
    gains = "/listener may also publish /chatter; /talker may also subscribe /chatter"
    assert (f"enclave / is shared by 2 processes: {gains}" in run.stderr) is shared, run.stderr


def test_provisioning_alone_makes_what_a_start_would_make_and_starts_nothing(
    secure_launch: SecureLaunch, write: Callable[..., Path], tmp_path: Path
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker"/><executable cmd="touch started"/>')
    run = secure_launch("--secure", "--provision-only", "--keystore", tmp_path / "ks", file, cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "ks/enclaves/permissions.p7s").is_file()
    assert not (tmp_path / "started").exists() and "process started" not in run.stdout + run.stderr


@pytest.mark.parametrize("words", [("--provision-only",), ("--secure", "--provision-only", "--dry-run")])
def test_provisioning_alone_needs_secure_and_nothing_that_looks(
    words: tuple[str, ...], secure_launch: SecureLaunch, write: Callable[..., Path], tmp_path: Path
) -> None:
    file = write('<node pkg="demo_nodes" exec="talker"/>')
    run = secure_launch(*words, *(("--keystore", tmp_path / "ks") if "--secure" in words else ()), file)
    assert run.returncode == 2 and "--provision-only" in run.stderr
    assert not (tmp_path / "ks").exists()


def test_the_demo_of_the_package_is_shown_and_never_started(secure_launch: SecureLaunch) -> None:
    shown = secure_launch("--dry-run", "--demo")
    assert shown.returncode == 0 and "enclave /speaker" in shown.stdout and "/conversation" in shown.stdout
    for words in (["--demo"], ["--dry-run", "--demo", "other.launch.xml"]):
        assert secure_launch(*words).returncode == 2
