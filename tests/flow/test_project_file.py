"""One ``enclaves.yaml`` gives all four commands what they need; options and the environment come before it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

DEMO = ROOT / "fixtures" / "demo_ws"
LAUNCH = ("--prefix", "ws", "demo_nodes", "talker_listener.launch.xml")
MODULES = {
    "secure-launch": "enclave_launch",
    "secure-plan": "enclave_addons.review.verb",
    "secure-keystore": "keystore.verb",
    "secure-nodl": "nodl.verb",
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the demo workspace in ``ws``; the working directory."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(DEMO / "share", tmp_path / "ws" / "share")
    shutil.copytree(DEMO / "lib", tmp_path / "ws" / "lib", symlinks=True)
    return tmp_path


def run(command: str, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command without what this machine has set for ROS."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    return subprocess.run(
        [sys.executable, "-m", MODULES[command], *words],
        env={**own, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def enclaves(answer: str) -> list[str]:
    return [line.partition("enclave ")[2].split()[0] for line in answer.splitlines() if "── enclave " in line]


def test_the_scope_of_the_file_counts_and_an_option_comes_before_it(here: Path) -> None:
    assert enclaves(run("secure-launch", "--dry-run", *LAUNCH).stdout) == ["/"]
    (here / "enclaves.yaml").write_text("enclave-scope: node\n")
    assert enclaves(run("secure-launch", "--dry-run", *LAUNCH).stdout) == ["/listener", "/talker"]
    chosen = run("secure-launch", "--dry-run", "--enclave-scope", "namespace", *LAUNCH)
    assert enclaves(chosen.stdout) == ["/"]


def test_the_file_is_found_from_below_and_in_the_workspace_of_the_launch_file(here: Path) -> None:
    (here / "ws" / "enclaves.yaml").write_text("enclave-scope: node\n")
    away = here / "elsewhere" / "deep"
    away.mkdir(parents=True)
    launch = ("--prefix", str(here / "ws"), *LAUNCH[2:])
    os.chdir(away)
    assert enclaves(run("secure-launch", "--dry-run", *launch).stdout) == ["/listener", "/talker"]
    (here / "elsewhere" / "enclaves.yaml").write_text("enclave-scope: launch\n")
    said = run("secure-plan", "show", "-v", *launch)
    assert f"configuration {here / 'ws' / 'enclaves.yaml'}: enclave-scope node" in said.stderr
    (here / "ws" / "enclaves.yaml").unlink()
    said = run("secure-plan", "show", "-v", *launch)
    assert f"configuration {here / 'elsewhere' / 'enclaves.yaml'}: enclave-scope launch" in said.stderr


def test_all_commands_take_the_keystore_of_the_file_relative_to_it(here: Path) -> None:
    (here / "enclaves.yaml").write_text("keystore: keys\n")
    (here / "below").mkdir()
    os.chdir(here / "below")
    assert run("secure-keystore", "create").returncode == 0
    assert (here / "keys" / "public").is_dir() and not (here / "below" / "keys").exists()
    assert run("secure-keystore", "create-enclave", "/a", "/b").returncode == 0
    assert run("secure-keystore", "list").stdout == "/a\n/b\n"
    assert run("secure-keystore", "renew", "/a").returncode == 0
    launch = ("--prefix", str(here / "ws"), *LAUNCH[2:])
    checked = run("secure-plan", "check", *launch)
    assert "the keystore has no permissions for enclave /" in checked.stdout
    assert run("secure-launch", "--secure", "--provision-only", *launch).returncode == 0
    assert run("secure-keystore", "list").stdout == "/\n/a\n/b\n"


def test_an_option_comes_before_the_environment_and_that_before_the_file(here: Path) -> None:
    (here / "enclaves.yaml").write_text("keystore: of_the_file\n")
    variable = {"ROS_SECURITY_KEYSTORE": "of_the_environment"}
    told = run("secure-keystore", "create", **variable)
    assert (here / "of_the_environment" / "public").is_dir() and not (here / "of_the_file").exists()
    assert "ROS_SECURITY_KEYSTORE=of_the_environment is used, not" in told.stderr
    assert run("secure-keystore", "create", "given", **variable).returncode == 0
    assert (here / "given" / "public").is_dir()


def test_a_tilde_is_the_home_and_never_a_folder_of_that_name(here: Path) -> None:
    home = here / "home"
    home.mkdir()
    for number, words in enumerate((["~/a"], [])):
        variables = {"HOME": str(home), "ROS_SECURITY_KEYSTORE": "~/b"}
        assert run("secure-keystore", "create", *words, **variables).returncode == 0
        assert (home / "ab"[number] / "public").is_dir()
    (here / "enclaves.yaml").write_text("keystore: ~/c\n")
    assert run("secure-keystore", "create", HOME=str(home)).returncode == 0
    assert (home / "c" / "public").is_dir() and not (here / "~").exists()


def test_no_keystore_named_anywhere_is_wrong_usage(here: Path) -> None:
    told = run("secure-keystore", "verify")
    assert told.returncode == 2 and "\ntry: secure-keystore verify KEYSTORE" in told.stderr


@pytest.mark.parametrize(
    "text, line",
    [
        ("keystor: ks\n", ":1: unknown key 'keystor'; did you mean 'keystore'?"),
        ("\nkeystore: 3\n", ":2: keystore: a text is expected"),
        ("accept:\n- {cod: no-server, why: x}\n", ":2: accept[0]: unknown key 'cod'; did you mean 'code'?"),
        ("enclave-scope: nod\n", "enclave-scope: 'nod' is not one of namespace, node, process, launch"),
        ("distro: jazy\n", "distro: 'jazy' is not a known distribution"),
        ("- keystore\n", ": not a mapping with the keys never, accept, keystore"),
        ("keystore: a\nkeystore: b\n", ":2: 'keystore' is written twice"),
    ],
)
def test_a_mistake_in_the_file_is_answered_with_its_line(here: Path, text: str, line: str) -> None:
    (here / "enclaves.yaml").write_text(text)
    told = run("secure-launch", "--dry-run", *LAUNCH)
    assert told.returncode == 2 and line in told.stderr
    assert len(told.stderr.splitlines()) <= 3


def test_what_init_writes_is_read_and_is_not_overwritten(here: Path) -> None:
    assert run("secure-plan", "init").returncode == 0
    assert enclaves(run("secure-launch", "--dry-run", *LAUNCH).stdout) == ["/listener", "/talker"]
    (here / "enclaves.yaml").write_text("# mine\n")
    assert run("secure-plan", "init").returncode == 2
    assert (here / "enclaves.yaml").read_text() == "# mine\n"
    assert enclaves(run("secure-launch", "--dry-run", *LAUNCH).stdout) == ["/"]


def test_findings_are_accepted_and_flows_forbidden_in_the_file(here: Path) -> None:
    launch = ("--enclave-scope", "node", *LAUNCH)
    assert run("secure-plan", "check", *launch).returncode == 0
    (here / "enclaves.yaml").write_text("never:\n- {from: /talker, to: /listener, why: example}\n")
    told = run("secure-plan", "check", *launch)
    assert told.returncode == 1 and "/talker must never reach /listener (example)" in told.stdout
    assert f"{here / 'enclaves.yaml'}:2" in told.stdout or "enclaves.yaml:2" in told.stdout
    accepted = "accept:\n- {code: flow-forbidden, why: wanted}\n"
    (here / "enclaves.yaml").write_text((here / "enclaves.yaml").read_text() + accepted)
    assert run("secure-plan", "check", *launch).returncode == 0


def test_a_file_that_anyone_may_have_written_is_refused(here: Path) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root can give a file away")
    here.chmod(0o1777)
    (here / "enclaves.yaml").write_text("enclave-scope: node\n")
    assert enclaves(run("secure-launch", "--dry-run", *LAUNCH).stdout) == ["/listener", "/talker"]
    os.chown(here / "enclaves.yaml", 12345, 12345)
    told = run("secure-launch", "--dry-run", *LAUNCH)
    assert told.returncode == 2 and "belongs to another user" in told.stderr


def test_words_may_stand_behind_options_in_every_command(here: Path) -> None:
    report = run("secure-plan", "report", *LAUNCH, "-o", "r.html", "count:=3")
    assert report.returncode == 0 and (here / "r.html").is_file()
