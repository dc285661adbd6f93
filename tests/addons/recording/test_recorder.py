"""The recorder in a process: what it notes, that it loses nothing silently, and that it never gets in the way."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from enclave_addons.recording.programs import inspect_command, recorder_library
from enclave_addons.recording.record.requested import RequestedEndpoint, RequestedNode, all_requested
from enclave_launch import RuntimeFailure
from tests.addons.recording.conftest import Recorded, RunRecorded

TALKER = "node talker\npublisher chatter std_msgs/msg/String\n"


def nodes(recorded: Recorded) -> list[RequestedNode]:
    return all_requested(recorded.record.attributed())


def own(recorded: Recorded) -> list[RequestedEndpoint]:
    return [asked for node in nodes(recorded) for asked in node.endpoints]


def said(recorded: Recorded) -> list[str]:
    return [f"{a.kind.value} {a.name} -> {a.final} {a.type}" for a in own(recorded)]


def lost(recorded: Recorded) -> list[str]:
    return [complaint.why for complaint in recorded.record.complaints]


def test_a_name_is_noted_as_it_is_written_and_as_it_becomes(run_recorded: RunRecorded) -> None:
    ran = run_recorded(
        TALKER, "--ros-args", "-r", "chatter:=/gossip", "-r", "__node:=speaker", "-r", "__ns:=/a"
    )
    assert said(ran) == ["publisher chatter -> /gossip std_msgs/msg/String"]
    assert [(node.name, node.fqn, node.library.value) for node in nodes(ran)] == [
        ("talker", "/a/speaker", "rclcpp")
    ]
    assert (ran.status, lost(ran)) == (0, [])


def test_all_six_kinds_of_endpoints(run_recorded: RunRecorded) -> None:
    script = """node n
publisher p std_msgs/msg/String
subscription s std_msgs/msg/Bool
service_server r std_srvs/srv/Empty
service_client c std_srvs/srv/Trigger
action_server as test_msgs/action/Fibonacci
action_client ac test_msgs/action/Fibonacci
"""
    assert said(run_recorded(script)) == [
        "publisher p -> /p std_msgs/msg/String",
        "subscription s -> /s std_msgs/msg/Bool",
        "service_server r -> /r std_srvs/srv/Empty",
        "service_client c -> /c std_srvs/srv/Trigger",
        "action_server as -> /as test_msgs/action/Fibonacci",
        "action_client ac -> /ac test_msgs/action/Fibonacci",
    ]


def test_an_action_that_is_not_remapped_has_the_name_of_its_parts(run_recorded: RunRecorded) -> None:
    """rcl before kilted resolves the action's name as if it were remapped."""
    ran = run_recorded("node n\naction_server act t/action/A\n", "--ros-args", "-r", "act:=moved")
    assert said(ran) == ["action_server act -> /act t/action/A"]
    assert '"name":"act","fqn":"/n","final":"/moved"' in ran.text


def test_a_name_built_from_the_nodes_own_is_private(run_recorded: RunRecorded) -> None:
    ran = run_recorded(
        "node map_server\nservice_server %n/load_map n/srv/L\n", "--ros-args", "-r", "__node:=maps"
    )
    assert said(ran) == ["service_server ~/load_map -> /maps/load_map n/srv/L"]


def test_a_lifecycle_node_is_known_with_the_states_it_reached(run_recorded: RunRecorded) -> None:
    (node,) = nodes(run_recorded("lifecycle life\nstate 1\nsubscription late a/msg/B\nstate 2\n"))
    assert (node.lifecycle, node.states) == (True, ("inactive", "active"))
    assert [asked.name for asked in node.endpoints] == ["late"]


def test_a_node_at_the_address_of_one_that_ended_is_another_node(run_recorded: RunRecorded) -> None:
    script = "node a\npublisher one t/msg/A\nend\nnode b\npublisher two t/msg/A\n"
    found = nodes(run_recorded(script))
    assert [(node.name, [asked.name for asked in node.endpoints]) for node in found] == [
        ("a", ["one"]),
        ("b", ["two"]),
    ]


def test_a_forked_child_has_lines_of_its_own(run_recorded: RunRecorded) -> None:
    ran = run_recorded("node a\npublisher one t/msg/A\nfork\npublisher two t/msg/A\n")
    parent, child = ran.record.processes
    assert child.loaded is not None
    assert (child.loaded.forked, child.loaded.parent) == (True, parent.pid)
    assert lost(ran) == []


def test_sixteen_threads_lose_nothing(run_recorded: RunRecorded) -> None:
    ran = run_recorded("node n\nmany 960 16\n")
    assert len({asked.name for asked in own(ran)}) == 960
    assert lost(ran) == []


@pytest.mark.parametrize(("end", "status"), [("abort", -6), ("kill", -9)])
def test_what_was_asked_before_a_sudden_end_is_there(
    run_recorded: RunRecorded, end: str, status: int
) -> None:
    ran = run_recorded(f"{TALKER}{end}\n")
    assert (ran.status, said(ran)) == (status, ["publisher chatter -> /chatter std_msgs/msg/String"])


@pytest.mark.parametrize("path", ["/dev/full", "/nonexistent/record", "/"])
def test_a_record_that_cannot_be_written_does_not_disturb_the_program(
    run_recorded: RunRecorded, path: str
) -> None:
    assert run_recorded(TALKER, record=Path(path)).status == 0


def test_a_program_without_free_descriptors_runs_and_the_loss_is_told(run_recorded: RunRecorded) -> None:
    ran = run_recorded("node n\nfull\npublisher one t/msg/A\nfree\npublisher two t/msg/A\n")
    assert (ran.status, [asked.name for asked in own(ran)]) == (0, ["two"])
    (why,) = lost(ran)
    assert why.startswith("1 of the lines of process ")


def test_a_limit_for_files_ends_no_program(run_recorded: RunRecorded) -> None:
    ran = run_recorded(TALKER + "many 64 1\n", command=("sh", "-c", 'ulimit -f 4; exec "$0" "$@"'))
    assert ran.status == 0
    assert len(ran.text) <= 4096 and len(own(ran)) < 65


def test_without_the_variable_the_library_does_nothing(run_recorded: RunRecorded) -> None:
    ran = run_recorded(TALKER, variables={"ENCLAVE_LAUNCH_RECORD": ""})
    assert (ran.status, ran.text) == (0, "")


def test_a_library_that_the_launch_preloads_stays(run_recorded: RunRecorded) -> None:
    from enclave_addons.recording.programs import with_recorder

    worn = with_recorder({"LD_PRELOAD": "/lib/a.so:/lib/b.so"}, "/r.so", "/record")
    assert worn["LD_PRELOAD"] == "/lib/a.so:/lib/b.so:/r.so"
    assert with_recorder(worn, "/r.so", "/record") == worn
    assert with_recorder({}, "/r.so", "/record", "libasan.so.8")["LD_PRELOAD"] == "libasan.so.8:/r.so"


def build_program(stand_in: Path, folder: Path, *flags: str) -> Path:
    source = Path(__file__).parent / "stand_in" / "program.c"
    program = folder / "built"
    command = ["cc", *flags, str(source), "-o", str(program)]
    subprocess.run([*command, f"-L{stand_in}", f"-Wl,-rpath,{stand_in}", "-lrclcpp"], check=True)
    return program


def test_a_program_with_address_sanitizer_is_recorded(
    run_recorded: RunRecorded, stand_in: Path, tmp_path: Path
) -> None:
    program = build_program(stand_in, tmp_path, "-fsanitize=address")
    sanitizer = inspect_command([str(program)]).sanitizer
    assert sanitizer is not None and sanitizer.startswith("libasan.so")
    calm = {"ASAN_OPTIONS": "detect_leaks=0"}
    ran = run_recorded(TALKER, program=program, preload=f"{sanitizer}:{{}}", variables=calm)
    assert (ran.status, len(own(ran))) == (0, 1)
    alone = run_recorded(TALKER, program=program, variables=calm)
    assert alone.status != 0 and "ASan runtime does not come first" in alone.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_program_of_another_user_is_recorded(
    recorder: Path, stand_in: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o711)
        record, library = Path(folder, "record"), Path(folder, "recorder.so")
        record.touch()
        record.chmod(0o622)
        library.write_bytes(recorder.read_bytes())
        library.chmod(0o755)
        subprocess.run(
            ["setpriv", "--reuid", "65534", "--clear-groups", "/bin/true"],
            env={
                "PATH": os.environ["PATH"],
                "LD_PRELOAD": str(library),
                "ENCLAVE_LAUNCH_RECORD": str(record),
            },
            check=True,
        )
        text = record.read_text()
    assert text.count('"what":"loaded"') == 2  # setpriv, and what it became


def test_a_static_program_is_known_before_it_starts(tmp_path: Path) -> None:
    source, program = tmp_path / "a.c", tmp_path / "a"
    source.write_text("int main(void) { return 0; }")
    for flag in ("-static", "-static-pie"):
        subprocess.run(["cc", flag, str(source), "-o", str(program)], check=True)
        assert "linked statically" in inspect_command(["nice", str(program)], os.environ["PATH"]).obstacle
    subprocess.run(["cc", str(source), "-o", str(program)], check=True)
    assert inspect_command(["nice", str(program)], os.environ["PATH"]).obstacle == ""


def test_set_uid_and_cleaned_environments_are_known_before(tmp_path: Path) -> None:
    program = tmp_path / "a"
    program.write_bytes(Path(sys.executable).read_bytes()[:4096])
    program.chmod(0o4755)
    if os.geteuid() == 0:
        os.chown(program, 65534, 65534)
        program.chmod(0o4755)
        assert "set-uid" in inspect_command([str(program)]).obstacle
    program.chmod(0o755)
    assert inspect_command([str(program)]).obstacle == ""
    assert "empty environment" in inspect_command(["/usr/bin/env", "-i", "/bin/true"]).obstacle
    assert "environment of its own" in inspect_command(["sudo", "/bin/true"]).obstacle
    assert inspect_command(["/usr/bin/env", "A=b", "/bin/true"]).obstacle == ""


def test_a_script_is_what_its_interpreter_is(tmp_path: Path) -> None:
    script = tmp_path / "s"
    script.write_text("#!/bin/sh\nexit 0\n")
    script.chmod(0o755)
    assert inspect_command([str(script)]).obstacle == ""


def test_a_machine_without_a_compiler_takes_the_recorder_of_another_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = recorder_library()
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(RuntimeFailure, match=rf"take {built.name} .* put it into {tmp_path}/enclave-launch"):
        recorder_library()
    (tmp_path / "enclave-launch").mkdir()
    shutil.copy(built, tmp_path / "enclave-launch")
    assert recorder_library() == tmp_path / "enclave-launch" / built.name
