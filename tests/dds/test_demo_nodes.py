"""The demo nodes under security, each its own process: what rcl would let through, what DDS refuses."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from keystore import EnclavePolicy, Operation
from tests.dds.demo import Node, environment
from tests.dds.our_keystore import allow, node, provision
from tests.dds.probe import Probe

pytestmark = [pytest.mark.dds, pytest.mark.usefixtures("cyclone")]

TALKER = node("/", "talker", *allow(Operation.PUBLISH, "chatter"))
LISTENER = node("/", "listener", *allow(Operation.SUBSCRIBE, "chatter"))
INTRUDER = node("/", "intruder", *allow(Operation.SUBSCRIBE, "chatter"))


@pytest.fixture
def secured(tmp_path: Path, domain_id: int) -> Path:
    """A keystore with an enclave for each kind of node, and one that talker and listener share."""
    policies = [
        EnclavePolicy("/talker", (TALKER,)),
        EnclavePolicy("/listener", (LISTENER,)),
        EnclavePolicy("/intruder", (INTRUDER,)),
        EnclavePolicy("/shared", (TALKER, LISTENER)),
        EnclavePolicy("/robot1", (node("/robot1", "speaker", *allow(Operation.PUBLISH, "/conversation")),)),
    ]
    provision(tmp_path / "ks", domain_id, policies)
    return tmp_path / "ks"


def enclave(path: str) -> tuple[str, str]:
    return "--enclave", path


def parameters(**values: object) -> tuple[str, ...]:
    return tuple(word for name, value in values.items() for word in ("-p", f"{name}:={value}"))


TALK = parameters(seconds=40, count=15, rate=10)
HEAR = parameters(seconds=40, count=5, rate=20)


def test_the_listener_hears_the_talker(secured: Path, domain_id: int) -> None:
    env = environment(domain_id, secured)
    talker = Node("talker", env, *enclave("/talker"), *TALK)
    listener = Node("listener", env, *enclave("/listener"), *HEAR)
    heard, said = listener.end(), talker.end()
    assert heard.says("is up, secured by enclave /listener"), heard.output
    assert heard.says("I heard: [Hello World: "), heard.output
    assert (heard.status, said.status) == (0, 0)


def test_a_listener_without_an_enclave_hears_nothing(secured: Path, domain_id: int) -> None:
    """While another, with its enclave, hears the same talker; ``no security`` is not a way around."""
    talker = Node("talker", environment(domain_id, secured), *enclave("/talker"), *parameters(seconds=40))
    outsider = Node("listener", environment(domain_id), *parameters(seconds=6))
    insider = Node("listener", environment(domain_id, secured), *enclave("/listener"), *HEAR)
    assert insider.end().status == 0
    heard = outsider.end()
    talker.stop()
    assert heard.says("NOT secured") and heard.says("heard 0 messages"), heard.output


def test_the_enclave_is_looked_up_exactly(secured: Path, domain_id: int) -> None:
    """No fall-back to a parent; no start without an enclave when security is enforced (rcl security.c)."""
    env = environment(domain_id, secured)
    for arguments in (enclave("/talker/deeper"), ()):
        ended = Node("talker", env, *arguments, *parameters(seconds=1)).end()
        assert ended.status == 1 and ended.says("enclave"), ended.output
        assert not ended.says("is up")


def test_permissive_without_an_enclave_starts_unsecured(secured: Path, domain_id: int) -> None:
    env = {**environment(domain_id, secured), "ROS_SECURITY_STRATEGY": "Permissive"}
    ended = Node("talker", env, *enclave("/nowhere"), *parameters(seconds=0.5)).end()
    assert ended.status == 0 and ended.says("NOT secured"), ended.output


def test_the_override_replaces_the_enclave(secured: Path, domain_id: int) -> None:
    env = {**environment(domain_id, secured), "ROS_SECURITY_ENCLAVE_OVERRIDE": "/listener"}
    ended = Node("talker", env, *enclave("/talker"), *parameters(seconds=1)).end()
    assert ended.status == 1, ended.output
    assert ended.says("refuses the"), "a talker in the listener's enclave must not talk"


def test_the_intruder_is_refused(secured: Path, domain_id: int) -> None:
    ended = Node("intruder", environment(domain_id, secured), *enclave("/intruder")).end()
    assert ended.status == 0, ended.output
    assert ended.says("REFUSED: DDS refuses the publisher on rt/chatter: not allowed by security")
    assert not ended.says("NOT REFUSED")


def test_without_security_nobody_stops_the_intruder(domain_id: int) -> None:
    """The control of the test above."""
    ended = Node("intruder", environment(domain_id)).end()
    assert ended.status == 3 and ended.says("NOT REFUSED"), ended.output


def test_pushed_namespace_and_remapped_names(secured: Path, domain_id: int) -> None:
    env = environment(domain_id, secured)
    names = ("-r", "__ns:=/robot1", "-r", "__node:=speaker")
    speaker = Node(
        "talker", env, *enclave("/robot1"), *names, "-r", "chatter:=/conversation", *parameters(seconds=1)
    )
    assert speaker.end().status == 0
    undeclared = Node("talker", env, *enclave("/robot1"), *names, *parameters(seconds=1)).end()
    assert undeclared.status == 1
    assert undeclared.says("DDS refuses the publisher on rt/robot1/chatter"), undeclared.output


def test_two_nodes_in_one_enclave(secured: Path, domain_id: int) -> None:
    env = environment(domain_id, secured)
    talker = Node("talker", env, *enclave("/shared"), *TALK)
    listener = Node("listener", env, *enclave("/shared"), *HEAR)
    assert [listener.end().status, talker.end().status] == [0, 0]


def test_tampered_permissions_end_the_process(secured: Path, domain_id: int, cyclone: Probe) -> None:
    permissions = secured / "enclaves" / "intruder" / "permissions.p7s"
    document = permissions.read_bytes()
    start = document.index(b"<publish>")
    edited = document[:start] + document[start:].replace(b"rt/rosout<", b"rt/chatter<", 1)
    assert edited != document
    permissions.write_bytes(edited)
    ended = Node("intruder", environment(domain_id, secured), *enclave("/intruder")).end()
    assert ended.status == 1, ended.output
    assert ended.says("DDS refuses the participant of enclave /intruder"), ended.output


@pytest.mark.parametrize("missing", ["key.pem", "permissions.p7s", "governance.p7s"])
def test_an_incomplete_enclave_is_not_used(secured: Path, domain_id: int, missing: str) -> None:
    directory = secured / "enclaves" / "talker"
    whole = {path.name for path in directory.iterdir()}
    (directory / missing).unlink()
    ended = Node("talker", environment(domain_id, secured), *enclave("/talker"), *parameters(seconds=1)).end()
    assert missing in whole and ended.status == 1
    assert ended.says(f"lacks {missing}"), ended.output


def test_a_copy_works_without_the_private_part(secured: Path, domain_id: int, tmp_path: Path) -> None:
    """What is deployed to a robot: links kept, CA keys left behind."""
    robot = tmp_path / "robot"
    shutil.copytree(secured, robot, symlinks=True, ignore=shutil.ignore_patterns("private"))
    ended = Node("talker", environment(domain_id, robot), *enclave("/talker"), *parameters(seconds=0.5)).end()
    assert ended.status == 0 and ended.says("secured by enclave /talker"), ended.output
