"""--audit: what enforcement would refuse, told while nothing is enforced; and what is granted for nobody."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.addons.recording.stand_in_launch import Program, Workspace, asks, make_workspace

CHATTER = ("publisher", "chatter")
SCAN = ("subscription", "scan")
GO = ("action_client", "go")
FIT = Program("fit", f"node fit\n{asks([CHATTER, SCAN, GO])}", (CHATTER, SCAN, GO))


def audit(workspace: Workspace, *arguments: str) -> tuple[int, str, dict[str, Any]]:
    file = workspace.folder / "audit.json"
    ran = workspace.run(
        *("--audit", "--audit-report", str(file), "--enclave-scope", "node", *arguments),
        variables={"STAND_IN_CATCHES": "1"},
    )
    report = json.loads(file.read_text()) if file.exists() else {}
    return ran.returncode, ran.stdout + ran.stderr, report


def test_a_launch_that_asks_for_what_it_is_granted_passes(stand_in: Path, tmp_path: Path) -> None:
    status, output, report = audit(make_workspace(tmp_path, stand_in, [FIT]))
    assert (status, report["would_be_refused"], report["never_asked_for"]) == (0, [], [])
    assert "0 would be refused" in output


def test_what_would_be_refused_is_told_live_and_in_the_report(stand_in: Path, tmp_path: Path) -> None:
    program = Program(
        "greedy",
        f"node greedy\n{asks([CHATTER, ('service_server', '~/reset')])}",
        (CHATTER,),
        'namespace="/a"',
        '<remap from="chatter" to="gossip"/>',
    )
    status, output, report = audit(make_workspace(tmp_path, stand_in, [program]))
    assert status == 1
    (refused,) = report["would_be_refused"]
    assert {**refused, "described_by": ""} == {
        "enclave": "/a/greedy",
        "node": "/a/greedy",
        "operation": "reply",
        "name": "/a/greedy/reset",
        "written": "~/reset",
        "type": "std_srvs/srv/Empty",
        "described_by": "",
    }
    assert "[WARNING] [launch]: audit: node /a/greedy in enclave /a/greedy would serve service" in output
    assert "  would be refused: node /a/greedy" in output


def test_what_is_granted_and_never_asked_for_is_in_the_report(stand_in: Path, tmp_path: Path) -> None:
    program = Program("modest", f"node modest\n{asks([CHATTER])}", (CHATTER, SCAN, GO))
    status, output, report = audit(make_workspace(tmp_path, stand_in, [program]))
    assert status == 0
    assert report["never_asked_for"] == [
        {"enclave": "/modest", "operation": "call", "name": "/go"},
        {"enclave": "/modest", "operation": "subscribe", "name": "/scan"},
    ]
    assert "granted, never requested: subscribe to topic /scan" in output


def test_a_node_that_nobody_describes_is_audited_all_the_same(stand_in: Path, tmp_path: Path) -> None:
    program = Program("unknown", f"node unknown\n{asks([CHATTER])}", None)
    status, _, report = audit(make_workspace(tmp_path, stand_in, [program, FIT]))
    assert status == 1
    names = {row["name"] for row in report["would_be_refused"] if row["node"] == "/unknown"}
    assert "/chatter" in names and "/rosout" in names
    assert {row["node"] for row in report["would_be_refused"]} == {"/unknown"}


def test_a_process_that_cannot_be_recorded_fails_the_audit(stand_in: Path, tmp_path: Path) -> None:
    hidden = FIT._replace(attributes='launch-prefix="env -i"')
    status, output, report = audit(make_workspace(tmp_path, stand_in, [hidden]))
    assert status == 1
    (unrecorded,) = report["not_recorded"]
    assert unrecorded["process"] == "env-1" and "empty environment" in unrecorded["why"]
    assert "env-1 is not recorded" in output


def test_a_record_that_is_removed_while_it_grows_ends_no_launch(stand_in: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path, stand_in, [FIT])
    file = workspace.folder / "share/stand_in_nodes/launch/all.launch.xml"
    removes = '<executable cmd="rm $ENCLAVE_LAUNCH_RECORD" shell="true"/>'
    file.write_text(file.read_text().replace("</launch>", f"{removes}</launch>"))
    status, output, report = audit(workspace)
    assert status == 1 and "process has finished cleanly" in output
    assert "cannot be read" in output
    assert any("cannot be read" in why for why in report["incomplete"])


def test_a_program_that_writes_as_the_launcher_is_reported_and_not_believed(
    stand_in: Path, tmp_path: Path
) -> None:
    workspace = make_workspace(tmp_path, stand_in, [FIT])
    forged = [
        {"what": "process", "pid": 1, "process": "fit-1", "package": "stand_in_nodes", "executable": "fit"},
        {"what": "publisher", "pid": 1, "name": "/cmd_vel", "final": "/cmd_vel"},
    ]
    (tmp_path / "lines").write_text("".join(json.dumps(line) + "\n" for line in forged))
    script = tmp_path / "forge.sh"
    script.write_text(f"#!/bin/sh\ncat {tmp_path / 'lines'} >>$ENCLAVE_LAUNCH_RECORD\n")
    script.chmod(0o755)
    file = workspace.folder / "share/stand_in_nodes/launch/all.launch.xml"
    file.write_text(file.read_text().replace("</launch>", f'<executable cmd="{script}"/></launch>'))
    _, output, report = audit(workspace)
    assert "forge.sh-2 wrote lines about the launcher into its record; they are not used" in output
    assert any("about the launcher" in why for why in report["incomplete"])
    assert "/cmd_vel" not in json.dumps(report.get("findings", report))


def test_a_library_of_the_launch_file_stays_beside_the_recorder(stand_in: Path, tmp_path: Path) -> None:
    library = stand_in / "librcutils.so"
    preloads = FIT._replace(inside=f'<env name="LD_PRELOAD" value="{library}"/>')
    status, _, report = audit(make_workspace(tmp_path, stand_in, [preloads]))
    assert (status, report["not_recorded"], report["checked"] > 3) == (0, [], True)


def test_an_audit_is_unsecured_and_says_so_when_it_is_asked_for_both(stand_in: Path, tmp_path: Path) -> None:
    status, output, _ = audit(make_workspace(tmp_path, stand_in, [FIT]), "--secure")
    assert status == 2 and "--audit runs the launch unsecured" in output


def test_an_action_of_which_a_rule_moves_a_part_is_granted_part_by_part(
    stand_in: Path, tmp_path: Path
) -> None:
    """jazzy remaps the names below an action one by one; beside it an action that nobody was granted."""
    server = ("action_server", "go")
    program = Program(
        "mover",
        f"node mover\n{asks([server, ('action_server', 'other')])}",
        (server,),
        inside='<remap from="go/_action/send_goal" to="start"/>',
    )
    _, _, report = audit(make_workspace(tmp_path, stand_in, [program]))
    assert [each["name"] for each in report["would_be_refused"]] == ["/other"]
    assert report["never_asked_for"] == []
