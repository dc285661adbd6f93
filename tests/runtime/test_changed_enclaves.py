"""A keystore that changes while a launch uses it: what is still good starts, what is not is refused with the reason."""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import (
    LaunchPlan,
    ProvisionError,
    ResolveOptions,
    SecurityOptions,
    provision,
    resolve,
    run_async,
)
from enclave_launch.process import RemapRule, ResolvedProcess
from enclave_launch.secured import PlanProvider
from keystore import CaAccess, ProvisionOptions, Secret

DEMO = Path(__file__).parents[2] / "fixtures/demo_ws"
TALKER = '<node pkg="demo_nodes" exec="talker" name="talker"/>'
OTHER_TALKER = '<node pkg="demo_nodes" exec="talker" name="talker"><remap from="chatter" to="news"/></node>'


def plan_of(directory: Path, nodes: str) -> LaunchPlan:
    file = directory / "test.launch.xml"
    file.write_text(f"<launch>{nodes}</launch>")
    return resolve(file, options=ResolveOptions(prefixes=(DEMO,)))


@pytest.fixture
def keystore(tmp_path: Path) -> Path:
    return tmp_path / "ks"


@pytest.fixture
def running(tmp_path: Path, keystore: Path) -> PlanProvider:
    """The gate's provider of a launch whose process has been started once."""
    provider = PlanProvider(provision(plan_of(tmp_path, TALKER), keystore))
    provider.ensure(process_of(provider))
    return provider


def process_of(provider: PlanProvider) -> ResolvedProcess:
    return provider.plan.processes[0].process


def respawn(provider: PlanProvider) -> None:
    provider.ensure(process_of(provider))


def secure_keystore(*words: str) -> None:
    code = "import sys; from keystore.verb import main; sys.exit(main())"
    subprocess.run([sys.executable, "-c", code, *words], check=True, capture_output=True)


@pytest.mark.parametrize("options", [["--all"], ["--all", "--new-keys"]], ids=" ".join)
def test_renewal_by_another_tool_goes_unnoticed(
    options: list[str], running: PlanProvider, keystore: Path
) -> None:
    before = (keystore / "enclaves/cert.pem").read_bytes()
    secure_keystore("renew", str(keystore), *options)
    assert (keystore / "enclaves/cert.pem").read_bytes() != before
    respawn(running)


def test_another_launch_in_the_same_enclave_adds_its_share_and_disturbs_nobody(
    running: PlanProvider, tmp_path: Path, keystore: Path
) -> None:
    (tmp_path / "other").mkdir()
    provision(plan_of(tmp_path / "other", OTHER_TALKER), keystore)
    permissions = (keystore / "enclaves/permissions.xml").read_text()
    assert "rt/chatter" in permissions and "rt/news" in permissions
    respawn(running)


def test_the_launch_file_edited_and_started_again_while_it_runs(
    running: PlanProvider, tmp_path: Path, keystore: Path
) -> None:
    launch = provision(plan_of(tmp_path, OTHER_TALKER), keystore)
    assert "keeps what this launch no longer needs (publish /chatter)" in str(launch.report.warnings)
    respawn(running)


def test_another_launch_with_enclaves_of_its_own_does_not_disturb(
    running: PlanProvider, tmp_path: Path, keystore: Path
) -> None:
    provision(plan_of(tmp_path, OTHER_TALKER.replace("exec=", 'enclave="other" exec=')), keystore)
    respawn(running)


def unsigned_change(keystore: Path) -> None:
    """Same size, same file, and the time set back."""
    file = keystore / "enclaves/permissions.p7s"
    status = file.stat()
    file.write_bytes(file.read_bytes().replace(b"rt/chatter", b"rt/command"))
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


CHANGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "permissions, unsigned": (
        unsigned_change,
        "is no longer what was provisioned .* not in the form that is written here",
    ),
    "key readable by others": (
        lambda keystore: (keystore / "enclaves/key.pem").chmod(0o644),
        "others could read its private key",
    ),
    "key removed": (lambda keystore: (keystore / "enclaves/key.pem").unlink(), "no private key"),
    "governance removed": (
        lambda keystore: (keystore / "enclaves/governance.p7s").unlink(),
        "can no longer be read, .* not a complete keystore",
    ),
    "keystore removed": (shutil.rmtree, "can no longer be read, .* no keystore"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_what_was_changed_is_refused_and_not_repaired(
    case: str, running: PlanProvider, keystore: Path
) -> None:
    change, reason = CHANGES[case]
    assert running.granted(process_of(running)) is not None
    change(keystore)
    after = content(keystore)
    assert running.granted(process_of(running)) is None
    with pytest.raises(ProvisionError, match=reason):
        respawn(running)
    assert content(keystore) == after


def content(keystore: Path) -> dict[str, tuple[int, bytes]]:
    files = (path for path in keystore.rglob("*") if path.is_file())
    return {str(path): (path.stat().st_mode, path.read_bytes()) for path in files}


class TestLate:
    """--allow-late: the plan grows by what nobody foresaw."""

    @staticmethod
    def late(provider: PlanProvider) -> ResolvedProcess:
        first = process_of(provider)
        return first._replace(
            process_name="talker-9",
            cmd=(*first.cmd, "-r", "chatter:=news"),
            remaps=(RemapRule("chatter", "news"),),
            fqn="/late",
        )

    def test_an_enclave_in_use_gets_both_permissions(self, running: PlanProvider, keystore: Path) -> None:
        running.ensure_late(self.late(running))
        permissions = (keystore / "enclaves/permissions.xml").read_text()
        assert "rt/chatter" in permissions and "rt/news" in permissions
        respawn(running)

    def test_respawning_it_does_not_let_the_plan_grow(self, running: PlanProvider) -> None:
        late = self.late(running)
        for _ in range(3):
            running.ensure_late(late)
        assert len(running.plan.processes) == 2

    def test_an_enclave_that_was_tampered_with_is_not_repaired_by_extending_it(
        self, running: PlanProvider, keystore: Path
    ) -> None:
        unsigned_change(keystore)
        with pytest.raises(ProvisionError, match="is no longer what was provisioned"):
            running.ensure_late(self.late(running))
        with pytest.raises(ProvisionError, match="is no longer what was provisioned"):
            respawn(running)


def test_no_process_sees_the_passphrase_that_the_keystore_was_opened_with(
    tmp_path: Path, keystore: Path, monkeypatch: pytest.MonkeyPatch, ros_log_dir: Path
) -> None:
    monkeypatch.setenv("CA_WORD", "open sesame")
    access = CaAccess(passphrase=Secret(variable="CA_WORD"))
    plan = plan_of(tmp_path, '<executable cmd="env" enclave="/tool" output="screen"/>')
    launch = provision(plan, keystore, options=SecurityOptions(keystore=ProvisionOptions(access=access)))
    seen = io.StringIO()
    with contextlib.redirect_stdout(seen):
        assert asyncio.run(run_async(launch)) == 0
    assert "ROS_SECURITY_ENCLAVE_OVERRIDE=/tool" in seen.getvalue()
    assert "sesame" not in seen.getvalue() and os.environ["CA_WORD"] == "open sesame"
