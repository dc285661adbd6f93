"""Who puts back what a keystore had before: copies, backups, earlier lists. On both DDS, beside what may stay."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import keystore
from keystore import Domains, RemoveOptions, RenewOptions, remove, renew
from tests.dds import our_keystore
from tests.dds.probe import Participant, Probe
from tests.dds.sros2_style import Grant

pytestmark = pytest.mark.dds

CHATTER, SECRET = "rt/chatter", "rt/secret"
BEFORE = {
    "/talker": Grant(publish=("/chatter", "/secret")),
    "/gone": Grant(publish=("/secret",)),
    "/listener": Grant(subscribe=("/chatter", "/secret")),
}
REDUCED = {**BEFORE, "/talker": Grant(publish=("/chatter",))}


@pytest.fixture
def root(tmp_path: Path, domain_id: int) -> Path:
    our_keystore.create(tmp_path / "ks", domain_id, BEFORE)
    return tmp_path / "ks"


@pytest.fixture
def copied(root: Path, tmp_path: Path) -> Path:
    """Enclaves as somebody copied them while they had all their rights; no list of revocations among them."""
    shutil.copytree(root, tmp_path / "copied", symlinks=True)
    return tmp_path / "copied/enclaves"


def with_old_permissions(root: Path, copied: Path, tmp_path: Path) -> Path:
    """The enclave as it is now, with the document it had."""
    shutil.copytree(root / "enclaves/talker", tmp_path / "mixed", symlinks=False)
    shutil.copy(copied / "talker/permissions.p7s", tmp_path / "mixed/permissions.p7s")
    return tmp_path / "mixed"


def voices(dds: Probe, domain: int, root: Path, attackers: dict[str, Path], expected: set[str]) -> set[str]:
    """Whom a listener of ``root`` hears, beside the talker that may: that one is always waited for."""
    answers, _ = dds.talk(
        domain,
        Participant("listener", root / "enclaves/listener", subscribe=(CHATTER, SECRET)),
        [
            Participant("honest", root / "enclaves/talker", publish=(CHATTER,)),
            *(Participant(label, place, publish=(SECRET,)) for label, place in attackers.items()),
        ],
        expected={"honest", *expected},
        settle=0.0 if expected == set(attackers) else 3.0,
    )
    assert "honest" in answers.voices, answers.log
    return answers.voices - {"honest"}


def test_permissions_that_were_taken_away_stay_away(
    dds: Probe, domain_id: int, root: Path, copied: Path, tmp_path: Path
) -> None:
    assert voices(dds, domain_id, root, {"copy": copied / "talker"}, {"copy"}) == {"copy"}, "it may, so far"
    our_keystore.create(root, domain_id, REDUCED)

    mixed = Participant("mixed", with_old_permissions(root, copied, tmp_path), publish=(SECRET,))
    rightly = Participant("rightly", root / "enclaves/talker", publish=(CHATTER, SECRET))
    answers = dds.try_endpoints(domain_id, [mixed, rightly])
    assert not answers.may("mixed", "publish", SECRET), "the old document does not fit the new subject"
    assert answers.may("rightly", "publish", CHATTER) and not answers.may("rightly", "publish", SECRET)

    assert voices(dds, domain_id, root, {"copy": copied / "talker"}, set()) == set(), (
        "the old certificate is revoked"
    )


def test_an_earlier_list_of_revocations_does_not_bring_anybody_back(
    dds: Probe, domain_id: int, root: Path, copied: Path, tmp_path: Path
) -> None:
    our_keystore.create(root, domain_id, {"/other": Grant(publish=("/secret",))})
    remove(root, ["/other"], options=RemoveOptions(durable=False))
    shutil.copy(root / "public/crl.pem", tmp_path / "earlier.pem")
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    assert voices(dds, domain_id, root, {"gone": copied / "gone"}, set()) == set()
    shutil.copy(tmp_path / "earlier.pem", root / "public/crl.pem")
    assert voices(dds, domain_id, root, {"gone": copied / "gone"}, {"gone"}) == {"gone"}, "DDS cannot know"
    options = keystore.ProvisionOptions(domains=Domains.single(domain_id), durable=False)
    left = {path: grant for path, grant in BEFORE.items() if path != "/gone"}
    report = keystore.provision(root, our_keystore.policies(left), options=options)
    assert report.created == ("CRL published again: the CRL is not the one published last",)
    assert voices(dds, domain_id, root, {"gone": copied / "gone"}, set()) == set()


def test_a_foreign_ca_among_the_trusted_is_removed(
    dds: Probe, domain_id: int, root: Path, tmp_path: Path
) -> None:
    """Fast DDS trusts every certificate of the file, Cyclone DDS the first. The foreigner brings its own identity and
    a document that our CA signed for the same subject."""
    our_keystore.create(tmp_path / "foreign", domain_id, BEFORE)
    trusted = root / "public/identity_ca.cert.pem"
    foreign = (tmp_path / "foreign/public/identity_ca.cert.pem").read_bytes()
    enclave = tmp_path / "foreigner"
    shutil.copytree(root / "enclaves/gone", enclave, symlinks=False)
    for name in ("key.pem", "cert.pem"):
        shutil.copy(tmp_path / "foreign/enclaves/gone" / name, enclave / name)
    (enclave / "identity_ca.cert.pem").write_bytes(foreign + trusted.read_bytes())
    trusted.write_bytes(trusted.read_bytes() + foreign)

    heard = {"foreigner"} if dds.name == "Fast DDS" else set[str]()
    assert voices(dds, domain_id, root, {"foreigner": enclave}, heard) == heard
    with pytest.raises(keystore.KeystoreError, match="a CA that this keystore did not make"):
        our_keystore.create(root, domain_id, BEFORE)
    renew(root, options=RenewOptions(provisioning=keystore.ProvisionOptions(durable=False)))
    assert voices(dds, domain_id, root, {"foreigner": enclave}, set()) == set()
