"""What a keystore of ours can be and go through, as DDS sees it: names, domains, protections, new CAs."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import keystore
from keystore import (
    DomainRule,
    Domains,
    Governance,
    Protection,
    Role,
    Step,
    TopicRule,
    roll_over,
)
from tests.dds import our_keystore
from tests.dds.probe import Participant, Probe
from tests.dds.sros2_style import Grant

pytestmark = pytest.mark.dds

TALKER, LISTENER = "/talker", "/listener"
GRANTS = {TALKER: Grant(publish=("/chatter",)), LISTENER: Grant(subscribe=("/chatter",))}


def directory(root: Path, enclave: str) -> Path:
    return root / "enclaves" / enclave.lstrip("/")


def heard(dds: Probe, domain: int, talking: Path, listening: Path, hope: bool = True) -> bool:
    """Whether a listener of the keystore ``listening`` hears a talker of ``talking``.

    Where it ought not to (``hope``), a second talker, of ``listening``, must be heard: then silence means something.
    Only there, since of three that meet at once Fast DDS 2.9 sometimes authenticates one after half a minute.
    """
    talkers = [Participant("talker", directory(talking, TALKER), publish=("rt/chatter",))]
    if not hope:
        talkers.append(Participant("control", directory(listening, TALKER), publish=("rt/chatter",)))
    expected = talkers[-1].label
    answers, said = dds.talk(
        domain,
        Participant("listener", directory(listening, LISTENER), subscribe=("rt/chatter",)),
        talkers,
        expected={expected},
        settle=0.0 if hope else 3.0,
    )
    assert expected in answers.voices, (answers, answers.log, said, said.log)
    return "talker" in answers.voices


def test_any_enclave_name_works_beside_the_root(dds: Probe, domain_id: int, tmp_path: Path) -> None:
    """With SROS2's subjects a name has at most 64 characters, and ``/`` does not go with others."""
    enclaves = ("/", "/a", "/a/b", "/b/a", "/" + "x" * 200, "/part" * 19, "/_private/_parts")
    grants = {path: Grant(publish=(f"/topic{number}",)) for number, path in enumerate(enclaves)}
    our_keystore.create(tmp_path / "ks", domain_id, grants)
    topics = tuple(f"rt/topic{number}" for number in range(len(enclaves)))
    answers = dds.try_endpoints(
        domain_id, [Participant(path, directory(tmp_path / "ks", path), publish=topics) for path in enclaves]
    )
    for number, path in enumerate(enclaves):
        assert [answers.may(path, "publish", topic) for topic in topics] == [
            other == number for other in range(len(enclaves))
        ]


def test_permissions_hold_in_their_domains_only(dds: Probe, domain_id: int, tmp_path: Path) -> None:
    for name, text in {"range": f"0-{domain_id}", "list": f"{domain_id},230", "elsewhere": "200-230"}.items():
        options = keystore.ProvisionOptions(domains=Domains.parse(text), durable=False)
        keystore.provision(
            tmp_path / name, our_keystore.policies({"/a": Grant(publish=("/x",))}), options=options
        )
    enclaves = {name: directory(tmp_path / name, "/a") for name in ("range", "list", "elsewhere")}
    answers = dds.try_endpoints(
        domain_id, [Participant(name, path, publish=("rt/x",)) for name, path in enclaves.items()]
    )
    assert {name: answers.may(name, "publish", "rt/x") for name in enclaves} == {
        "range": True,
        "list": True,
        "elsewhere": False,
    }


def test_launches_that_share_an_enclave_each_keep_their_rights(
    dds: Probe, domain_id: int, tmp_path: Path
) -> None:
    """Bring-up runs, navigation comes and goes, bring-up asks for less: what each may do, as DDS sees it."""
    root = tmp_path / "ks"
    holds = {name: keystore.LaunchHold(root, f"/ws/{name}.launch.xml") for name in ("bringup", "navigation")}

    def start(name: str, *topics: str) -> None:
        options = keystore.ProvisionOptions(
            domains=Domains.single(domain_id), durable=False, launch=holds[name]
        )
        keystore.provision(root, our_keystore.policies({"/a": Grant(publish=topics)}), options=options)

    def may() -> set[str]:
        topics = ("rt/odom", "rt/plan", "rt/secret", "rt/neither")
        answers = dds.try_endpoints(domain_id, [Participant("a", directory(root, "/a"), publish=topics)])
        return {topic for topic in topics if answers.may("a", "publish", topic)}

    start("bringup", "/odom", "/secret")
    start("navigation", "/plan")
    assert may() == {"rt/odom", "rt/plan", "rt/secret"}
    for hold in holds.values():
        hold.close()
        hold.enclaves.clear()
    start("bringup", "/odom")
    assert may() == {"rt/odom", "rt/plan"}


STRICTEST = DomainRule(
    discovery_protection_kind=Protection.ENCRYPT_WITH_ORIGIN_AUTHENTICATION,
    liveliness_protection_kind=Protection.ENCRYPT_WITH_ORIGIN_AUTHENTICATION,
    rtps_protection_kind=Protection.ENCRYPT_WITH_ORIGIN_AUTHENTICATION,
    topic_rules=(TopicRule(metadata_protection_kind=Protection.ENCRYPT_WITH_ORIGIN_AUTHENTICATION),),
)
LIGHTEST = DomainRule(
    discovery_protection_kind=Protection.NONE,
    liveliness_protection_kind=Protection.NONE,
    rtps_protection_kind=Protection.NONE,
    topic_rules=(
        TopicRule(
            "rt/chatter", metadata_protection_kind=Protection.NONE, data_protection_kind=Protection.NONE
        ),
        TopicRule(),
    ),
)


@pytest.mark.parametrize("rule", [STRICTEST, LIGHTEST], ids=["strictest", "lightest"])
def test_governance_of_ones_own(dds: Probe, domain_id: int, tmp_path: Path, rule: DomainRule) -> None:
    domains = Domains.single(domain_id)
    governance = Governance((replace(rule, domains=domains),))
    creation = keystore.CreateOptions(domains=domains, governance=governance, durable=False)
    keystore.create_keystore(tmp_path / "ks", creation)
    options = keystore.ProvisionOptions(domains=domains, durable=False)
    keystore.provision(tmp_path / "ks", our_keystore.policies(GRANTS), options=options)
    assert heard(dds, domain_id, tmp_path / "ks", tmp_path / "ks")


@pytest.mark.parametrize("role", Role)
def test_an_authority_can_be_replaced(dds: Probe, domain_id: int, tmp_path: Path, role: Role) -> None:
    """A host that is one step behind the others.

    Every step but the switch is bridged. The switch of the identity CA is bridged by Fast DDS, which trusts each
    certificate of ``identity_ca.cert.pem``; of the permissions CA's both implementations use only the first.
    """
    root, behind = tmp_path / "ks", tmp_path / "before"
    our_keystore.create(root, domain_id, GRANTS)
    shutil.copytree(root, behind, symlinks=True)
    for step in Step:
        roll_over(root, step, [role], options=keystore.ProvisionOptions(durable=False))
        bridged = step is not Step.SWITCH or (dds.name == "Fast DDS" and role is Role.IDENTITY)
        assert heard(dds, domain_id, behind, root, hope=bridged) == bridged, step
        behind = tmp_path / f"after-{step.value}"
        shutil.copytree(root, behind, symlinks=True)
