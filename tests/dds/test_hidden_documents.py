"""An older document hidden in a file: both DDS read it, and no check of ours calls the file good."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from keystore import CaAccess, DamagedKeystoreError, RemoveOptions, Role, remove, renew, verify
from keystore.disk.view import KeystoreView
from keystore.signing import smime
from tests.dds import our_keystore
from tests.dds.probe import Participant, Probe
from tests.dds.sros2_style import Grant
from tests.dds.test_put_back import voices
from tests.keystore.test_forms import behind_a_remark, two_boundaries

pytestmark = pytest.mark.dds

CHATTER, SECRET = "rt/chatter", "rt/secret"
GRANTS = {
    "/talker": Grant(publish=("/chatter",)),
    "/gone": Grant(publish=("/secret",)),
    "/other": Grant(publish=("/secret",)),
    "/listener": Grant(subscribe=("/chatter", "/secret")),
}


@pytest.fixture
def root(tmp_path: Path, domain_id: int) -> Path:
    our_keystore.create(tmp_path / "ks", domain_id, GRANTS)
    return tmp_path / "ks"


def test_permissions_behind_a_second_boundary(dds: Probe, domain_id: int, root: Path) -> None:
    place = root / "enclaves/talker/permissions.p7s"
    wide = (root / "enclaves/talker/permissions.xml").read_bytes().replace(b"rt/chatter", b"rt/secret")
    ca = KeystoreView(root).authority(Role.PERMISSIONS, CaAccess())
    place.write_bytes(two_boundaries(place.read_bytes(), smime.sign_document(wide, ca)))

    talker = Participant("talker", root / "enclaves/talker", publish=(CHATTER, SECRET))
    answers = dds.try_endpoints(domain_id, [talker])
    assert answers.may("talker", "publish", SECRET) and not answers.may("talker", "publish", CHATTER)
    assert not verify(root).is_good

    our_keystore.create(root, domain_id, GRANTS)  # as a start does
    answers = dds.try_endpoints(domain_id, [talker])
    assert answers.may("talker", "publish", CHATTER) and not answers.may("talker", "publish", SECRET)
    assert verify(root).is_good


def test_permissions_that_an_xml_parser_decodes(dds: Probe, domain_id: int, root: Path) -> None:
    """In UTF-7 the second topic is part of a comment; both implementations read the bytes."""
    place, twin = root / "enclaves/talker/permissions.p7s", root / "enclaves/talker/permissions.xml"
    ca = KeystoreView(root).authority(Role.PERMISSIONS, CaAccess())
    hidden = b"<topic>rt/chatter<!-- +AGE--></topic><topic>rt/secret</topic><topic>+AC0ALQA+-</topic>"
    document = twin.read_bytes().replace(b"UTF-8", b"UTF-7").replace(b"<topic>rt/chatter</topic>", hidden)
    place.write_bytes(smime.sign_document(document, ca))
    twin.unlink()

    talker = Participant("talker", root / "enclaves/talker", publish=(SECRET,))
    assert dds.try_endpoints(domain_id, [talker]).may("talker", "publish", SECRET)
    assert not verify(root).is_good
    (root / "private/register.json").unlink()
    with pytest.raises(DamagedKeystoreError, match="byte for byte"):
        renew(root)
    our_keystore.create(root, domain_id, GRANTS)
    assert not dds.try_endpoints(domain_id, [talker]).may("talker", "publish", SECRET)


def test_a_crl_behind_a_remark(dds: Probe, domain_id: int, root: Path, tmp_path: Path) -> None:
    shutil.copytree(root, tmp_path / "copied", symlinks=True)
    gone = {"gone": tmp_path / "copied/enclaves/gone"}
    remove(root, ["/other"], options=RemoveOptions(durable=False))
    earlier = (root / "public/crl.pem").read_bytes()
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    place = root / "public/crl.pem"
    place.write_bytes(behind_a_remark(place.read_bytes(), earlier))
    assert voices(dds, domain_id, root, gone, {"gone"}) == {"gone"}, "DDS reads the earlier list"
    assert not verify(root).is_good
    left = {path: grant for path, grant in GRANTS.items() if path not in ("/gone", "/other")}
    our_keystore.create(root, domain_id, left)
    assert voices(dds, domain_id, root, gone, set()) == set()
    assert verify(root).is_good
