"""A plan held against a real keystore, by ``check --keystore`` and by ``diff``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.review.document import GrantedName
from enclave_addons.review.signed import as_signed
from enclave_addons.review.verb import main
from enclave_launch import ResolveOptions, SecurityOptions, provision, resolve
from keystore import CaAccess, ProvisionOptions, Role
from keystore.disk.view import keystore_at
from keystore.formats.validity import utc_now
from keystore.signing import smime

PREFIX = Path(__file__).parents[3] / "fixtures" / "demo_ws"
LAUNCH = PREFIX / "share" / "demo_nodes" / "launch"


def words(name: str) -> list[str]:
    return ["--prefix", str(PREFIX), "demo_nodes", name]


def make(folder: Path, name: str, **options: Any) -> Path:
    plan = resolve(LAUNCH / name, options=ResolveOptions(prefixes=(PREFIX,)))
    provision(plan, folder, options=SecurityOptions(keystore=ProvisionOptions(**options)))
    return folder


@pytest.fixture(scope="module")
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a launch with services and actions, and of one with topics in enclaves of another."""
    folder = tmp_path_factory.mktemp("ks") / "ks"
    make(folder, "services_actions.launch.xml")
    return make(folder, "talker_listener_remap.launch.xml")


def found(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[tuple[str, str]]:
    main(["check", *arguments, "--format", "json"])
    return [(told["code"], told["subject"]) for told in json.loads(capsys.readouterr().out)["findings"]]


def test_a_keystore_as_planned_is_no_finding_and_no_difference(
    keystore: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("services_actions.launch.xml", "talker_listener_remap.launch.xml"):
        assert found(capsys, *words(name), "--keystore", str(keystore)) == []
        assert main(["diff", str(keystore), *words(name)]) == 0
        assert capsys.readouterr().out == "no enclave, node, permission or flow differs\n"


def test_a_plan_that_asks_for_more_or_for_less(
    keystore: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "f.launch.xml"
    node = (
        '<launch><node pkg="demo_nodes" exec="talker" name="speaker" namespace="/front" enclave="/speaker">'
        "{}</node></launch>"
    )
    file.write_text(node.format('<remap from="chatter" to="/elsewhere"/>'))
    launch = ("--prefix", str(PREFIX), str(file))
    codes = found(capsys, *launch, "--keystore", str(keystore))
    assert ("keystore-grants-more", "/speaker") in codes and ("keystore-grants-less", "/speaker") in codes
    assert main(["diff", str(keystore), *launch]) == 1
    out = capsys.readouterr().out
    assert "+   publish /elsewhere\n-   publish /conversation\n" in out
    file.write_text(node.format('<remap from="chatter" to="/conversation"/>'))
    assert not any(
        code.startswith("keystore") for code, _ in found(capsys, *launch, "--keystore", str(keystore))
    )


def test_a_document_of_another_form_is_refused_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another tool may have signed it with the same CA: DDS may read something else in it than we do."""
    name = "talker_listener_remap.launch.xml"
    keystore = make(tmp_path / "ks", name)
    place = keystore / "enclaves/speaker/permissions.p7s"
    document = smime.read(place.read_bytes(), str(place)).document
    changed = document.replace(b"<default>DENY</default>", b"<default>ALLOW</default>")
    assert changed != document
    place.write_bytes(
        smime.sign_document(changed, keystore_at(keystore).authority(Role.PERMISSIONS, CaAccess()))
    )
    assert main(["diff", str(keystore), *words(name)]) != 0
    assert "byte for byte" in capsys.readouterr().err


def test_an_enclave_that_the_keystore_lacks(keystore: Path, capsys: pytest.CaptureFixture[str]) -> None:
    codes = found(capsys, *words("talker_listener.launch.xml"), "--keystore", str(keystore))
    assert ("keystore-enclave-missing", "/") in codes


def test_what_ends_soon_and_what_has_ended(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from datetime import timedelta

    name = "talker_listener_remap.launch.xml"
    ks = str(make(tmp_path / "ks", name, valid_until=utc_now() + timedelta(days=20)))
    assert ("keystore-expires", "/ear") in found(capsys, *words(name), "--keystore", ks)
    assert found(capsys, *words(name), "--keystore", ks, "--within", "10d") == []
    assert main(["check", *words(name), "--keystore", ks]) == 0
    assert main(["check", *words(name), "--keystore", ks, "--strict"]) == 1
    assert main(["check", *words(name), "--keystore", ks, "--within", "soon"]) != 0


@pytest.mark.parametrize("verb", [["check", "--keystore"], ["diff"]])
def test_a_folder_that_is_no_keystore_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: list[str]
) -> None:
    assert main([*verb, str(tmp_path), *words("talker_listener.launch.xml")]) != 0
    told = capsys.readouterr()
    assert "is not a complete keystore" in told.err and told.out == ""


def test_grants_come_back_from_dds_as_they_went_unless_they_say_the_same() -> None:
    grants = frozenset(
        {
            GrantedName("publish", "/x"),
            GrantedName("subscribe", "/a/*"),
            GrantedName("call_services", "/s"),
            GrantedName("serve_actions", "/act"),
        }
    )
    assert as_signed(grants) == grants
    doubled = grants | {GrantedName("publish", "/act/_action/status")}
    assert as_signed(doubled) == grants, "the topic is part of the action"
