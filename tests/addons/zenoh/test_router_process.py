"""The router that a launch starts: what changes in the keystore reaches it while it runs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.zenoh.files import present_address
from enclave_addons.zenoh.router import RouterAnswer, RouterPlace, ZenohRouter, who_answers
from enclave_addons.zenoh.writing import router_differences
from enclave_launch import RuntimeFailure
from keystore import ProvisionOptions, RemoveOptions, apply_policy, remove
from keystore.disk.view import KeystoreView
from tests.addons.zenoh import kit
from tests.addons.zenoh.conftest import Grants, keystore_of, policy_of
from tests.addons.zenoh.kit import Heard, passes, topic, wait_for
from tests.addons.zenoh.workspace import Workspace

SYSTEM: Grants = {
    "/talker": {"publish": ("/chatter",)},
    "/herald": {"publish": ("/chatter",)},
    "/listener": {"subscribe": ("/chatter", "/news")},
}


class Running:
    def __init__(self, root: Path):
        self.keystore = keystore_of(root / "ks", SYSTEM)
        self.said: list[str] = []
        self.program = str(Workspace(root / "ws").prefix / "lib/rmw_zenoh_cpp/rmw_zenohd")
        address = present_address(KeystoreView(self.keystore))
        assert address is not None
        files = self.keystore / "zenoh"
        self.place = RouterPlace(
            (address.host, address.port), str(files / "router.json5"), str(files / "router.cert.pem"),
            str(self.keystore / "public/identity_ca.cert.pem"), lambda: router_differences(self.keystore),
        )  # fmt: skip

    def router(self, program: str | None = None) -> ZenohRouter:
        return ZenohRouter(self.place, program or self.program, os.environ, self.said.append)

    def session(self, enclave: str) -> Any:
        return kit.opened(kit.session_text(self.keystore, enclave))


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    made = Running(tmp_path)
    with made.router():
        yield made
    assert who_answers(made.place) is RouterAnswer.NOBODY


def test_a_removed_enclave_is_cut_off_and_the_others_come_back_by_themselves(running: Running) -> None:
    listener, talker, herald = map(running.session, ("/listener", "/talker", "/herald"))
    with kit.closing(listener, talker, herald):
        heard = Heard()
        kept = listener.declare_subscriber(topic("/chatter"), heard)
        assert passes(talker, topic("/chatter"), heard)
        remove(running.keystore, ["/talker"], options=RemoveOptions(durable=False))
        assert wait_for(lambda: who_answers(running.place) is RouterAnswer.PRESENT)
        assert passes(herald, topic("/chatter"), heard) and kept
        talker.put(topic("/chatter"), "forged")
        assert passes(herald, topic("/chatter"), heard) and "forged" not in heard.texts()


def test_what_is_newly_granted_can_be_done_at_once(running: Running) -> None:
    listener = running.session("/listener")
    with kit.closing(listener):
        heard = Heard()
        kept = listener.declare_subscriber(topic("/news"), heard)
        more = policy_of({"/talker": {"publish": ("/chatter", "/news")}})
        apply_policy(running.keystore, more, options=ProvisionOptions(durable=False))
        assert wait_for(lambda: who_answers(running.place) is RouterAnswer.PRESENT)
        talker = running.session("/talker")
        with kit.closing(talker):
            assert passes(talker, topic("/news"), heard) and kept


def test_rules_that_somebody_else_wrote_are_not_taken(running: Running) -> None:
    file = running.keystore / "zenoh/router.json5"
    file.write_text(file.read_text().replace('"default_permission": "deny"', '"default_permission": "allow"'))
    assert wait_for(lambda: any("remain unchanged" in text for text in running.said))
    with pytest.raises(RuntimeFailure, match="not what follows from the permissions"):
        _started(running)


def _started(running: Running) -> None:
    elsewhere = running.place._replace(address=("localhost", kit.free_port()))
    with ZenohRouter(elsewhere, running.program, os.environ, print):
        pass


def test_a_router_that_runs_with_the_present_rules_is_used_and_no_other_started(running: Running) -> None:
    with running.router(program="/nonexistent"):
        assert who_answers(running.place) is RouterAnswer.PRESENT


def test_a_router_that_cannot_start_is_told_with_what_it_said(tmp_path: Path) -> None:
    made = Running(tmp_path)
    broken = tmp_path / "rmw_zenohd"
    broken.write_text("#!/bin/sh\necho no such plugin\nexit 3\n")
    broken.chmod(0o755)
    with pytest.raises(RuntimeFailure, match="no such plugin"), made.router(str(broken)):
        pass
