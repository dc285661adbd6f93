"""A process dies or its disk fails at every step: what remains is valid, or the next run completes it.

Each case runs the real code in a process of its own, up to the step; then the keystore is looked at as a
robot would find it, and the same work is done again.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from keystore import CreateOptions, Finding, LaunchHold, create_keystore, provision, status, verification
from keystore.disk import layout
from keystore.disk.register_file import read_register
from keystore.disk.view import KeystoreView
from keystore.formats.certificate import read_certificate
from tests.dds import sros2_style
from tests.keystore.fault_driver import KILLED, NAMES, REPORTED, install_fault, work
from tests.keystore.kit import contents, filled, options, policy, snapshot

HERE = Path(__file__).parents[2]
# Each enclave of a run of twelve takes the same steps: by default the first and last steps of the run and an
# even sample between are tried, with EVERY_FAULT=1 all of them (minutes).
EVERY = os.environ.get("EVERY_FAULT") == "1"
DENSE, SAMPLE = 24, 12


def run(name: str, root: Path, fault: str, at: int) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.keystore.fault_driver", name, str(root), fault, str(at)]
    return subprocess.run(command, cwd=HERE, capture_output=True, text=True)


def fork(name: str, root: Path, fault: str, at: int) -> int:
    """As ``run``, without starting an interpreter each time; returns the exit status."""
    child = os.fork()
    if child == 0:
        status = REPORTED
        try:
            install_fault(str(root), fault, at)
            work(name, root)
            status = 0
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def steps_of(name: str, root: Path) -> int:
    done = run(name, root, "none", 0)
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


def positions(total: int) -> list[int]:
    if EVERY or total <= 2 * DENSE:
        return list(range(1, total + 1))
    middle = range(DENSE // 2, total - DENSE // 2, max(1, (total - DENSE) // SAMPLE))
    return sorted({*range(1, DENSE // 2), *middle, *range(total - DENSE // 2, total + 1)})


def wrong(root: Path) -> list[Finding]:
    return [finding for finding in verification.verify(root).findings if finding.severity.fails]


def prepared(name: str, root: Path) -> None:
    """The keystore that a piece of work starts from."""
    if name == "repair":
        grants = {path: sros2_style.Grant(publish=("/chatter",)) for path in ("/", "/a", "/a/b")}
        sros2_style.create(root, 0, grants)
        return
    if name in ("renew", "remove", "start", "switch", "finish", "take over", "reduce"):
        filled(root, NAMES[:6])
    if name == "take over":
        (root / layout.REGISTER).unlink()
    if name == "share":
        first = LaunchHold(root, "/first.launch.xml")
        provision(root, [policy(one) for one in NAMES[:6]], options=options(launch=first))
        first.close()
    for earlier in {"switch": ("start",), "finish": ("start", "switch")}.get(name, ()):
        work(earlier, root)


def visible_enclaves_are_whole(root: Path) -> None:
    """A new enclave directory appears at once: whoever sees it can start with it."""
    for enclave in KeystoreView(root).enclaves():
        directory = root / layout.enclave_directory(enclave)
        for file in layout.RUNTIME_FILES:
            assert (directory / file).is_file(), f"{enclave} is visible without {file}"


@pytest.mark.parametrize(
    "name",
    [
        "create",
        "provision",
        "renew",
        "repair",
        "remove",
        "start",
        "switch",
        "finish",
        "take over",
        "reduce",
        "share",
    ],
)
def test_killed_at_every_step(tmp_path: Path, name: str) -> None:
    prepared(name, tmp_path / "start")
    if (tmp_path / "start").exists():
        shutil.copytree(tmp_path / "start", tmp_path / "count", symlinks=True)
    total = steps_of(name, tmp_path / "count")
    assert total >= 5
    for at in positions(total):
        root = tmp_path / f"at{at}"
        if (tmp_path / "start").exists():
            shutil.copytree(tmp_path / "start", root, symlinks=True)
        assert fork(name, root, "kill", at) == KILLED
        if name == "reduce":
            nothing_unrecorded_is_out(root)
        if name == "provision" and (root / "enclaves").exists():
            visible_enclaves_are_whole(root)
        keys = {path: path.read_bytes() for path in root.glob("enclaves/**/key.pem")}
        _complete(name, root)
        assert wrong(root) == [], f"after being killed at step {at} of {total} and running again"
        assert not list((root / ".staging").glob("*")), "nothing unpublished lies about"
        everything_is_on_record(root)
        # The one deletes keys, the others replace them: as was asked, or because SROS2 had left them readable.
        if name not in ("remove", "renew", "repair"):
            assert all(path.read_bytes() == content for path, content in keys.items()), "keys stay"
        shutil.rmtree(root)


def nothing_unrecorded_is_out(root: Path) -> None:
    """The moment of death itself: the register may know more than is there, never less."""
    register = read_register(root)
    assert register is not None
    for enclave in KeystoreView(root).enclaves():
        cert = (root / layout.enclave_directory(enclave) / layout.CERT).read_bytes()
        assert read_certificate(cert).serial in register.certificates


def everything_is_on_record(root: Path) -> None:
    """Whatever the step at which the run died: no certificate is out that the register does not know as the last."""
    register = read_register(root)
    assert register is not None
    for enclave in KeystoreView(root).enclaves():
        cert = (root / layout.enclave_directory(enclave) / layout.CERT).read_bytes()
        held = register.in_force(enclave)
        assert held is not None and held.serial == read_certificate(cert).serial, enclave


def _complete(name: str, root: Path) -> None:
    """Run again. A removal that got as far as deleting needs to be asked only for what is left."""
    if name != "remove":
        work(name, root)
        return
    from keystore import RemoveOptions, remove

    left = [enclave for enclave in NAMES[:2] if enclave in KeystoreView(root).enclaves()]
    if left:
        remove(root, left, options=RemoveOptions(durable=False))
    assert not set(NAMES[:2]) & set(KeystoreView(root).enclaves())


@pytest.mark.parametrize("fault", ["full", "read-only"])
@pytest.mark.parametrize("name", ["create", "provision"])
def test_a_disk_that_fails_is_reported_and_completed(tmp_path: Path, name: str, fault: str) -> None:
    total = steps_of(name, tmp_path / "count")
    for at in positions(total)[::4]:
        root = tmp_path / f"at{at}"
        outcome = fork(name, root, fault, at)
        if outcome == 0:  # it hit the tidying up, when everything was done
            assert wrong(root) == []
        else:
            assert outcome == REPORTED
        work(name, root)
        assert wrong(root) == []
        shutil.rmtree(root)


def test_the_message_of_a_full_disk(tmp_path: Path) -> None:
    done = run("provision", tmp_path / "ks", "full", 60)
    assert done.returncode == REPORTED
    assert "No space left on device" in done.stderr and "run it again" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_file_that_cannot_be_written_whole_is_never_seen(tmp_path: Path) -> None:
    """A real limit instead of an injected error: the write itself stops in the middle of a file."""
    filled(tmp_path / "ks", ["/a"])
    before = contents(tmp_path / "ks")
    program = (
        "import resource, signal, sys\n"
        "from pathlib import Path\n"
        "from tests.keystore.kit import options, policy\n"
        "from keystore.steps.provisioning import provision\n"
        "from keystore.errors import StorageError\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (900, 900))\n"
        "try:\n"
        "    provision(Path(sys.argv[1]), [policy('/a', '/other'), policy('/b')], options=options())\n"
        "except StorageError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "ks")], cwd=HERE, capture_output=True, text=True
    )
    assert "File too large" in done.stdout, done.stderr
    assert contents(tmp_path / "ks") == before
    assert wrong(tmp_path / "ks") == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_keystore_is_reported(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    root.chmod(0o555)
    done = run("provision", root, "none", 0)
    root.chmod(0o755)
    assert done.returncode == REPORTED and "Permission denied" in done.stderr


def test_sixteen_at_once_make_one_keystore(tmp_path: Path) -> None:
    """Nobody's keys are lost or mixed: all runs ask for the same enclaves, and one of them makes each."""
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from tests.keystore.kit import options, policy\n"
        "from keystore.steps.provisioning import provision\n"
        "mine = int(sys.argv[2])\n"
        "names = [f'/shared{n}' for n in range(10)] + [f'/own{mine}']\n"
        "provision(Path(sys.argv[1]), [policy(n) for n in names], options=options(lock_timeout=120))\n"
    )
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", program, str(tmp_path / "ks"), str(number)],
            cwd=HERE,
            stderr=subprocess.PIPE,
        )
        for number in range(16)
    ]
    results = [(one.communicate()[1], one.returncode) for one in runs]
    assert all(code == 0 for _, code in results), results
    assert wrong(tmp_path / "ks") == []
    assert len(status(tmp_path / "ks").enclaves) == 26


def test_a_dead_run_does_not_hold_the_lock(tmp_path: Path) -> None:
    assert fork("provision", tmp_path / "ks", "kill", 80) == KILLED
    work("provision", tmp_path / "ks")
    assert wrong(tmp_path / "ks") == []


def test_the_holder_of_the_lock_is_named(tmp_path: Path) -> None:
    from keystore import KeystoreBusyError
    from keystore.disk.lock import exclusive

    root = tmp_path / "ks"
    create_keystore(root, CreateOptions(durable=False))
    before = snapshot(root)
    with exclusive(root), pytest.raises(KeystoreBusyError, match=f"pid {os.getpid()} on") as caught:
        filled(root, ["/a"], lock_timeout=0.05)
    assert caught.value.exit_status == 75
    assert snapshot(root) == before
