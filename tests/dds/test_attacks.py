"""The attacker who holds one enclave, on real DDS: succeeds against SROS2's keystores, not against ours.

Each test tries the same on both, so that it can fail. What is accepted of an SROS2-style keystore is what
the two implementations are known to accept (Cyclone DDS 0.10: CVE-2023-24011 and subjects compared as bags;
Fast DDS 2.9.1: CVE-2023-24010).
"""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from keystore import ProvisionOptions, RenewOptions, remove, renew
from tests.dds import attacks, our_keystore, sros2_style
from tests.dds.attacks import ENCLAVES, GRANTS, HONEST, REVOKED, VICTIM, Attempt, Workshop, borrowed_label
from tests.dds.probe import Probe

pytestmark = pytest.mark.dds

HONEST_VOICE = f"honest {HONEST}"


@pytest.fixture
def sros2(tmp_path: Path, domain_id: int) -> Workshop:
    sros2_style.create(tmp_path / "sros2", domain_id, GRANTS)
    return _workshop(tmp_path, "sros2")


@pytest.fixture
def ours(tmp_path: Path, domain_id: int) -> Workshop:
    our_keystore.create(tmp_path / "ours", domain_id, GRANTS)
    return _workshop(tmp_path, "ours")


def _workshop(tmp_path: Path, name: str) -> Workshop:
    attempts = tmp_path / f"attempts-{name}"
    attempts.mkdir()
    return Workshop(tmp_path / name, attempts)


@dataclass(frozen=True)
class Outcome:
    """``admitted``: whose own DDS let it publish; ``heard``: whom the victim heard. Labels of attempts."""

    admitted: set[str]
    heard: set[str]


NOBODY = Outcome(set(), set())


def outcome(
    dds: Probe,
    domain_id: int,
    workshop: Workshop,
    attempts: Sequence[Attempt],
    expected: Collection[str] = (),
    patched: Path | None = None,
) -> Outcome:
    """Try ``attempts`` beside an honest talker; wait until the victim has heard it and the ``expected`` ones.

    ``patched`` is preloaded into the talkers. Where many get past their own DDS, only so many try at once as
    the victim can deal with in the seconds it is given.
    """
    together = dds.crowd if patched or expected else len(attempts)
    admitted, heard = set[str](), set[str]()
    for start in range(0, len(attempts), together):
        batch = attempts[start : start + together]
        some = _outcome(dds, domain_id, workshop, batch, expected, patched)
        admitted |= some.admitted
        heard |= some.heard
    return Outcome(admitted, heard)


def _outcome(
    dds: Probe,
    domain_id: int,
    workshop: Workshop,
    attempts: Sequence[Attempt],
    expected: Collection[str],
    patched: Path | None,
) -> Outcome:
    talkers = [workshop.honest(HONEST), *attempts]
    listener, talking = dds.talk(
        domain_id,
        attacks.victim(workshop.enclave(VICTIM)),
        [attempt.participant(patched is not None) for attempt in talkers],
        {HONEST_VOICE, *(labels(attempts) & set(expected))},
        settle=4.0 if patched and len(attempts) > 1 else 2.0,
        environment={"LD_PRELOAD": str(patched)} if patched else None,
    )
    assert HONEST_VOICE in listener.voices, f"the victim heard not even the honest talker\n{listener.log}"
    admitted = {
        attempt.label for attempt in attempts if talking.may(attempt.label, "publish", f"rt{attempt.topic}")
    }
    return Outcome(admitted, listener.voices - {HONEST_VOICE})


def subject_bag(enclave: str) -> set[str]:
    """What Cyclone DDS makes of ``CN=<enclave>``."""
    return set(f"CN={enclave}".replace("CN=/", "CN=|/").replace("/", "|").split("|"))


def bag_matches() -> set[str]:
    return {
        borrowed_label(borrower, lender)
        for borrower, lender in itertools.permutations(ENCLAVES, 2)
        if subject_bag(borrower) <= subject_bag(lender)
    }


def labels(attempts: Sequence[Attempt]) -> set[str]:
    return {attempt.label for attempt in attempts}


def test_permissions_cannot_be_borrowed(
    dds: Probe, sros2: Workshop, ours: Workshop, domain_id: int, patched_dds: Path
) -> None:
    """All ordered pairs: the identity of one enclave with the permissions of another."""
    assert len(bag_matches()) == 11
    accepted = bag_matches() if dds.name == "Cyclone DDS" else set[str]()
    attempts = list(sros2.borrowed())
    assert outcome(dds, domain_id, sros2, attempts, accepted) == Outcome(accepted, accepted)

    attempts = list(ours.borrowed())
    assert outcome(dds, domain_id, ours, attempts) == NOBODY
    tempting = [attempt for attempt in attempts if attempt.label in bag_matches()]
    assert outcome(dds, domain_id, ours, tempting, patched=patched_dds) == Outcome(bag_matches(), set())


def test_an_enclave_cannot_sign_its_own_documents(
    dds: Probe, sros2: Workshop, ours: Workshop, domain_id: int, patched_dds: Path
) -> None:
    def forged(workshop: Workshop) -> list[Attempt]:
        signers = ("/", "/a")
        return [workshop.self_signed_permissions(path) for path in signers] + [
            workshop.self_signed_governance(path) for path in signers
        ]

    attempts = forged(sros2)
    everyone = labels(attempts)
    assert outcome(dds, domain_id, sros2, attempts, everyone) == Outcome(everyone, everyone)

    attempts = forged(ours)
    assert outcome(dds, domain_id, ours, attempts) == NOBODY
    assert outcome(dds, domain_id, ours, attempts, patched=patched_dds) == Outcome(everyone, set())


def test_false_expired_and_tampered_credentials_are_refused(
    dds: Probe, ours: Workshop, domain_id: int, patched_dds: Path
) -> None:
    """What DDS itself sees through, whoever made the keystore; the untouched enclave is heard."""
    honest, unknown = ours.honest("/a"), ours.unknown_authority("/a")
    expired = ours.expired_identity("/a", sros2_style.Credential.of_ca(ours.keystore))
    attempts = [honest, unknown, expired, ours.tampered_permissions("/a")]
    # The world of an unknown CA is consistent in itself: only the victim can refuse it.
    at_home = labels([honest, unknown])
    assert outcome(dds, domain_id, ours, attempts, {honest.label}) == Outcome(at_home, {honest.label})
    patched = outcome(dds, domain_id, ours, attempts, {honest.label}, patched_dds)
    assert patched.heard == {honest.label}
    # Cyclone DDS looks at the end of an identity a second time, where our patch does not reach.
    assert labels(attempts) - patched.admitted <= {expired.label}


def test_a_revoked_identity_is_refused(
    dds: Probe, sros2: Workshop, ours: Workshop, domain_id: int, patched_dds: Path
) -> None:
    """A copy made before its enclave was removed; SROS2, which writes no revocation list, cannot stop it."""
    stolen = sros2.stolen_copy(REVOKED)
    shutil.rmtree(sros2.enclave(REVOKED))
    alive = Outcome({stolen.label}, {stolen.label})
    assert outcome(dds, domain_id, sros2, [stolen], {stolen.label}) == alive

    stolen = ours.stolen_copy(REVOKED)
    assert outcome(dds, domain_id, ours, [stolen], {stolen.label}) == alive
    remove(ours.keystore, [REVOKED])
    assert outcome(dds, domain_id, ours, [stolen]) == Outcome({stolen.label}, set())
    assert outcome(dds, domain_id, ours, [stolen], patched=patched_dds) == Outcome({stolen.label}, set())


def test_nobody_without_credentials_is_heard(dds: Probe, ours: Workshop, domain_id: int) -> None:
    """A participant without any security may create what it likes, and reaches nobody."""
    outsider = Attempt("outsider", None, attacks.SECRET)
    assert outcome(dds, domain_id, ours, [outsider]) == Outcome({"outsider"}, set())


def test_renewal_repairs_a_keystore_of_sros2(
    dds: Probe, sros2: Workshop, domain_id: int, tmp_path: Path, patched_dds: Path
) -> None:
    """What was copied and forged before the renewal is worth nothing after it, and cannot be made anew."""
    before = [*sros2.borrowed(), sros2.self_signed_permissions("/a"), sros2.self_signed_governance("/a")]
    accepted = labels(before[-2:]) | (bag_matches() if dds.name == "Cyclone DDS" else set())
    renew(sros2.keystore, options=RenewOptions(provisioning=ProvisionOptions(durable=False)))
    assert outcome(dds, domain_id, sros2, before) == Outcome(accepted, set())

    (tmp_path / "afterwards").mkdir()
    renewed = Workshop(sros2.keystore, tmp_path / "afterwards")
    after = [*renewed.borrowed(), renewed.self_signed_permissions("/a"), renewed.self_signed_governance("/a")]
    assert outcome(dds, domain_id, renewed, after) == NOBODY
    assert outcome(dds, domain_id, renewed, after[-2:], patched=patched_dds) == Outcome(
        labels(after[-2:]), set()
    )
