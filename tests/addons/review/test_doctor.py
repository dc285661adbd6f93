"""``secure-plan doctor`` says what is missing before a secured start, each with one next step, and writes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_addons.review.installation import look_at_middleware
from enclave_addons.review.verb import main as secure_plan
from keystore.verb import main as secure_keystore

ROOT = Path(__file__).parents[3]

LAUNCH = ["--prefix", str(ROOT / "fixtures" / "demo_ws"), "demo_nodes", "talker_listener.launch.xml"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("ROS_SECURITY_KEYSTORE", "AMENT_PREFIX_PATH", "ROS_DISTRO", "RMW_IMPLEMENTATION"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def doctor(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, tuple[str, str, str]]:
    """Map what was looked at to state, text and next step."""
    status = secure_plan(["doctor", *words, "--format", "json"])
    document = json.loads(capsys.readouterr().out)
    assert status == (0 if document["ready"] else 1)
    return {each["about"]: (each["state"], each["text"], each["step"]) for each in document["answers"]}


def test_a_keystore_that_is_not_named_is_missing(capsys: pytest.CaptureFixture[str], here: Path) -> None:
    state, _, step = doctor(capsys, *LAUNCH)["keystore"]
    assert state == "missing" and step.startswith("secure-plan init")
    assert doctor(capsys, *LAUNCH, "--keystore", "ks")["keystore"][0] == "ok"
    assert list(here.iterdir()) == [], "nothing is written"


def test_a_damaged_keystore_is_missing_and_a_good_one_is_not(
    capsys: pytest.CaptureFixture[str], here: Path
) -> None:
    assert secure_keystore(["create", "ks"]) == 0
    capsys.readouterr()
    found = doctor(capsys, *LAUNCH, "--keystore", "ks")
    assert [found[about][0] for about in ("keystore", "CA keys", "clock")] == ["ok"] * 3
    (here / "ks" / "enclaves" / "governance.p7s").write_bytes(b"x")
    assert doctor(capsys, *LAUNCH, "--keystore", "ks")["keystore"][::2] == (
        "missing",
        "secure-keystore verify ks",
    )


def test_encrypted_ca_keys_need_their_passphrase(
    capsys: pytest.CaptureFixture[str], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "correct horse")
    assert secure_keystore(["create", "ks", "--passphrase-env", "SECRET", "--encrypt-ca-keys"]) == 0
    capsys.readouterr()
    state, _, step = doctor(capsys, *LAUNCH, "--keystore", "ks")["CA keys"]
    assert state == "missing" and "--ca-passphrase-file" in step
    opened = doctor(capsys, *LAUNCH, "--keystore", "ks", "--ca-passphrase-env", "SECRET")
    assert opened["CA keys"][0] == "ok"


def test_a_node_that_is_not_known_is_learnt(capsys: pytest.CaptureFixture[str], here: Path) -> None:
    (here / "a.launch.xml").write_text('<launch><node pkg="demo_nodes" exec="listener"/></launch>')
    demo = LAUNCH[:2]
    assert doctor(capsys, *demo, "a.launch.xml", "--keystore", "ks")["nodes"][0] == "ok"
    unknown = ["--missing-nodl", "error", "--allow-missing-packages", "b.launch.xml", "--keystore", "ks"]
    (here / "b.launch.xml").write_text('<launch><node pkg="unknown_driver" exec="driver"/></launch>')
    state, text, step = doctor(capsys, *unknown)["nodes"]
    assert state == "missing" and "unknown_driver" in text
    assert step.startswith("secure-launch --learn learnt b.launch.xml")


def test_a_launch_file_with_a_mistake_does_not_hide_the_rest(
    capsys: pytest.CaptureFixture[str], here: Path
) -> None:
    (here / "bad.launch.xml").write_text("<launch><nod/></launch>")
    found = doctor(capsys, "bad.launch.xml", "--keystore", "ks")
    assert found["launch file"][0] == "missing" and "bad.launch.xml:1" in found["launch file"][1]
    assert found["keystore"][0] == "ok"


def installed(prefix: Path, name: str) -> None:
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / name).touch()
    (prefix / "share" / name).mkdir()
    (prefix / "share" / name / "package.xml").write_text(
        f"<package format='3'><name>{name}</name><version>1.2.3</version></package>"
    )


def test_a_middleware_whose_dds_was_built_without_security_is_told_from_one_with_it(tmp_path: Path) -> None:
    installed(tmp_path, "rmw_fastrtps_cpp")
    library = tmp_path / "lib" / "libfastdds.so"
    library.parent.mkdir()
    library.write_bytes(b"no plugins")
    found = look_at_middleware("rmw_fastrtps_cpp", [str(tmp_path)])
    assert (found.version, found.security) == ("1.2.3", None)
    library.write_bytes(b"...DDS:Auth:PKI-DH:1.0...")
    assert look_at_middleware("rmw_fastrtps_cpp", [str(tmp_path)]).security == str(library)


def test_the_versions_of_a_machine_are_printed_for_another(
    capsys: pytest.CaptureFixture[str], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert secure_plan(["doctor", "--versions"]) == 2
    assert "\ntry: . /opt/ros/" in capsys.readouterr().err
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    for name in ("launch", "launch_ros", "rcl"):
        installed(here / "opt", name)
    for name, version in (("launch", "3.4.5"), ("launch_ros", "0.26.7"), ("rcl", "9.2.5")):
        package = here / "opt" / "share" / name / "package.xml"
        package.write_text(package.read_text().replace("1.2.3", version))
    assert secure_plan(["doctor", "--versions", "--prefix", "opt"]) == 0
    listed = capsys.readouterr().out
    assert "ros-jazzy-launch 3.4.5\n" in listed
    Path("robot.versions").write_text(listed)
    assert secure_plan(["show", "--format", "json", "--versions", "robot.versions", *LAUNCH]) == 0
    assert '"launch": "3.4.5"' in capsys.readouterr().out
