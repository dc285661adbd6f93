"""What an ``executable`` gets: the enclave that it names, or an environment in which none can be found."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import DEMO, SecureLaunch

Write = Callable[..., Path]
TALKER = DEMO / "lib/demo_nodes/talker"


@pytest.mark.parametrize(
    ("cmd", "shell", "enclave"),
    [
        ("prog --ros-args --enclave /other", "false", "/other"),
        ("prog --ros-args -e /a -r x:=y --enclave /b", "false", "/b"),
        ("nice -n 5 prog --ros-args --enclave /other", "false", "/other"),
        ("prog --ros-args --enclave /other", "true", "/other"),
        ("prog --enclave /other", "false", None),
        ("prog --ros-args -- --enclave /other", "false", None),
    ],
)
def test_the_enclave_among_its_ros_arguments_is_read_as_of_nodes(
    cmd: str, shell: str, enclave: str | None, secure_launch: SecureLaunch, write: Write
) -> None:
    run = secure_launch("--dry-run", "--format", "json", write(f'<executable cmd="{cmd}" shell="{shell}"/>'))
    document = json.loads(run.stdout)
    assert document["processes"][0]["enclave"] == enclave
    assert list(document["enclaves"]) == ([enclave] if enclave else [])


def test_its_arguments_win_over_the_attribute_and_that_is_told(
    secure_launch: SecureLaunch, write: Write
) -> None:
    file = write('<executable cmd="prog --ros-args --enclave /mine" enclave="/other"/>')
    tree = secure_launch("--dry-run", file).stdout
    assert "enclave /mine" in tree and "enclave attribute '/other' is not used" in tree


@pytest.mark.dds
@pytest.mark.parametrize("strategy", ["Enforce", "Permissive"])
def test_a_ros_program_without_one_cannot_join(
    strategy: str, secure_launch: SecureLaunch, write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A secured talker makes the keystore have ``/``, where such a program used to join."""
    monkeypatch.setenv("ROS_SECURITY_ENCLAVE_OVERRIDE", "/")
    file = write(
        f"<executable cmd=\"'{TALKER}'\"/>\n"
        '<node pkg="demo_nodes" exec="talker" name="n"><param name="seconds" value="2"/></node>'
    )
    run = secure_launch("--secure", "--keystore", "ks", "--strategy", strategy, file)
    own = [line for line in run.stdout.splitlines() if line.startswith("[talker-1]")]
    assert run.returncode == 1 and any("an_executable_without_an_enclave" in line for line in own), own
    assert not any("Publishing" in line for line in own)
