"""A launcher that runs other people's code never holds the passphrase: another process has it, and gets plans."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from keystore import (
    CaAccess,
    Domains,
    EnclavePolicy,
    InvalidInputError,
    LaunchHold,
    ProvisionOptions,
    Secret,
    SigningUnavailableError,
    provision,
    verify,
)
from keystore.steps import signing_process
from keystore.steps.signing_process import SigningProcess
from tests.keystore.kit import actions, created, options, policy

WORD = "open sesame"


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CA_WORD", WORD)
    return created(tmp_path / "ks", access=CaAccess(Secret(variable="CA_WORD")), encrypt_ca_keys=True)


def started(root: Path, variable: str = "CA_WORD") -> ProvisionOptions:
    """Options whose signing is done elsewhere; they know no passphrase."""
    asked = options(access=CaAccess(passphrase=Secret(variable=variable)))
    return options(signing=SigningProcess.start(root, asked))


def own_environment() -> bytes:
    return Path("/proc/self/environ").read_bytes()


def test_it_signs_what_this_process_cannot(root: Path) -> None:
    chosen = started(root)
    report = provision(root, [policy("/a"), policy("/b", "/x")], options=chosen)
    assert actions(report) == {"/a": ("created",), "/b": ("created",)} and report.validities
    assert verify(root).is_good
    assert not provision(root, [policy("/a"), policy("/b", "/x")], options=chosen).changed
    more = policy("/a", "/chatter", "/more")
    assert actions(provision(root, [more], options=chosen)) == {"/a": ("permissions",)}
    with pytest.raises(SigningUnavailableError, match="is encrypted"):
        provision(root, [policy("/c")], options=options())


def test_the_passphrase_is_nowhere_here_any_more(root: Path) -> None:
    chosen = started(root)
    assert "CA_WORD" not in os.environ and WORD.encode() not in own_environment()
    assert provision(root, [policy("/a")], options=chosen).changed


def test_the_same_document_is_signed_as_here(root: Path, tmp_path: Path) -> None:
    """What goes over as data comes out the same: domains of their own, shares of a launch."""
    here = created(tmp_path / "here")
    for place, chosen in ((root, started(root)), (here, options())):
        hold = LaunchHold(place, "/a.launch.xml")
        wanted = chosen._replace(
            launch=hold, domains=Domains.parse("0,7"), enclave_domains={"/a": Domains.parse("7")}
        )
        provision(place, [policy("/a", "/chatter", "/more"), policy("/b")], options=wanted)
        assert not provision(place, [policy("/a", "/chatter", "/more"), policy("/b")], options=wanted).changed
    for name in ("a", "b"):
        mine, theirs = ((one / f"enclaves/{name}/permissions.xml").read_text() for one in (here, root))
        assert mine.partition("<allow_rule>")[2] == theirs.partition("<allow_rule>")[2] != ""
    shares = [sorted((one / "private/shares").glob("*.json")) for one in (here, root)]
    assert [one.read_bytes() for one in shares[0]] == [one.read_bytes() for one in shares[1]]


def test_a_launch_alone_may_take_away_what_it_no_longer_asks_for(root: Path) -> None:
    for topics in (("/chatter", "/more"), ("/chatter",)):
        hold = LaunchHold(root, "/a.launch.xml")
        provision(root, [policy("/a", *topics)], options=started_again(root)._replace(launch=hold))
        hold.close()
    assert "rt/more" not in (root / "enclaves/a/permissions.xml").read_text()


def started_again(root: Path) -> ProvisionOptions:
    os.environ["CA_WORD"] = WORD
    return started(root)


def test_errors_are_those_of_the_keystore(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = started(root)
    with pytest.raises(InvalidInputError, match="is given twice"):
        provision(root, [EnclavePolicy("/a", ()), EnclavePolicy("/a", ())], options=chosen)
    monkeypatch.setenv("WRONG", "sesame")
    with pytest.raises(SigningUnavailableError, match="is the passphrase right") as told:
        provision(root, [policy("/a")], options=started(root, "WRONG"))
    assert "sesame" not in str(told.value)
    with pytest.raises(InvalidInputError, match="not set"):
        provision(root, [policy("/a")], options=started(root, "NOWHERE"))


@pytest.mark.parametrize(
    "sent", [{}, [], {"do": "sign"}, {"do": "provision", "enclaves": [["/a", "{}"]]}, None]
)
def test_what_is_no_plan_is_refused_and_the_next_is_signed(root: Path, sent: object) -> None:
    chosen = started(root)
    assert isinstance(chosen.signing, SigningProcess)
    channel: socket.socket = chosen.signing._channel
    signing_process._send(channel, sent, None)
    answer, _ = signing_process._receive(channel)
    assert "error" in answer
    assert provision(root, [policy("/a")], options=chosen).changed


def test_it_ends_with_its_launcher(root: Path) -> None:
    chosen = started(root)
    assert isinstance(chosen.signing, SigningProcess)
    chosen.signing._channel.close()
    with pytest.raises(SigningUnavailableError, match="has ended"):
        provision(root, [policy("/a")], options=chosen)


@pytest.mark.skipif(sys.platform != "linux", reason="prctl(2) is Linux's")
@pytest.mark.parametrize("reads", [True, False], ids=["reads a secret", "reads none"])
def test_a_process_that_reads_a_secret_leaves_no_core_dump(reads: bool, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("of the CA\n")
    program = f"""
import ctypes, pathlib
from keystore import Secret
secret = Secret(file=pathlib.Path({str(tmp_path / "secret")!r}))
if {reads}:
    secret.value()
print(ctypes.CDLL(None).prctl(3, 0, 0, 0, 0))  # PR_GET_DUMPABLE
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == ("0\n" if reads else "1\n")
