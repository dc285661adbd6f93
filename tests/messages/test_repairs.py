"""What start, import, export and check print as the next step is done where it was printed, and the finding is gone."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.messages.mistakes import VARIABLES, answered, make_folder

LAUNCH = "--prefix ws demo.launch.xml"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    make_folder(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(command: str, status: int = 0) -> str:
    found = answered(shlex.split(command))
    assert found.status == status, found
    return found.answer


def test_import_on_a_host_of_another_name() -> None:
    pins = re.findall(
        r"--require-ca \w+=\w+", run("secure-keystore export ks -o out --host r1 --enclave /talker")
    )
    assert len(pins) == 2
    refused = run(f"secure-keystore import host-ks out/r1.bundle {' '.join(pins)}", 1)
    (option,) = re.findall(r"add (--host r1)$", refused, re.M)
    assert run(f"secure-keystore import host-ks out/r1.bundle {option} {' '.join(pins)}")
    assert "good" in run("secure-keystore verify host-ks")


def test_export_of_an_enclave_that_does_not_exist() -> None:
    refused = run("secure-keystore export ks -o out --enclave /talkr", 2)
    (repair,) = re.findall(r"^try: (.*)$", refused, re.M)
    assert run(repair.replace("{here}", ".")) == "/talker\n"


def test_a_start_through_a_prefix_that_is_not_known(here: Path) -> None:
    refused = run("secure-launch -q --secure --keystore new --provision-only --prefix ws two.launch.xml", 1)
    (option,) = re.findall(r"^try: .*(--accept-prefix env)$", refused, re.M)
    run(f"secure-launch -q --secure --keystore new --provision-only --prefix ws two.launch.xml {option}")


def test_a_check_against_a_keystore_that_lacks_an_enclave() -> None:
    found = run(f"secure-plan check {LAUNCH} --keystore ks")
    assert "keystore-enclave-missing" in found and "secure-launch --secure" in found
    run(f"secure-launch --secure --provision-only --keystore ks {LAUNCH}")
    assert "keystore-enclave-missing" not in run(f"secure-plan check {LAUNCH} --keystore ks")


def test_doctor_names_a_file_that_it_then_reads() -> None:
    missing = run(f"secure-plan doctor {LAUNCH}", 1)
    assert "try: secure-plan init" in missing
    run("secure-plan init")
    assert "missing" not in run(f"secure-plan doctor {LAUNCH}")
