"""Zenoh's files in a keystore: written, followed, checked, and on a host without CA keys."""

from __future__ import annotations

import json
from datetime import timedelta
from pathlib import Path

import pytest

from enclave_addons.deployment import export
from enclave_addons.zenoh.configuration import RouterAddress
from enclave_addons.zenoh.writing import matching_enclaves, write_zenoh
from keystore import (
    InvalidInputError,
    LaunchHold,
    ProvisionOptions,
    RenewOptions,
    Step,
    drop_shares,
    provision,
    renew,
    roll_over,
    verify,
)
from keystore.disk.register_file import read_register
from keystore.formats.register import UNKNOWN
from keystore.formats.validity import utc_now
from keystore.verb import main
from tests.keystore.kit import filled, openssl, options, policy

FAST = ProvisionOptions(durable=False)


@pytest.fixture
def keystore(tmp_path: Path) -> Path:
    root = filled(tmp_path / "ks")
    write_zenoh(root, ["/a", "/b"], options=FAST)
    return root


def router(root: Path) -> dict[str, object]:
    content: dict[str, object] = json.loads((root / "zenoh/router.json5").read_text())
    return content


def served(root: Path) -> dict[str, str]:
    """Common name by enclave."""
    control = router(root)["access_control"]
    assert isinstance(control, dict)
    return {one["id"]: one["cert_common_names"][0] for one in control["subjects"]}


def codes(root: Path) -> set[str]:
    return {finding.code for finding in verify(root).findings}


def test_the_router_has_a_name_and_hosts_that_no_enclave_has(keystore: Path) -> None:
    text = openssl("x509", "-in", keystore / "zenoh/router.cert.pem", "-noout", "-text")
    assert "CN = zenoh-router" in text or "CN=zenoh-router" in text
    assert "DNS:localhost" in text and "IP Address:127.0.0.1" in text
    assert "TLS Web Server Authentication" in text and "TLS Web Client" not in text
    enclave = openssl("x509", "-in", keystore / "enclaves/a/cert.pem", "-noout", "-text")
    assert "Alternative Name" not in enclave
    assert (keystore / "zenoh/router.key.pem").stat().st_mode & 0o777 == 0o600


def test_what_was_issued_for_the_router_is_on_record(keystore: Path) -> None:
    register = read_register(keystore)
    assert register is not None
    (record,) = [one for one in register.certificates.values() if one.enclave == UNKNOWN]
    assert record.subject == "zenoh-router"


def test_a_second_run_changes_nothing_and_a_change_gives_the_router_another_certificate(
    keystore: Path,
) -> None:
    before = (keystore / "zenoh/router.cert.pem").read_bytes()
    report = write_zenoh(keystore, ["/a", "/b"], options=FAST)
    assert report.written == () and not report.restart
    assert (keystore / "zenoh/router.cert.pem").read_bytes() == before
    told = provision(keystore, [policy("/a", "/other")], options=options()).warnings
    assert any("has to be restarted" in text for text in told)
    assert '"0/other/*/*"' in (keystore / "zenoh/router.json5").read_text()
    assert (keystore / "zenoh/router.cert.pem").read_bytes() != before


def test_only_enclaves_that_are_on_zenoh_are_served(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ("/a", "/b", "/c/d"))
    write_zenoh(root, matching_enclaves(root, ["/c/*"]), options=FAST)
    assert served(root) == {"/c/d": "ros.c.d"}
    assert matching_enclaves(root, None) == []
    with pytest.raises(InvalidInputError, match="no enclave matches"):
        matching_enclaves(root, ["/x*"])


def test_the_types_that_all_launches_know_are_in_the_rules(tmp_path: Path) -> None:
    root, string = tmp_path / "ks", ("std_msgs::msg::dds_::String_",)
    known = {"/a": (("publish /chatter", string),)}
    one = LaunchHold(root, "one.launch.xml")
    provision(root, [policy("/a", "/chatter")], options=options(launch=one, types=known))
    write_zenoh(root, ["/a"], options=FAST)
    assert f'"0/chatter/{string[0]}/*"' in (root / "zenoh/router.json5").read_text()
    other = LaunchHold(root, "two.launch.xml")
    provision(root, [policy("/a", "/chatter", "/more")], options=options(launch=other))
    text = (root / "zenoh/router.json5").read_text()
    assert '"0/chatter/*/*"' in text and string[0] not in text
    one.close()
    other.close()
    drop_shares(root, "two.launch.xml", options=options())
    text = (root / "zenoh/router.json5").read_text()
    assert f'"0/chatter/{string[0]}/*"' in text and "/more" not in text


def test_a_new_identity_ca_is_trusted_by_a_router_that_is_started_again(keystore: Path) -> None:
    before = router(keystore)["metadata"]
    report = roll_over(keystore, Step.START, options=options())
    assert any("has to be restarted" in text for text in report.warnings)
    assert router(keystore)["metadata"] != before
    roll_over(keystore, Step.SWITCH, options=options())
    assert codes(keystore) == {"roll-over"}


def test_an_enclave_that_shares_its_name_with_a_revoked_certificate_gets_another(keystore: Path) -> None:
    renew(keystore, ["/a"], options=RenewOptions(revoke_old=True, provisioning=options()))
    assert served(keystore) == {"/a": "ros.a-2", "/b": "ros.b"}
    renew(keystore, ["/a"], options=RenewOptions(provisioning=options()))
    assert served(keystore)["/a"] == "ros.a-2"


def test_verify_knows_the_files_and_finds_what_was_changed(keystore: Path) -> None:
    assert codes(keystore) == set()
    file = keystore / "zenoh/router.json5"
    good = file.read_text()
    file.write_text(good.replace("ros.a", "ros.b"))
    assert codes(keystore) == {"zenoh-rules"}
    file.write_text("{}")
    assert codes(keystore) == {"zenoh-router"}
    file.write_text(good)
    session = keystore / "enclaves/a/zenoh.json5"
    session.write_text(session.read_text().replace('"client"', '"peer"'))
    assert codes(keystore) == {"zenoh-session"}


EDITS = {
    "a wider name": ("0/chatter/*/*", "0/*/*/*"),
    "everything": ("0/chatter/*/*", "0/**"),
    "another name": ("0/chatter/*/*", "0/other/*/*"),
    "another domain": ("0/chatter/*/*", "7/chatter/*/*"),
    "all domains": ("0/chatter/*/*", "*/chatter/*/*"),
    "one message more": ('["put", "reply"]', '["put", "reply", "delete"]'),
    "one message less": ('["put", "reply"]', '["put"]'),
    "the other direction": (
        '["egress"], "messages": ["declare_subscriber"]',
        '["ingress"], "messages": ["declare_subscriber"]',
    ),
    "the name of a stranger": ("ros.a", "ros.zz"),
    "one name more": ('["ros.a"]', '["ros.a", "ros.zz"]'),
    "everybody": (', "cert_common_names": ["ros.a"]', ""),
    "nobody": ('"ros.a"', '"ros.b"'),
    "tokens in another's name": ("/NN/%a/", "/NN/%b/"),
    "a denial": ('"permission": "allow"', '"permission": "deny"'),
    "allowed unless denied": ('"deny"', '"allow"'),
    "no access control": ('"enabled": true,\n"default', '"enabled": false,\n"default'),
    "gossip": ('"gossip": {"enabled": false}', '"gossip": {"enabled": true}'),
    "multicast": ('"multicast": {"enabled": false}', '"multicast": {"enabled": true}'),
    "no client certificates": ('"enable_mtls": true', '"enable_mtls": false'),
    "links for ever": ('"close_link_on_expiration": true', '"close_link_on_expiration": false'),
    "plain TCP": ('"protocols": ["tls"]', '"protocols": ["tls", "tcp"]'),
    "another CA": ("identity_ca.cert.pem", "permissions_ca.cert.pem"),
    "an admin space": ('"adminspace": {\n"enabled": false', '"adminspace": {\n"enabled": true'),
    "a listener more": ('"endpoints": ["tls/', '"endpoints": ["tcp/[::]:7448", "tls/'),
    "a router to follow": ('"connect": {\n"endpoints": []', '"connect": {\n"endpoints": ["tcp/evil:7447"]'),
}


@pytest.mark.parametrize("what", EDITS)
def test_verify_finds_a_router_that_was_edited(tmp_path: Path, what: str) -> None:
    """The file as it was before is beside it, and good."""
    keystore, (old, new) = filled(tmp_path / "ks", ("/a",)), EDITS[what]
    write_zenoh(keystore, ["/a"], options=FAST)
    assert codes(keystore) == set()
    file = keystore / "zenoh/router.json5"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    (found,) = verify(keystore).findings
    assert found.code == "zenoh-rules" and "does not enforce what is signed" in found.message


def test_verify_finds_a_session_that_was_edited(keystore: Path) -> None:
    file = keystore / "enclaves/a/zenoh.json5"
    good = file.read_text()
    for old, new in (
        ('"client"', '"peer"'),
        ('"verify_name_on_connect": true', '"verify_name_on_connect": false'),
        ('"endpoints": []', '"endpoints": ["tcp/[::]:0"]'),
        ("enclaves/a/key.pem", "enclaves/b/key.pem"),
        ("tls/localhost", "tls/evil"),
        ('"shared_memory": {"enabled": false}', '"shared_memory": {"enabled": true}'),
    ):
        assert old in good
        file.write_text(good.replace(old, new))
        assert codes(keystore) == {"zenoh-session"}
    file.write_text(good)
    assert codes(keystore) == set()


def test_verify_finds_a_router_that_still_admits_a_revoked_certificate(keystore: Path) -> None:
    file = keystore / "zenoh/router.json5"
    before = file.read_text()
    renew(keystore, ["/a"], options=RenewOptions(revoke_old=True, provisioning=options()))
    file.write_text(before)
    assert codes(keystore) == {"zenoh-rules"}
    write_zenoh(keystore, [], options=FAST)
    assert codes(keystore) == set()


def test_verify_finds_a_router_key_that_others_could_read_and_a_second_run_replaces_it(
    keystore: Path,
) -> None:
    key = keystore / "zenoh/router.key.pem"
    before = key.read_bytes()
    key.chmod(0o644)
    assert "zenoh-identity" in codes(keystore)
    write_zenoh(keystore, [], options=FAST)
    assert key.read_bytes() != before and codes(keystore) == set()


def test_permissions_that_were_put_back_are_not_served(keystore: Path) -> None:
    place = keystore / "enclaves/a/permissions.p7s"
    old = place.read_bytes()
    provision(keystore, [policy("/a", "/chatter", "/more")], options=options())
    place.write_bytes(old)
    report = write_zenoh(keystore, [], options=FAST)
    assert "/a" not in report.enclaves and any("shut out" in gap for gap in report.gaps)


def test_a_certificate_that_ends_soon_is_issued_anew(keystore: Path) -> None:
    before = (keystore / "zenoh/router.cert.pem").read_bytes()
    later = FAST._replace(renew_within=timedelta(days=20000))
    assert write_zenoh(keystore, [], options=later).written == ()  # it ends with its CA
    assert write_zenoh(keystore, [], options=FAST._replace(now=utc_now() + timedelta(days=1))).written == ()
    assert (keystore / "zenoh/router.cert.pem").read_bytes() == before


def test_on_a_host_only_the_files_of_processes_are_written(keystore: Path, tmp_path: Path) -> None:
    export(keystore, tmp_path / "host", ["/a"])
    assert not (tmp_path / "host/zenoh").exists()
    report = write_zenoh(tmp_path / "host", ["/a"], router="base.local:7000", options=FAST)
    assert report.written == ("enclaves/a/zenoh.json5",)
    text = json.loads((tmp_path / "host/enclaves/a/zenoh.json5").read_text())
    assert text["connect"]["endpoints"] == ["tls/base.local:7000"]
    assert str(tmp_path / "host") in text["transport"]["link"]["tls"]["connect_private_key"]


@pytest.mark.parametrize(
    ("text", "endpoint", "listens"),
    [
        ("localhost", "tls/localhost:7447", "tls/localhost:7447"),
        ("127.0.0.1:8000", "tls/127.0.0.1:8000", "tls/127.0.0.1:8000"),
        ("base.local", "tls/base.local:7447", "tls/[::]:7447"),
        ("[fe80::1]:8000", "tls/[fe80::1]:8000", "tls/[::]:8000"),
    ],
)
def test_where_the_router_is(text: str, endpoint: str, listens: str) -> None:
    address = RouterAddress.parse(text)
    assert (address.endpoint, address.listens) == (endpoint, listens)
    assert RouterAddress.parse(str(address)) == address


@pytest.mark.parametrize(
    "text", ["", "a b", "host:0", "host:70000", "tls/host", "host:1:2", "-x", "a;b", "[x]:1"]
)
def test_what_no_router_can_be_at_is_refused(text: str) -> None:
    with pytest.raises(InvalidInputError):
        RouterAddress.parse(text)


def test_the_verb_says_what_it_wrote_and_how_to_start_the_router(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = filled(tmp_path / "ks")
    assert main(["zenoh", str(root), "--enclave", "/a"]) == 0
    said = capsys.readouterr().out
    assert "enclaves/a/zenoh.json5 written" in said and "router of 1 enclave at tls/localhost:7447" in said
    assert f"ZENOH_ROUTER_CONFIG_URI={root}/zenoh/router.json5 ros2 run rmw_zenoh_cpp rmw_zenohd" in said
    assert main(["zenoh", str(root), "--router", "nowhere at all"]) == 2
    assert main(["zenoh", str(root), "--enclave", "/x"]) == 2
