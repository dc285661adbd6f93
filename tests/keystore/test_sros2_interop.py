"""The same keystore under SROS2's own code and ours. Needs its sources, see ``sros2_peer``; otherwise skipped,
and the golden facts in the other test files (layout, links, required files, S/MIME form) stand for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from keystore import (
    RenewOptions,
    Severity,
    SubjectScheme,
    create_enclave,
    list_enclaves,
    provision,
    renew,
    verify,
)
from keystore.disk import layout
from keystore.disk.signed_documents import own_document
from keystore.disk.view import KeystoreView
from keystore.formats.permissions_document import parse_permissions, read_foreign_permissions
from tests.keystore import sros2_peer
from tests.keystore.kit import created, filled, options, policy

pytestmark = pytest.mark.skipif(
    not sros2_peer.available(), reason="SROS2_PYTHON and SROS2_PYTHONPATH are not set"
)

CREATE = """
import pathlib, sys
from sros2 import keystore
root = pathlib.Path(sys.argv[1])
if not keystore.is_valid_keystore(root):
    keystore.create_keystore(root)
for name in sys.argv[2:]:
    keystore.create_enclave(root, name)
"""
LIST = """
import pathlib, sys
from sros2 import keystore
root = pathlib.Path(sys.argv[1])
assert keystore.is_valid_keystore(root)
print(*sorted(keystore.get_enclaves(root)))
"""


def codes(root: Path, severity: Severity) -> set[str]:
    return {finding.code for finding in verify(root).findings if finding.severity is severity}


@pytest.fixture
def theirs(tmp_path: Path) -> Path:
    sros2_peer.run(CREATE, tmp_path / "theirs", "/", "/a", "/a/b", scratch=tmp_path)
    return tmp_path / "theirs"


def test_theirs_is_read_and_reported_as_exposed(theirs: Path) -> None:
    assert list_enclaves(theirs) == ["/", "/a", "/a/b"]
    exposed = {"shared-ca", "leaf-can-sign", "borrowed-permissions", "no-register"}
    assert codes(theirs, Severity.EXPOSURE) == exposed
    assert codes(theirs, Severity.ERROR) <= {"readable-by-others", "other-form"}, "else it is whole"


def test_theirs_is_extended_by_both_in_turns(theirs: Path, tmp_path: Path) -> None:
    create_enclave(theirs, "/ours", options=options())
    sros2_peer.run(CREATE, theirs, "/theirs", scratch=tmp_path)
    assert sros2_peer.run(LIST, theirs, scratch=tmp_path).split() == ["/.", "/a", "/a/b", "/ours", "/theirs"]


def test_theirs_is_repaired(theirs: Path, tmp_path: Path) -> None:
    before = read_foreign_permissions((theirs / "enclaves/a/permissions.xml").read_bytes(), "/a", "a")
    assert before.lost == ()
    renew(theirs, options=RenewOptions(provisioning=options()))
    assert verify(theirs).is_good
    assert grants(theirs, "/a") == before.permissions.rules
    assert sros2_peer.run(LIST, theirs, scratch=tmp_path)


def grants(root: Path, name: str) -> object:
    document = own_document(KeystoreView(root), f"{layout.enclave_directory(name)}/permissions.p7s")
    return parse_permissions(document).rules


def test_ours_passes_their_checks(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a", "/a/b"])
    assert sros2_peer.run(LIST, root, scratch=tmp_path).split() == ["/a", "/a/b"]


def test_ours_is_extended_by_theirs(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/a"])
    sros2_peer.run(CREATE, root, "/b", scratch=tmp_path)
    assert list_enclaves(root) == ["/a", "/b"]
    assert not codes(root, Severity.EXPOSURE), "two CAs keep even their certificates from signing"


def test_compatible_subjects_work_with_their_permissions(tmp_path: Path) -> None:
    """`ros2 security create_permission` writes CN=<path>: with compatible subjects it fits our certificate."""
    root = created(tmp_path / "ks", subjects=SubjectScheme.COMPATIBLE)
    provision(root, [policy("/talker")], options=options())
    program = (
        "import pathlib, sys\n"
        "from sros2 import keystore\n"
        "keystore.create_permission(pathlib.Path(sys.argv[1]), '/talker', pathlib.Path(sys.argv[2]))\n"
    )
    (tmp_path / "policy.xml").write_text(
        '<policy version="0.2.0"><enclaves><enclave path="/talker"><profiles><profile ns="/" node="talker">'
        '<topics publish="ALLOW"><topic>chatter</topic></topics></profile></profiles></enclave></enclaves></policy>'
    )
    sros2_peer.run(program, root, tmp_path / "policy.xml", scratch=tmp_path)
    assert codes(root, Severity.ERROR) == {"other-form"}, "signed by our CA, not as we write it"
