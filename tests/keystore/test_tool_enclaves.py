"""``secure-keystore tool-enclave``: short-lived, below /tools, exactly what the table says."""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

import keystore
from keystore import Role, Step, create_tool_enclave, list_enclaves, provision, roll_over, verify
from keystore.formats.tool_needs import TABLE, TOOLS, ToolTarget, tool_policy, tool_targets
from keystore.verb import main
from tests.keystore.kit import options, policy

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"
DOCS = Path(__file__).parents[2] / "docs" / "running-systems.md"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    keystore.create_keystore(tmp_path / "ks")
    return tmp_path / "ks"


def test_it_ends_after_a_working_day_unless_asked_otherwise(root: Path) -> None:
    now = datetime.now(timezone.utc)
    assert now + timedelta(hours=7) < create_tool_enclave(root, "list").ends < now + timedelta(hours=9)
    assert main(["tool-enclave", str(root), "--for", "list", "--valid-for", "30m"]) == 0
    assert create_tool_enclave(root, "echo", ["/x"]).ends > now + timedelta(hours=7)


def test_the_line_says_how_to_use_it_and_how_to_take_it_back(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tool-enclave", str(root), "--for", "echo", "/front/scan"]) == 0
    first, use, back = capsys.readouterr().out.splitlines()
    assert first.startswith("/tools/echo/front/scan: until ")
    assert (
        f"ROS_SECURITY_KEYSTORE={root} ROS_SECURITY_ENCLAVE_OVERRIDE=/tools/echo/front/scan ros2 topic" in use
    )
    assert main(back.split(": ", 1)[1].split()[1:]) == 0
    assert "removed /tools/echo/front/scan" in capsys.readouterr().out


def test_its_permissions_as_json(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tool-enclave", str(root), "--for", "param", "talker", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["enclave"] == "/tools/param/talker"
    requests = {each.split()[1] for each in document["permissions"] if each.startswith("request ")}
    assert requests == {
        f"/talker/{service}"
        for service in ("describe_parameters", "get_parameter_types", "get_parameters", "list_parameters",
                        "set_parameters", "set_parameters_atomically")
    }  # fmt: skip


def test_made_again_for_another_target_the_first_right_is_gone(root: Path) -> None:
    create_tool_enclave(root, "echo", ["/a", "/b"], name="/tools/mine")
    again = create_tool_enclave(root, "echo", ["/b"], name="/tools/mine")
    (profile,) = again.policy.profiles
    assert {rule.expression for rule in profile.rules if rule.operation.value == "subscribe"} == {"/b"}
    assert keystore.verify(root).findings is not None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--for", "echo"], "--for echo needs the TOPIC that it works on"),
        (["--for", "list", "/x"], "it takes no target"),
        (["--for", "echo", "/*"], "without wildcards"),
        (["--for", "echo", "/a//b"], "a//b"),
        (["--for", "nothing"], "is not a tool we know; choose from observe, list"),
        (["--for", "list", "--name", "/talker"], "enclaves of tools are below /tools/"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_made(
    root: Path, capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    assert main(["tool-enclave", str(root), *words]) == 2
    assert says in capsys.readouterr().err
    assert keystore.list_enclaves(root) == []


@pytest.mark.parametrize("tool", TABLE, ids=[tool.name for tool in TABLE])
def test_no_tool_gets_more_than_its_own_names_its_target_and_what_every_node_has(tool: object) -> None:
    kind = TOOLS[tool.name]  # type: ignore[attr-defined]
    targets = () if kind.target is ToolTarget.NOTHING else ("/robot/it",)
    for profile in tool_policy(kind, tool_targets(kind, targets), "/tools/x").profiles:
        for rule in profile.rules:
            own = kind.node and rule.expression.startswith(f"{kind.node}/")
            assert (
                own
                or rule.expression.startswith("/robot/it")
                or (rule.operation, rule.expression) in kind.own
            )


def test_a_recorder_gets_exactly_the_topics_that_a_launch_publishes(
    root: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(DEMO))
    plan = ["--plan", "demo_nodes", "talker_listener.launch.xml"]
    assert main(["tool-enclave", str(root), "--for", "record", *plan, "--format", "json"]) == 0
    made = json.loads(capsys.readouterr().out)
    subscribed = {each.split()[1] for each in made["permissions"] if each.startswith("subscribe ")}
    assert "/chatter" in subscribed and not any("*" in name for name in subscribed)
    assert made["command"].rpartition("ros2 bag record ")[2].split() == sorted(subscribed), "to be copied"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["record", "--all"], "--plan PACKAGE LAUNCH_FILE"),
        (["record", "-a"], "--plan PACKAGE LAUNCH_FILE"),
        (
            ["pub", "--plan", "demo_nodes", "talker_listener.launch.xml"],
            "--plan is for tools that read topics",
        ),
        (["record", "--plan", "no_such_package", "x.launch.xml"], "--plan no_such_package x.launch.xml: "),
    ],
)
def test_what_no_tool_is_given(
    root: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    told: str,
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(DEMO))
    assert main(["tool-enclave", str(root), "--for", *words]) == 2
    assert told in capsys.readouterr().err and list_enclaves(root) == []


def test_a_command_names_all_its_targets(root: Path) -> None:
    assert create_tool_enclave(root, "record", ["/a", "/b"]).command.endswith("ros2 bag record /a /b")
    assert create_tool_enclave(root, "play", ["/a", "/b"]).command.endswith("--topics /a /b")


def test_the_documentation_shows_the_table() -> None:
    shown = DOCS.read_text(encoding="utf-8")
    for tool in TABLE:
        assert f"| `{tool.name}" in shown, tool.name


def test_the_help_names_every_tool() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "keystore.verb", "tool-enclave", "-h"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert all(f"  {tool.name} " in ran.stdout for tool in TABLE)


def test_it_follows_a_new_ca_for_what_is_left_of_its_life_and_an_ended_one_goes(tmp_path: Path) -> None:
    start = datetime(2030, 1, 1, tzinfo=timezone.utc)
    later = start + timedelta(hours=5)
    root = tmp_path / "ks"
    provision(root, [policy("/robot")], options=options(now=start))
    ended = create_tool_enclave(root, "list", options=options(now=start, lifetime=timedelta(hours=1)))
    alive = create_tool_enclave(root, "echo", ["/x"], options=options(now=start, lifetime=timedelta(hours=8)))
    roll_over(root, Step.START, tuple(Role), options=options(now=later))
    report = roll_over(root, Step.SWITCH, tuple(Role), options=options(now=later))
    assert list_enclaves(root) == ["/robot", alive.enclave]
    assert f"removed {ended.enclave}: made for tools, and ended" in report.created
    assert report.validities[alive.enclave].not_after == alive.ends
    assert verify(root, now=later).is_good
    roll_over(root, Step.FINISH, tuple(Role), options=options(now=later))
    assert verify(root, now=later).is_good
