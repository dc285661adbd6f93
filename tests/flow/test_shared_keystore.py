"""Several launches on one keystore, as the user of the command meets them; and what a start repairs, it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from .conftest import SecureLaunch


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    bringup, navigation = tmp_path / "bringup.launch.xml", tmp_path / "navigation.launch.xml"
    bringup.write_text('<launch><executable cmd="true" enclave="/tools"/></launch>')
    navigation.write_text(
        '<launch><executable cmd="true" enclave="/tools"/><executable cmd="true" enclave="/own"/></launch>'
    )
    return bringup, navigation


def test_the_plan_says_which_enclaves_are_shared_with_whom(
    secure_launch: SecureLaunch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    bringup, navigation = files
    keystore = ("--secure", "--keystore", tmp_path / "ks")
    assert secure_launch(*keystore, bringup).returncode == 0
    told = secure_launch(*keystore, "--dry-run", navigation).stdout
    assert f"enclave /tools is shared with {bringup}" in told and "secure-keystore shares" in told
    assert "enclave /own is shared" not in told
    assert "is shared with" not in secure_launch(*keystore, "--dry-run", bringup).stdout


def test_another_robot_is_another_owner_that_takes_nothing_from_the_first(
    secure_launch: SecureLaunch, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.launch.xml"
    file.write_text(
        '<launch><arg name="robot"/><group><push_ros_namespace namespace="$(var robot)"/>'
        '<node pkg="demo_nodes" exec="talker" name="talker"/>'
        '<node pkg="demo_nodes" exec="listener" name="boss" enclave="/common"/>'
        "</group></launch>"
    )
    words = ("--secure", "--keystore", tmp_path / "ks", "--provision-only", file)
    enclaves = tmp_path / "ks" / "enclaves"

    def provisioned(*arguments: str) -> str:
        done = secure_launch(*words, *arguments)
        assert done.returncode == 0, done.stderr
        return done.stderr

    assert "/common /r1" in provisioned("robot:=r1")
    issued = (enclaves / "common" / "cert.pem").read_bytes()
    second = provisioned("robot:=r2")
    assert "left over" not in second and "revoked" not in second
    for again in ("robot:=r1", "robot:=r2"):
        said = provisioned(again)
        assert "left over" not in said and "revoked" not in said and "created" not in said
    assert (enclaves / "common" / "cert.pem").read_bytes() == issued
    together = (enclaves / "common" / "permissions.xml").read_text()
    assert "rt/r1/chatter" in together and "rt/r2/chatter" in together
    assert "rt/r2/chatter" not in (enclaves / "r1" / "permissions.xml").read_text()


def test_the_same_robot_that_needs_less_has_something_left_over(
    secure_launch: SecureLaunch, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.launch.xml"
    node = '<node pkg="demo_nodes" exec="listener" name="{0}" enclave="/{0}"/>'
    words = ("--secure", "--keystore", tmp_path / "ks", "--provision-only", file, "robot:=r1")
    file.write_text(f"<launch><arg name='robot'/>{node.format('a')}{node.format('b')}</launch>")
    assert "left over" not in secure_launch(*words).stderr
    file.write_text(f"<launch><arg name='robot'/>{node.format('a')}</launch>")
    assert "1 enclave of this launch left over, with all that was granted: /b" in secure_launch(*words).stderr
    assert "left over" not in secure_launch(*words[:-1], "robot:=r2").stderr


def test_other_arguments_that_permit_nothing_more_are_not_reported(
    secure_launch: SecureLaunch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    words = ("--secure", "--keystore", tmp_path / "ks", files[0])
    assert "is shared with" not in secure_launch(*words).stderr
    assert "is shared with" not in secure_launch(*words, "map:=office").stderr


def test_a_start_says_what_it_repairs_and_nothing_when_all_is_well(
    secure_launch: SecureLaunch, files: tuple[Path, Path], tmp_path: Path
) -> None:
    words = ("--secure", "--keystore", tmp_path / "ks", files[0])
    assert "enclave /tools" not in secure_launch(*words).stderr, "what is new is not repaired"
    assert "enclave /tools" not in secure_launch(*words).stderr
    (tmp_path / "ks/enclaves/tools/key.pem").chmod(0o644)
    said = secure_launch(*words).stderr
    assert "enclave /tools: key and certificate, permissions, old certificate revoked" in said
    assert "others could read its private key (mode 0644)" in said
    assert "enclave /tools" not in secure_launch(*words).stderr
