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
