"""The secure-keystore command: exit statuses, messages for people, JSON for scripts."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from keystore.verb import VERBS, main
from tests.keystore.kit import DAY, NOW, filled, snapshot
from tests.programs import PYTHON

POLICY = """<policy version="0.2.0"><enclaves><enclave path="/talker"><profiles><profile ns="/" node="talker">
<topics publish="ALLOW"><topic>chatter</topic></topics></profile></profiles></enclave></enclaves></policy>"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return filled(tmp_path / "ks", ["/a", "/a/b"])


def test_from_nothing_to_a_bundle(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ks = str(tmp_path / "ks")
    (tmp_path / "policy.xml").write_text(POLICY)
    (tmp_path / "governance.yaml").write_text("version: 1\ndomain_rules: [{domains: 0-5}]\n")
    commands = [
        ["create", ks, "--valid-for", "90d", "--ca-valid-for", "5y", "--identity-ca-name", "acme"],
        ["create-enclave", ks, "/", "/listener"],
        ["apply-policy", ks, str(tmp_path / "policy.xml")],
        ["governance", ks, str(tmp_path / "governance.yaml")],
        ["renew", ks, "/talker", "--new-keys"],
        ["verify", ks],
        ["status", ks],
        ["export", ks, "-o", str(tmp_path / "robot.tar"), "--enclave", "/talker"],
        ["remove", ks, "/listener"],
        ["verify", ks],
    ]
    for command in commands:
        assert main(command) == 0, (command, capsys.readouterr())
    capsys.readouterr()
    assert main(["list", ks]) == 0
    assert capsys.readouterr().out == "/\n/talker\n"


def test_list_as_json(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", str(root), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"version": 1, "enclaves": ["/a", "/a/b"]}


@pytest.mark.parametrize(
    ("lifetime", "within", "status"), [("300d", "30d", 0), ("300d", "400d", 3), ("10d", "30d", 3)]
)
def test_status_for_monitoring(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lifetime: str, within: str, status: int
) -> None:
    ks = str(tmp_path / "ks")
    main(["create", ks])
    main(["create-enclave", ks, "/a", "--valid-for", lifetime])
    capsys.readouterr()
    assert main(["status", ks, "--within", within, "--format", "json"]) == status
    shown = json.loads(capsys.readouterr().out)
    first = shown["expiries"][0]
    assert (first["what"], first["enclave"], first["valid"], first["due"]) == (
        "certificate",
        "/a",
        True,
        status == 3,
    )
    assert {"not_before", "not_after", "days_left"} <= first.keys()


def test_status_of_what_has_ended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = filled(tmp_path / "ks", ["/a"], now=NOW - 3000 * DAY, lifetime=90 * DAY)
    assert main(["status", str(root)]) == 4
    assert "expired  certificate of /a" in capsys.readouterr().out


def test_verify_as_json(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (root / "enclaves/a/key.pem").unlink()
    assert main(["verify", str(root), "--format", "json"]) == 1
    shown = json.loads(capsys.readouterr().out)
    assert shown["good"] is False
    (finding,) = shown["findings"]
    assert finding["severity"] == "error" and finding["code"] == "missing"
    assert finding["place"] == "enclaves/a/key.pem" and finding["repair"]


BAD_USAGE = {
    ("create-enclave", "KS", "/../x"): ("names are not paths", 2),
    ("create-enclave", "KS", "/new", "--valid-for", "soon"): ("ISO date", 2),
    ("create-enclave", "KS", "/new", "--valid-for", "1999-01-01"): ("already have expired", 2),
    ("create-enclave", "KS", "/new", "--passphrase-file", "/nonexistent"): (None, 0),
    ("apply-policy", "KS", "/nonexistent.xml"): ("cannot read policy", 2),
    ("governance", "KS", "/nonexistent.yaml"): ("cannot read", 2),
    ("renew", "KS", "/nobody"): ("no enclave /nobody", 2),
    ("renew", "KS", "/a", "--ca", "start"): ("do not name any", 2),
    ("renew", "KS", "--ca", "switch"): ("first --ca start", 2),
    ("remove", "KS", "/nobody"): ("no enclave /nobody", 2),
    ("export", "KS", "-o", "OUT", "--enclave", "/nobody"): ("no enclave matches", 2),
    ("list", "OUT"): ("no keystore at", 1),
    ("create", "KS", "--domain-id", "231"): ("0..230", 2),
    ("create", "NEW", "--encrypt-ca-keys"): ("needs a passphrase", 2),
    ("create", "NEW", "--identity-ca-name", "a/b"): ("1 to 64 bytes", 2),
    ("create-enclave", "NEW", "/a"): ("there is no keystore at ", 1),
}


@pytest.mark.parametrize(("command", "outcome"), BAD_USAGE.items())
def test_one_message_and_an_exit_status(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], command: tuple[str, ...],
    outcome: tuple[str | None, int],
) -> None:  # fmt: skip
    places = {"KS": str(root), "OUT": str(tmp_path / "out"), "NEW": str(tmp_path / "new")}
    message, status = outcome
    before = snapshot(root)
    assert main([places.get(word, word) for word in command]) == status
    printed = capsys.readouterr().err
    if message is None:
        return
    assert message in printed and printed.startswith("secure-keystore: error: ")
    _, *repair = printed.splitlines()
    assert [line.startswith("try: secure-keystore ") for line in repair] in ([], [True])
    assert snapshot(root) == before, "nothing half-done"


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([verb, "--help"])
    assert caught.value.code == 0
    assert f"secure-keystore {verb}" in capsys.readouterr().out


def test_a_reader_that_leaves_is_no_traceback(root: Path) -> None:
    command = f"{PYTHON} -m keystore.verb status --all --format json {root} | head -c 1"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True)
    assert done.stdout == "{" and "Traceback" not in done.stderr


def test_no_bar_without_a_terminal(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "keystore.verb", "create", str(tmp_path / "ks")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and done.stderr == ""


@pytest.mark.parametrize(
    ("written", "said"), [("chatter", ""), ("camera/*", "camera/*"), ("imu[12]", "imu[12]")]
)
def test_each_wildcard_of_a_policy_is_said(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], written: str, said: str
) -> None:
    (tmp_path / "wide.xml").write_text(POLICY.replace("<topic>chatter<", f"<topic>{written}<"))
    assert main(["apply-policy", str(root), str(tmp_path / "wide.xml")]) == 0
    assert capsys.readouterr().err == (
        f"secure-keystore: warning: enclave /talker is granted by wildcard (* also matches /): {said}\n"
        if said
        else ""
    )
