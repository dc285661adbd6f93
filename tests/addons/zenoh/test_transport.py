"""Who gets a link to the router, who can play it, and how long a link lasts."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import zenoh

from keystore import (
    CaAccess,
    ProvisionOptions,
    RemoveOptions,
    RenewOptions,
    Role,
    Validity,
    apply_policy,
    remove,
    renew,
)
from keystore.disk.view import KeystoreView
from keystore.formats.validity import utc_now
from keystore.signing.authority import (
    Authority,
    self_signed_ca,
)
from keystore.signing.private_key import key_pem, new_key
from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import Grants, System, keystore_of, policy_of
from tests.addons.zenoh.kit import Heard, opens, passes, topic

LIFE = timedelta(days=1)


def tls(text: str, **changes: object) -> str:
    """The same session with other TLS settings."""
    content = json.loads(text)
    content["transport"]["link"]["tls"] |= changes
    return json.dumps(content)


def own_ca(keystore: Path) -> Authority:
    return KeystoreView(keystore).authority(Role.IDENTITY, CaAccess())


def identity(
    folder: Path, ca: Authority, name: str, validity: Validity | None = None, hosts: tuple[str, ...] = ()
) -> dict[str, str]:
    """Certificate and key as settings for connecting and listening."""
    signer = new_key()
    span = validity or Validity.starting(utc_now(), LIFE)
    folder.mkdir(exist_ok=True)
    cert, key = folder / "cert.pem", folder / "key.pem"
    cert.write_bytes(ca.issue(name, signer.public_key(), span, hosts).pem)
    key.write_bytes(key_pem(signer))
    return {
        "connect_certificate": str(cert), "connect_private_key": str(key),
        "listen_certificate": str(cert), "listen_private_key": str(key),
    }  # fmt: skip


@pytest.fixture(scope="module")
def talker(system: System) -> str:
    return kit.session_text(system.keystore, "/talker")


@pytest.fixture(scope="module")
def foreign() -> Authority:
    return self_signed_ca(Role.IDENTITY, "another CA", new_key(), Validity.starting(utc_now(), LIFE))


def test_an_enclave_with_its_certificate_gets_in(talker: str) -> None:
    assert opens(talker)


def test_without_a_certificate_nobody_gets_in(talker: str) -> None:
    content = json.loads(talker)
    for name in ("connect_certificate", "connect_private_key", "enable_mtls"):
        del content["transport"]["link"]["tls"][name]
    assert not opens(json.dumps(content))


def test_another_enclaves_name_under_a_foreign_ca_does_not_get_in(
    talker: str, foreign: Authority, tmp_path: Path
) -> None:
    assert not opens(tls(talker, **identity(tmp_path, foreign, "ros.talker")))


def test_an_expired_certificate_does_not_get_in(talker: str, system: System, tmp_path: Path) -> None:
    now = utc_now()
    ended = Validity(now - LIFE, now - timedelta(minutes=1))
    assert not opens(tls(talker, **identity(tmp_path / "old", own_ca(system.keystore), "ros.talker", ended)))
    assert opens(tls(talker, **identity(tmp_path / "new", own_ca(system.keystore), "ros.talker")))


def test_the_certificate_of_one_enclave_with_the_key_of_another_does_not_get_in(
    talker: str, system: System
) -> None:
    assert not opens(tls(talker, connect_private_key=str(system.keystore / "enclaves/spy/key.pem")))


def test_the_routers_own_certificate_is_for_no_client(talker: str, system: System) -> None:
    files = system.keystore / "zenoh"
    assert not opens(tls(
        talker, connect_certificate=str(files / "router.cert.pem"), connect_private_key=str(files / "router.key.pem")
    ))  # fmt: skip


@pytest.mark.parametrize("protocol", ["tcp", "ws"])
def test_no_other_protocol_is_spoken(talker: str, system: System, protocol: str) -> None:
    content = json.loads(talker)
    endpoint = content["connect"]["endpoints"][0]
    content["connect"]["endpoints"] = [endpoint.replace("tls/", f"{protocol}/")]
    content["transport"]["link"]["protocols"] = [protocol]
    assert not opens(json.dumps(content))


def test_a_name_that_no_rule_knows_gets_in_and_may_do_nothing(
    talker: str, system: System, tmp_path: Path
) -> None:
    stranger = kit.opened(tls(talker, **identity(tmp_path, own_ca(system.keystore), "ros.nobody")))
    heard = system.hears("/listener", topic("/chatter"))
    with kit.closing(stranger):
        spied = Heard()
        kept = stranger.declare_subscriber("**", spied)
        stranger.put(topic("/chatter"), "forged")
        assert passes(system["/talker"], topic("/chatter"), heard) and kept
        assert set(spied.texts()) <= {"forged"}  # its own it hears without any router
        assert "forged" not in heard.texts()
        assert not kit.graph(stranger, "@ros2_lv/0/**")


@pytest.fixture
def impostor(system: System, tmp_path: Path) -> Iterator[Any]:
    """``impostor(files)``: a router with these TLS files, and what a process of /talker makes of it."""
    routers: list[Any] = []

    def play(files: dict[str, str]) -> bool:
        text = json.loads((system.keystore / "zenoh/router.json5").read_text())
        port = kit.free_port()
        text["listen"]["endpoints"] = [f"tls/localhost:{port}"]
        text["transport"]["link"]["tls"] |= {
            name: file for name, file in files.items() if name.startswith("listen")
        }
        text["scouting"]["delay"] = 0
        routers.append(zenoh.open(zenoh.Config.from_json5(json.dumps(text))))
        return opens(
            kit.session_text(system.keystore, "/talker"), **{"connect/endpoints": [f"tls/localhost:{port}"]}
        )

    yield play
    for router in routers:
        router.close()


def test_nobody_but_the_router_can_play_it(
    impostor: Any, system: System, foreign: Authority, tmp_path: Path
) -> None:
    def files(path: Path, stem: str = "") -> dict[str, str]:
        return {
            "listen_certificate": str(path / f"{stem}cert.pem"),
            "listen_private_key": str(path / f"{stem}key.pem"),
        }

    assert impostor(files(system.keystore / "zenoh", "router."))
    assert not impostor(files(system.keystore / "enclaves/listener"))
    assert not impostor(identity(tmp_path / "foreign", foreign, "zenoh-router", hosts=("localhost",)))
    assert not impostor(identity(tmp_path / "unnamed", own_ca(system.keystore), "zenoh-router"))


def test_a_link_ends_with_the_certificate_it_was_opened_with(
    talker: str, system: System, tmp_path: Path
) -> None:
    heard = system.hears("/listener", topic("/chatter"))
    session = _short_lived(talker, own_ca(system.keystore), tmp_path)
    with kit.closing(session):
        assert kit.wait_for(lambda: not list(session.info.routers_zid()))
        session.put(topic("/chatter"), "too late")
        assert passes(system["/talker"], topic("/chatter"), heard) and "too late" not in heard.texts()


def _short_lived(talker: str, ca: Authority, folder: Path) -> Any:
    """Opened with a certificate that ends soon; on a busy machine not before it was."""
    for seconds in (1, 4, 16):
        now = utc_now()
        short = Validity(now - LIFE, now + timedelta(seconds=seconds))
        try:
            return kit.opened(
                tls(talker, **identity(folder, ca, "ros.talker", short)), **{"connect/timeout_ms": 0}
            )
        except zenoh.ZError:
            continue
    raise AssertionError("no session could be opened in 16 seconds")


@pytest.fixture
def changing(tmp_path: Path) -> Path:
    system: Grants = {
        "/talker": {"publish": ("/chatter",)},
        "/herald": {"publish": ("/chatter",)},
        "/listener": {"subscribe": ("/chatter",)},
    }
    return keystore_of(tmp_path / "ks", system)


def hears(keystore: Path, sender_text: str, *, expected: bool) -> bool:
    """Whether a session reaches the listener by the present rules. What is not expected to arrive is followed by
    something that does."""
    router = kit.router(keystore)
    listener, herald = (kit.opened(kit.session_text(keystore, one)) for one in ("/listener", "/herald"))
    sender = kit.opened(sender_text)
    with kit.closing(sender, herald, listener, router):
        heard = Heard()
        kept = listener.declare_subscriber(topic("/chatter"), heard)
        assert passes(herald, topic("/chatter"), heard) and kept
        text = kit.mark()
        sender.put(topic("/chatter"), text)
        if expected:
            return heard.waits_for(text)
        kit.graph(sender, "@ros2_lv/0/**")  # the router has answered what came after the message
        assert passes(herald, topic("/chatter"), heard)
        return text in heard.texts()


def stolen(keystore: Path, folder: Path) -> str:
    """A session of a copy of the talker's files, which nobody can take back."""
    shutil.copytree(keystore / "enclaves/talker", folder)
    return tls(
        kit.session_text(keystore, "/talker"), connect_certificate=str(folder / "cert.pem"),
        connect_private_key=str(folder / "key.pem"),
        root_ca_certificate=str(keystore / "public/identity_ca.cert.pem"),
    )  # fmt: skip


def test_a_revoked_certificate_is_worth_nothing_on_the_router(changing: Path, tmp_path: Path) -> None:
    copy = stolen(changing, tmp_path / "copy")
    assert hears(changing, copy, expected=True)
    renewal = RenewOptions(new_keys=True, revoke_old=True, provisioning=ProvisionOptions(durable=False))
    renew(changing, ["/talker"], options=renewal)
    assert not hears(changing, copy, expected=False)
    assert hears(changing, kit.session_text(changing, "/talker"), expected=True)


def test_a_removed_enclave_is_cut_off(changing: Path, tmp_path: Path) -> None:
    copy = stolen(changing, tmp_path / "copy")
    remove(changing, ["/talker"], options=RemoveOptions(durable=False))
    assert not hears(changing, copy, expected=False)


def test_what_is_taken_away_ends_for_the_old_certificate_and_for_the_new_one(
    changing: Path, tmp_path: Path
) -> None:
    copy = stolen(changing, tmp_path / "copy")
    smaller = policy_of({"/talker": {"publish": ("/other",)}})
    apply_policy(changing, smaller, options=ProvisionOptions(durable=False))
    assert not hears(changing, copy, expected=False)
    assert not hears(changing, kit.session_text(changing, "/talker"), expected=False)


def test_a_renewed_certificate_goes_on_with_the_same_rules(changing: Path) -> None:
    before = (changing / "zenoh/router.json5").read_bytes()
    renew(changing, options=RenewOptions(everything=True, provisioning=ProvisionOptions(durable=False)))
    assert (changing / "zenoh/router.json5").read_bytes() == before
    assert hears(changing, kit.session_text(changing, "/talker"), expected=True)
