"""Held since a search for lines that no test noticed: certificates that have not begun, keys of waiting CAs."""

from __future__ import annotations

import stat
from datetime import timedelta
from pathlib import Path

import pytest

from keystore import Role, Step, roll_over
from keystore.formats.validity import utc_now
from tests.keystore import kit


@pytest.mark.parametrize(("ahead", "anew"), [(timedelta(days=30), True), (timedelta(0), False)])
def test_what_was_issued_by_a_clock_ahead_is_issued_again(
    ahead: timedelta, anew: bool, tmp_path: Path
) -> None:
    """A robot without a battery for its clock may come up weeks ahead; DDS would then refuse until they have passed."""
    root = kit.filled(tmp_path / "ks", ["/a"])
    kit.filled(root, ["/b"], now=utc_now() + ahead)
    before = (root / "enclaves/b/cert.pem").read_bytes()
    kit.filled(root, ["/a", "/b"])
    assert ((root / "enclaves/b/cert.pem").read_bytes() != before) is anew


def test_the_key_of_a_ca_that_waits_is_readable_by_its_owner_alone(tmp_path: Path) -> None:
    root = kit.filled(tmp_path / "ks", ["/a"])
    roll_over(root, Step.START, tuple(Role), options=kit.options())
    keys = [path for path in (root / "private").rglob("*") if b"PRIVATE KEY" in _content(path)]
    assert len(keys) == 4, "the two in force and the two that wait"
    for key in keys:
        assert stat.S_IMODE(key.stat().st_mode) == 0o600, key
        assert stat.S_IMODE(key.parent.stat().st_mode) == 0o700, key.parent


def _content(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() and not path.is_symlink() else b""
