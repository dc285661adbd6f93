"""A slip that would change nothing but the outcome is said; the same without the slip is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.review.verb.judging import expectations
from enclave_launch import ResolveOptions, UsageError, provision, resolve
from keystore import create_tool_enclave
from nodl.errors import NoManifestError
from nodl.lookup import ManifestLookup

from .conftest import DEMO, SecureLaunch

TALKER = '<launch><node pkg="demo_nodes" exec="talker" name="talker"/></launch>'


def test_a_folder_named_for_its_manifests_that_has_none(tmp_path: Path, secure_launch: SecureLaunch) -> None:
    (tmp_path / "a.launch.xml").write_text(TALKER)
    (tmp_path / "empty").mkdir()
    told = secure_launch("--dry-run", "--nodl", tmp_path / "empty", tmp_path / "a.launch.xml")
    assert told.returncode == 2 and "empty: no manifest in this folder" in told.stderr
    with pytest.raises(NoManifestError):
        ManifestLookup((), [tmp_path / "empty"])
    assert secure_launch("--dry-run", "--nodl", DEMO, tmp_path / "a.launch.xml").returncode == 0


def test_a_code_to_accept_that_no_finding_has(tmp_path: Path) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text("accept:\n- {code: flow-forbidden, why: known}\n")
    assert expectations(rules).accept
    rules.write_text("accept:\n- {code: flow-forbiden, why: known}\n")
    with pytest.raises(
        UsageError, match=r"no finding with the code 'flow-forbiden'; did you mean 'flow-forbidden'"
    ):
        expectations(rules)


@pytest.mark.parametrize("given, is_told", [("robto", True), ("robot", False), ("use_sim_time", False)])
def test_an_argument_of_an_include(tmp_path: Path, given: str, is_told: bool) -> None:
    (tmp_path / "inner.launch.xml").write_text('<launch><arg name="robot" default="r1"/></launch>')
    outer = tmp_path / "outer.launch.xml"
    outer.write_text(
        f'<launch><include file="{tmp_path}/inner.launch.xml"><arg name="{given}" value="r2"/></include></launch>'
    )
    warnings = [str(each) for each in resolve(outer).warnings]
    told = [each for each in warnings if "does not declare; did you mean 'robot'" in each]
    assert bool(told) is is_told
    assert all(f"{outer}:1" in each for each in told)


@pytest.mark.parametrize("distro, is_told", [("foxy", True), ("humble", False)])
def test_an_unknown_distribution_at_a_plain_start(
    tmp_path: Path, secure_launch: SecureLaunch, monkeypatch: pytest.MonkeyPatch, distro: str, is_told: bool
) -> None:
    file = tmp_path / "a.launch.xml"
    file.write_text('<launch><executable cmd="true"/></launch>')
    monkeypatch.setenv("ROS_DISTRO", distro)
    told = secure_launch(file)
    assert ("is not a known distribution" in told.stdout + told.stderr) is is_told


@pytest.mark.parametrize("topic, is_told", [("/chater", True), ("/chatter", False)])
def test_a_topic_for_a_tool_that_no_enclave_may_use(tmp_path: Path, topic: str, is_told: bool) -> None:
    file = tmp_path / "a.launch.xml"
    file.write_text(TALKER)
    provision(resolve(file, options=ResolveOptions(prefixes=(DEMO,))), tmp_path / "ks")
    warnings = create_tool_enclave(tmp_path / "ks", "echo", [topic]).report.warnings
    told = [each for each in warnings if "no enclave of this keystore may use" in each and topic in each]
    assert bool(told) is is_told
    assert all("did you mean '/chatter'" in each for each in told)
