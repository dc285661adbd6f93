"""The GitHub Action and the pre-commit hook: their own steps, run as their runners would run them."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml

ROOT = Path(__file__).parent.parent.parent
PREFIX = str(ROOT / "fixtures" / "demo_ws")
ACTION: dict[str, Any] = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = {step["name"]: step for step in ACTION["runs"]["steps"]}
(HOOK,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
COMMANDS = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
NODE = '<node pkg="demo_nodes" exec="{}" name="{}"/>'


class Ran(NamedTuple):
    status: int
    said: str
    outputs: dict[str, str]
    summary: str


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A talker and, in the work tree only, a listener."""
    folder = tmp_path / "repository"
    folder.mkdir()
    file = folder / "robot.launch.xml"
    git = ["git", "-c", "user.name=t", "-c", "user.email=t@example.org", "-C", str(folder)]
    subprocess.run([*git, "init", "-q"], check=True)
    file.write_text(f"<launch>{NODE.format('talker', 'talker')}</launch>")
    subprocess.run([*git, "add", "-A"], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "one"], check=True)
    file.write_text(
        f"<launch>{NODE.format('talker', 'talker')}{NODE.format('listener', 'listener')}</launch>"
    )
    return folder


def step(name: str, folder: Path, commands: str = COMMANDS, **inputs: str) -> Ran:
    """The step's own script, in the shell and with the options that GitHub gives it."""
    given = {key: str(value.get("default", "")) for key, value in ACTION["inputs"].items()}
    given.update(
        {"options": f"--prefix\n{PREFIX}", **{key.replace("_", "-"): value for key, value in inputs.items()}}
    )
    environment = {
        key: re.sub(r"\$\{\{ inputs\.([a-z-]+) \}\}", lambda match: given[match[1]], value)
        for key, value in STEPS[name]["env"].items()
    }
    files = {key: folder.parent / key for key in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
    for file in files.values():
        file.write_text("")
    done = subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", STEPS[name]["run"]],
        cwd=folder,
        env={**os.environ, "PATH": commands, "RUNNER_TEMP": str(folder.parent), **environment,
             **{key: str(file) for key, file in files.items()}},
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    outputs = dict(line.split("=", 1) for line in files["GITHUB_OUTPUT"].read_text().splitlines())
    return Ran(done.returncode, done.stdout + done.stderr, outputs, files["GITHUB_STEP_SUMMARY"].read_text())


def test_check_leaves_plan_sarif_and_report(repository: Path) -> None:
    ran = step("check", repository, launch="robot.launch.xml")
    assert ran.status == 0, ran.said
    assert json.loads(Path(ran.outputs["plan"]).read_text())["version"] == 1
    assert json.loads(Path(ran.outputs["sarif"]).read_text())["version"] == "2.1.0"
    assert "<!DOCTYPE html>" in Path(ran.outputs["report"]).read_text()
    assert "1 enclave-shared" in ran.summary and set(ran.outputs) == {"plan", "sarif", "report"}
    assert set(ran.outputs) | {"rights-grew"} == set(ACTION["outputs"])


def test_check_fails_for_what_check_fails_for(repository: Path) -> None:
    assert step("check", repository, launch="robot.launch.xml", strict="true").status == 1
    (repository / "rules.yaml").write_text("never: [{from: /talker, to: /listener}]\n")
    ran = step("check", repository, launch="robot.launch.xml", expect="rules.yaml")
    assert ran.status == 1 and "[flow-forbidden]" in ran.summary and "sarif" in ran.outputs
    assert step("check", repository, launch="absent.launch.xml").status == 2


def test_diff_tells_what_a_change_adds(repository: Path) -> None:
    ran = step("diff", repository, launch="robot.launch.xml", before="HEAD:")
    assert (ran.status, ran.outputs) == (0, {"rights-grew": "true"}), ran.said
    assert "**Rights grew.**" in ran.summary and "+ node /listener" in ran.summary
    assert (
        step(
            "diff", repository, launch="robot.launch.xml", before="HEAD:", fail_when_rights_grow="true"
        ).status
        == 1
    )
    same = step(
        "diff", repository, launch="robot.launch.xml", before="robot.launch.xml", fail_when_rights_grow="true"
    )
    assert (same.status, same.outputs) == (0, {"rights-grew": "false"})
    assert step("diff", repository, launch="robot.launch.xml", before="nosuch:").status == 2


def test_arguments_of_the_launch_reach_it(repository: Path) -> None:
    node = NODE.format("talker", "$(var who)")
    (repository / "named.launch.xml").write_text(f'<launch><arg name="who"/>{node}</launch>')
    ran = step("check", repository, launch="named.launch.xml who:=someone")
    assert [node["fqn"] for node in json.loads(Path(ran.outputs["plan"]).read_text())["nodes"]] == [
        "/someone"
    ]


def test_a_path_with_a_blank_is_given_on_lines(repository: Path) -> None:
    (repository / "robot.launch.xml").rename(repository / "my robot.launch.xml")
    node = NODE.format("talker", "$(var who)")
    (repository / "my robot.launch.xml").write_text(f'<launch><arg name="who"/>{node}</launch>')
    ran = step(
        "check", repository, launch="my robot.launch.xml\nwho:=someone\n", options=f"--prefix\n{PREFIX}"
    )
    assert ran.status == 0, ran.said
    assert step("check", repository, launch="my robot.launch.xml who:=someone").status == 2


@pytest.mark.parametrize(
    "hostile", ["$(touch broken)", "`touch broken`", "; touch broken", "* ${IFS}touch", "a & b"]
)
def test_no_input_becomes_a_command(repository: Path, hostile: str) -> None:
    """What the scripts call is a program that notes its words: they arrive as they were given."""
    (repository / "bin").mkdir()
    stand_in = repository / "bin" / "secure-plan"
    stand_in.write_text('#!/bin/sh\nprintf "%s\\n" "$@" >> "$RUNNER_TEMP/words"\n')
    stand_in.chmod(0o755)
    for name in ("check", "diff"):
        given = dict.fromkeys(("launch", "before", "expect", "keystore", "options"), hostile)
        step(name, repository, commands=f"{repository / 'bin'}{os.pathsep}{COMMANDS}", **given)
    words = (repository.parent / "words").read_text().splitlines()
    assert not (repository / "broken").exists()
    assert {hostile, *hostile.split()} <= set(words) and "robot.launch.xml" not in words


def test_inputs_stand_in_no_script() -> None:
    assert not [step["name"] for step in STEPS.values() if "${{" in step["run"]]
    declared = {name for step in STEPS.values() for name in re.findall(r"inputs\.([a-z-]+)", str(step))}
    assert declared == set(ACTION["inputs"])


def test_the_action_installs_this_project() -> None:
    assert '"${GITHUB_ACTION_PATH}[cpp]"' in STEPS["install"]["run"]
    assert (ROOT / "pyproject.toml").is_file(), "the path of the action is the folder of action.yml"


@pytest.mark.parametrize(
    ("file", "is_seen"),
    [
        ("launch/robot.launch.xml", True), ("robot.launch.py", True), ("a.launch.yml", True), ("x.nodl.yaml", True),
        ("enclaves.review.yaml", True), ("launch.md", False), ("src/launch.py", False),
        ("my_enclaves.review.yaml", False),
    ],
)  # fmt: skip
def test_the_hook_runs_for_what_can_change_a_plan(file: str, is_seen: bool) -> None:
    assert bool(re.search(HOOK["files"], file)) is is_seen


def test_the_hook_checks_what_its_arguments_name(repository: Path) -> None:
    """As pre-commit runs a hook of language python: the entry's words, then args; no file names."""
    assert HOOK["pass_filenames"] is False and HOOK["language"] == "python"

    def run(*arguments: str) -> int:
        command = [*shlex.split(HOOK["entry"]), "--prefix", PREFIX, *arguments]
        environment = {**os.environ, "PATH": COMMANDS}
        return subprocess.run(
            command, cwd=repository, env=environment, capture_output=True, check=False
        ).returncode

    assert run("robot.launch.xml") == 0
    assert run("robot.launch.xml", "--strict") == 1
    assert run("absent.launch.xml") == 2
