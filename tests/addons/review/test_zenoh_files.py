"""A plan held against the files for Zenoh in a keystore, by ``check --keystore`` and ``diff``; two keystores."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from enclave_addons.review.verb import main
from tests.addons.review.test_against_a_keystore import found, make, words

LAUNCH = "services_actions.launch.xml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
        return make(tmp_path_factory.mktemp("zenoh") / "ks", LAUNCH)


@pytest.fixture
def keystore(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One to edit, where it was written: the files name their places."""
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    shutil.copytree(made, tmp_path / "as it was")
    return made


@pytest.fixture(autouse=True)
def put_back(made: Path) -> object:
    files = {
        path: path.read_bytes() for path in (*made.glob("zenoh/*"), *made.glob("enclaves/**/zenoh.json5"))
    }
    yield
    for path, content in files.items():
        path.write_bytes(content)


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_files_as_planned_are_no_finding_and_no_difference(
    keystore: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    codes = {code for code, _ in found(capsys, *words(LAUNCH), "--keystore", str(keystore))}
    assert not {code for code in codes if code.startswith("keystore")}
    for arguments in ([str(keystore), *words(LAUNCH)], [str(keystore), str(tmp_path / "as it was")]):
        assert main(["diff", *arguments]) == 0, capsys.readouterr()
        assert capsys.readouterr().out == "no enclave, node, permission or flow differs\n"


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("zenoh/router.json5", '"0/rosout/rcl_interfaces::msg::dds_::Log_/*"', '"0/**"'),
        ("zenoh/router.json5", '"gossip": {"enabled": false}', '"gossip": {"enabled": true}'),
        ("enclaves/operator/zenoh.json5", '"mode": "client"', '"mode": "peer"'),
    ],
)
def test_a_file_that_was_edited_is_an_error_and_not_compared(
    keystore: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, old: str, new: str
) -> None:
    edit(keystore / file, old, new)
    codes = {code for code, _ in found(capsys, *words(LAUNCH), "--keystore", str(keystore))}
    assert "keystore-zenoh" in codes
    assert main(["check", *words(LAUNCH), "--keystore", str(keystore)]) == 1
    capsys.readouterr()
    assert main(["diff", str(keystore), *words(LAUNCH)]) != 0
    assert f"{file} " in capsys.readouterr().err
    assert main(["diff", str(tmp_path / "as it was"), str(keystore)]) == 0
    assert "files for Zenoh are not compared" in capsys.readouterr().err


def test_an_enclave_that_is_not_on_zenoh_yet_and_a_plan_that_left_dds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    keystore, saved = make(tmp_path / "ks", LAUNCH), tmp_path / "before.json"
    main(["show", *words(LAUNCH), "--format", "json"])
    saved.write_text(capsys.readouterr().out)
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    assert ("keystore-enclave-missing", "/operator") in found(
        capsys, *words(LAUNCH), "--keystore", str(keystore)
    )
    main(["diff", str(keystore), *words(LAUNCH)])
    assert "! enclave /operator moves from DDS to Zenoh\n" in capsys.readouterr().out
    assert main(["diff", str(saved), *words(LAUNCH)]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out and all(
        line.startswith("! enclave /") and line.endswith(" moves from DDS to Zenoh") for line in out
    )


def test_a_router_file_that_is_none_is_an_error_and_no_traceback(
    keystore: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (keystore / "zenoh/router.json5").write_text("// by hand\n{mode: 'router'}")
    assert main(["diff", str(keystore), *words(LAUNCH)]) != 0
    assert "was not written by secure-keystore" in capsys.readouterr().err


def test_reports_and_evidence_say_what_enforces_and_what_is_wrong_with_it(
    keystore: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["report", *words(LAUNCH), "-o", str(tmp_path / "zenoh.html")]) == 0
    assert ", enforced by Zenoh</summary>" in (tmp_path / "zenoh.html").read_text()
    edit(keystore / "zenoh/router.json5", '"gossip": {"enabled": false}', '"gossip": {"enabled": true}')
    arguments = [*words(LAUNCH), "--keystore", str(keystore), "--expect", str(_no_rules(tmp_path))]
    assert main(["evidence", *arguments, "-o", str(tmp_path / "evidence")]) == 1
    rows = json.loads((tmp_path / "evidence/access-control.json").read_text())["permissions"]
    assert {row["enforced_by"] for row in rows} == {"Zenoh"}
    findings = json.loads((tmp_path / "evidence/findings.json").read_text())["findings"]
    assert any(one["code"] == "keystore-zenoh" for one in findings)
    assert "zenoh-rules" in (tmp_path / "evidence/secure-defaults.json").read_text()
    monkeypatch.delenv("RMW_IMPLEMENTATION")
    assert main(["report", *words(LAUNCH), "-o", str(tmp_path / "dds.html")]) == 0
    assert "enforced by" not in (tmp_path / "dds.html").read_text()


def _no_rules(folder: Path) -> Path:
    file = folder / "none.yaml"
    file.write_text("{}")
    return file
