"""What a person asked for and would not get is told before anything starts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import SecureLaunch

Write = Callable[..., Path]

FORGOTTEN_SECURE = {
    "the keystore": ("--keystore", "ks"),
    "the default strategy, written out": ("--strategy", "Enforce"),
    "a policy": ("--policy", "/does/not/exist"),
    "several": ("--keystore", "ks", "--strategy", "Enforce", "--policy", "/does/not/exist"),
    "domains": ("--domain-id", "0"),
    "validity": ("--valid-for", "90d"),
    "a passphrase": ("--ca-passphrase-env", "SECRET"),
    "late actions": ("--allow-late",),
    "a manifest": ("--nodl", "x.nodl.xml"),
    "a scope": ("--enclave-scope", "node"),
}


@pytest.mark.parametrize("case", FORGOTTEN_SECURE)
def test_an_option_of_secured_launches_is_not_passed_over_without_secure(
    case: str, secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    run = secure_launch(*FORGOTTEN_SECURE[case], write(f'<executable cmd="touch {tmp_path}/started"/>'))
    assert (run.returncode, (tmp_path / "started").exists()) == (2, False)
    assert FORGOTTEN_SECURE[case][0] in run.stderr and "--secure" in run.stderr


LOOKING = {
    "a format starts no robot": (("--format", "json"), "--dry-run"),
    "nor the default format": (("--format", "tree"), "--dry-run"),
    "an explanation has one format": (("--dry-run", "--format", "json", "--explain", "/"), "--format"),
    "two views at once": (("--explain", "/", "--dump-params"), "give one of them"),
    "arguments and description": (("-s", "-p"), "give one of them"),
    "an explanation of nothing, as of an unset variable": (("--explain", ""), "needs the name"),
}


@pytest.mark.parametrize("case", LOOKING)
def test_an_option_for_looking_that_shows_nothing_is_wrong_usage(
    case: str, secure_launch: SecureLaunch, write: Write, tmp_path: Path
) -> None:
    words, message = LOOKING[case]
    run = secure_launch(*words, write(f'<executable cmd="touch {tmp_path}/started"/>'))
    assert (run.returncode, run.stdout, (tmp_path / "started").exists()) == (2, "", False)
    assert message in run.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("--dry-run", "--secure", "--keystore", "ks", "--valid-for", "90d"),
        ("--dry-run", "--format", "json", "--enclave-scope", "node"),
        ("--dump-params", "--missing-nodl", "error"),
        ("--dry-run", "-n", "-d"),
    ],
)
def test_a_command_line_with_dry_run_added_stays_right(
    words: tuple[str, ...], secure_launch: SecureLaunch
) -> None:
    assert secure_launch(*words, "demo_nodes", "talker_listener.launch.xml").returncode == 0


def test_an_unsecured_run_says_so_in_one_line(
    secure_launch: SecureLaunch, write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", "/somewhere")  # asks for nothing by itself
    file = write('<executable cmd="true"/>')
    run = secure_launch(file)
    assert run.returncode == 0
    (line,) = [line for line in run.stderr.splitlines() if line.startswith("secure-launch: ")]
    assert line.startswith("secure-launch: unsecured: ")
    assert "secure-launch: unsecured" not in secure_launch("--secure", "--keystore", "ks", file).stderr
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    assert "each follows the ROS_SECURITY_ variables it has" in secure_launch(file).stderr


def test_a_permissive_start_says_what_that_means_each_time(secure_launch: SecureLaunch, write: Write) -> None:
    file = write('<executable cmd="true"/>')
    words = ("--secure", "--keystore", "ks", "--strategy")
    for _ in range(2):
        run = secure_launch(*words, "Permissive", file)
        assert run.returncode == 0 and "then runs unsecured" in run.stderr
    assert "then runs unsecured" not in secure_launch(*words, "Enforce", file).stderr
