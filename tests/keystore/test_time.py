"""Time: a renewal keeps what was granted, a clock that is wrong forgets nobody, an order that cannot be is refused."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from cryptography import x509

from keystore import (
    CreateOptions,
    InvalidInputError,
    Policy,
    RemoveOptions,
    RenewOptions,
    Step,
    apply_policy,
    create_enclave,
    create_keystore,
    create_tool_enclave,
    provision,
    remove,
    renew,
    roll_over,
    verify,
)
from keystore.disk import layout
from keystore.errors import WrongClockError
from keystore.formats.validity import utc_now
from keystore.steps import creation, opening, provisioning, renewal, tool_enclaves
from keystore.verb import main
from tests.keystore.kit import DAY, certificate_of, contents, filled, options, policy


def renewing(**changes: object) -> RenewOptions:
    return RenewOptions(provisioning=options(), **changes)  # type: ignore[arg-type]


def remaining(root: Path, enclave: str, now: datetime | None = None) -> timedelta:
    facts = certificate_of(root, enclave)
    return facts.validity.not_after - (now or utc_now())


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return filled(tmp_path / "ks", ["/a", "/b"])


def test_a_renewal_keeps_the_lifetime_that_was_granted(root: Path) -> None:
    apply_policy(root, Policy((policy("/a"),)), options=options(lifetime=20 * DAY))
    for enclave, days in (("/a", 20), ("/b", 3650)):
        renew(root, [enclave], options=renewing())
        assert abs(remaining(root, enclave) - days * DAY) < DAY
    longer = RenewOptions(provisioning=options(lifetime=40 * DAY))
    renew(root, ["/a"], options=longer)
    renew(root, ["/a"], options=renewing())
    assert abs(remaining(root, "/a") - 40 * DAY) < DAY


def test_a_tool_is_renewed_by_name_only(root: Path) -> None:
    made = create_tool_enclave(root, "observe", options=options())
    before = remaining(root, made.enclave)
    later = utc_now() + DAY
    for general in ({}, {"everything": True}, {"everything": True, "new_keys": True}):
        renew(root, options=RenewOptions(provisioning=options(now=later), **general))  # type: ignore[arg-type]
        assert abs(remaining(root, made.enclave) - before) < timedelta(minutes=1)
    renew(root, [made.enclave], options=RenewOptions(provisioning=options(now=later)))
    assert remaining(root, made.enclave, later) <= tool_enclaves.DEFAULT_LIFETIME


def test_each_new_expiry_is_told_and_what_of_the_old_stays_valid(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["renew", str(root), "/a"]) == 0
    printed = capsys.readouterr()
    (line,) = [line for line in printed.out.splitlines() if line.startswith("/a: ")]
    assert f"valid until {certificate_of(root, '/a').validity.not_after:%Y-%m-%d}" in line
    assert "earlier certificate of /a" in printed.err and "--revoke-old" in printed.err
    assert main(["renew", str(root), "/a", "--revoke-old"]) == 0
    assert "earlier certificate" not in capsys.readouterr().err


def test_what_changes_nothing_is_wrong_usage(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["renew", str(root), "--new-keys"]) == 2
    assert "--all" in capsys.readouterr().err
    assert main(["renew", str(root), "--ca", "finish"]) == 2
    assert "--ca start" in capsys.readouterr().err
    assert main(["renew", str(root), "--all", "--new-keys"]) == 0
    for step in Step:
        roll_over(root, step, options=options())
    with pytest.raises(InvalidInputError, match="there is no new"):
        roll_over(filled(root.parent / "other", ["/a"]), Step.SWITCH, options=options())


def revoked(root: Path) -> set[int]:
    crl = x509.load_pem_x509_crl((root / layout.CRL).read_bytes())
    return {entry.serial_number for entry in crl}


@pytest.mark.parametrize("ahead", [40 * DAY, 365 * DAY])
def test_a_clock_that_is_ahead_takes_nobody_off_the_crl(root: Path, ahead: timedelta) -> None:
    apply_policy(root, Policy((policy("/gone"),)), options=options(lifetime=10 * DAY))
    remove(root, ["/gone"], options=RemoveOptions(durable=False))
    before = revoked(root)
    assert before
    for _ in range(2):
        renew(
            root, ["/a"], options=RenewOptions(provisioning=options(now=utc_now() + ahead), revoke_old=True)
        )
    assert before < revoked(root)


@pytest.mark.parametrize("shift", [-2 * DAY, -4000 * DAY, 400 * DAY])
def test_a_clock_far_from_the_registers_time_is_refused(
    root: Path, shift: timedelta, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = contents(root)
    for module in (renewal, provisioning):
        monkeypatch.setattr(module, "utc_now", lambda: utc_now() + shift)
    with pytest.raises(WrongClockError, match="--accept-clock"):
        renew(root, ["/a"], options=renewing())
    assert contents(root) == before
    if shift > timedelta(0):
        accepting = RenewOptions(provisioning=options(accept_clock=True))
        assert renew(root, ["/b"], options=accepting).changed
        assert renew(root, ["/a"], options=renewing()).changed


def test_a_clock_near_it_is_not(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert timedelta(days=400) > opening._AHEAD
    for shift in (-timedelta(hours=20), 300 * DAY):
        for module in (renewal, provisioning):
            monkeypatch.setattr(module, "utc_now", lambda moved=shift: utc_now() + moved)
        assert renew(root, ["/a"], options=renewing()).changed


@pytest.mark.parametrize(("ahead", "renewed"), [(timedelta(days=30), True), (timedelta(0), False)])
def test_what_was_issued_by_a_clock_ahead_is_issued_again(
    ahead: timedelta, renewed: bool, tmp_path: Path
) -> None:
    """The clock of a robot without a battery may be weeks ahead. DDS refuses such a certificate until its start."""
    root = filled(tmp_path / "ks", ["/a"])
    filled(root, ["/b"], now=utc_now() + ahead)
    before = (root / "enclaves/b/cert.pem").read_bytes()
    filled(root, ["/a", "/b"])
    assert ((root / "enclaves/b/cert.pem").read_bytes() != before) is renewed


BOOT = datetime(1970, 1, 1, 0, 2, tzinfo=timezone.utc)
"""A board without a battery clock boots in 1970."""


def test_a_first_boot_in_1970_makes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (creation, provisioning):
        monkeypatch.setattr(module, "utc_now", lambda: BOOT)
    root = tmp_path / "ks"
    for create in (lambda: create_keystore(root), lambda: filled(root)):
        with pytest.raises(WrongClockError, match=r"the clock says 1970.* --accept-clock"):
            create()
        assert not root.exists()
    create_keystore(root, CreateOptions(accept_clock=True))
    assert root.exists()


def test_a_clock_before_the_keystore_is_named_and_nothing_else(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing has expired: what has not begun is no reason to replace it."""
    assert verify(root).is_good
    (finding,) = verify(root, now=BOOT).findings
    assert finding.code == "clock" and "set the clock" in finding.message
    before = contents(root)
    monkeypatch.setattr(provisioning, "utc_now", lambda: utc_now() - 3 * DAY)
    with pytest.raises(WrongClockError, match="the CAs of this keystore begin at"):
        provision(root, [policy("/a"), policy("/b")], options=options())
    assert contents(root) == before


def test_a_lifetime_that_the_ca_cuts_short_is_reported(tmp_path: Path) -> None:
    root = tmp_path / "ks"
    create_keystore(root, CreateOptions(ca_lifetime=20 * DAY))
    said = create_enclave(root, "/a", options=options(lifetime=365 * DAY)).warnings
    assert any("CA ends at" in each for each in said)
    said = create_enclave(root, "/b", options=options(lifetime=10 * DAY)).warnings
    assert not any("CA ends at" in each for each in said)


def test_permissions_outlast_their_certificate_by_every_time_zone(root: Path) -> None:
    """Fast DDS reads the dates of permissions as local time, Cyclone DDS as UTC; those of certificates both as UTC."""
    text = (root / "enclaves/a/permissions.xml").read_text()
    begin, end = (
        datetime.fromisoformat(text.partition(f"<{tag}>")[2].partition("<")[0]).replace(tzinfo=timezone.utc)
        for tag in ("not_before", "not_after")
    )
    certificate = certificate_of(root, "/a").validity
    assert certificate.not_before - begin == end - certificate.not_after == timedelta(hours=14)
