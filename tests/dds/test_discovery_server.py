"""A discovery server of Fast DDS 2.9: secured clients of a plain one never meet, and a weak governance is a way past
the enclaves. The security log of Fast DDS names what was refused."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

import keystore
from keystore import Domains, EnclavePolicy, Governance, Operation, Profile, verify
from keystore.formats.governance import DomainRule, Protection, TopicRule
from tests.dds.our_keystore import allow
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

OPEN_TOPIC = TopicRule(
    "rt/*",
    enable_discovery_protection=False,
    enable_liveliness_protection=False,  # with it nobody was heard, in four runs
    metadata_protection_kind=Protection.NONE,
    data_protection_kind=Protection.NONE,
)


def provisioned(root: Path, domain: int, rule: DomainRule) -> Path:
    keystore.create_keystore(root, keystore.CreateOptions(governance=Governance((rule,)), durable=False))
    policies = [
        EnclavePolicy("/talker", (Profile("/", "talker", allow(Operation.PUBLISH, "/x")),)),
        EnclavePolicy("/listener", (Profile("/", "listener", allow(Operation.SUBSCRIBE, "/x")),)),
    ]
    options = keystore.ProvisionOptions(domains=Domains.single(domain), durable=False)
    keystore.provision(root, policies, options=options)
    return root / "enclaves"


@contextlib.contextmanager
def plain_server(fastdds: Probe, domain: int) -> Iterator[str]:
    """Run one on loopback; gives what ROS_DISCOVERY_SERVER is to say."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = Participant("server", None, environment=(("PROBE_SERVER_PORT", str(port)),))
    with fastdds._running(domain, [server], 120.0):
        yield f"127.0.0.1:{port}"


def voices(
    fastdds: Probe, domain: int, server: str, listener: Path | None, talkers: dict[str, Path | None]
) -> set[str]:
    client = (("ROS_DISCOVERY_SERVER", server),)
    answers, _ = fastdds.talk(
        domain,
        Participant("listener", listener, subscribe=("rt/x",), environment=client),
        [
            Participant(label, place, publish=("rt/x",), environment=client)
            for label, place in talkers.items()
        ],
        {"plain"} & talkers.keys() if listener is None else set(),
        settle=8.0,
    )
    return answers.voices


def test_secured_clients_of_a_plain_server_never_meet(fastdds: Probe, domain_id: int, tmp_path: Path) -> None:
    enclaves = provisioned(tmp_path / "ks", domain_id, DomainRule(domains=Domains.single(domain_id)))
    with plain_server(fastdds, domain_id) as server:
        assert voices(fastdds, domain_id, server, None, {"plain": None}) == {"plain"}, "the server works"
        assert (
            voices(fastdds, domain_id, server, enclaves / "listener", {"honest": enclaves / "talker"})
            == set()
        )


def test_the_governance_that_verify_calls_open_lets_plain_participants_through_a_server(
    fastdds: Probe, domain_id: int, tmp_path: Path
) -> None:
    weak = DomainRule(
        domains=Domains.single(domain_id), rtps_protection_kind=Protection.NONE, topic_rules=(OPEN_TOPIC,)
    )
    enclaves = provisioned(tmp_path / "ks", domain_id, weak)
    assert "governance-open" in {one.code for one in verify(tmp_path / "ks").findings}
    with plain_server(fastdds, domain_id) as server:
        secured_hears = voices(fastdds, domain_id, server, enclaves / "listener", {"plain": None})
        plain_hears = voices(fastdds, domain_id, server, None, {"honest": enclaves / "talker", "plain": None})
    assert "plain" in secured_hears or "honest" in plain_hears


def test_the_security_log_of_fast_dds_names_what_was_refused(
    fastdds: Probe, domain_id: int, tmp_path: Path
) -> None:
    enclaves = provisioned(tmp_path / "ks", domain_id, DomainRule(domains=Domains.single(domain_id)))
    log = tmp_path / "security.log"
    logging = (("ROS_SECURITY_LOG_FILE", str(log)), ("ROS_SECURITY_LOG_VERBOSITY", "WARNING"))
    talker = Participant("talker", enclaves / "talker", publish=("rt/x", "rt/y"), environment=logging)
    answers = fastdds.try_endpoints(domain_id, [talker])
    assert answers.may("talker", "publish", "rt/x") and not answers.may("talker", "publish", "rt/y")
    written = log.read_text()
    assert "rt/y" in written and "rt/x" not in written
