"""The workflows run what the project says of itself: its versions of Python, its commands, no stored secret."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
WORKFLOWS = {
    file.stem: yaml.safe_load(file.read_text(encoding="utf-8"))
    for file in (ROOT / ".github" / "workflows").glob("*.yml")
}


def steps(workflow: dict[str, Any]) -> list[dict[str, Any]]:
    return [step for job in workflow["jobs"].values() for step in job["steps"]]


def test_each_python_of_the_classifiers_is_tested() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    named = re.findall(r'"Programming Language :: Python :: (3\.\d+)"', text)
    assert WORKFLOWS["ci"]["jobs"]["python"]["strategy"]["matrix"]["python"] == named


def test_actions_have_a_version_and_only_what_publishes_may_write() -> None:
    for name, workflow in WORKFLOWS.items():
        assert workflow["permissions"] == {"contents": "read"}, name
        for step in steps(workflow):
            assert "uses" not in step or "@" in step["uses"], step
            assert "secrets." not in str(step), "trusted publishing stores no token"
    writing = {name for name, job in WORKFLOWS["release"]["jobs"].items() if "permissions" in job}
    assert writing == {"publish", "github"}


def test_what_is_published_was_checked_and_installed_first() -> None:
    jobs = WORKFLOWS["release"]["jobs"]
    assert jobs["publish"]["needs"] == "wheel" and jobs["wheel"]["needs"] == "build"
    commands = " ".join(step.get("run", "") for step in jobs["build"]["steps"])
    assert "twine check --strict" in commands and "check-wheel-contents" in commands and "sbom" in commands
    assert {"ubuntu:22.04", "ubuntu:24.04", "ubuntu:26.04"} <= set(
        jobs["wheel"]["strategy"]["matrix"]["image"]
    )
