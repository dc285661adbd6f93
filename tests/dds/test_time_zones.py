"""Dates in every time zone: Fast DDS reads those of permissions as the zone's local time, Cyclone DDS as UTC.

So the certificate, which both read as UTC, must be what decides.
"""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

import keystore
from keystore import Domains, EnclavePolicy, Operation, Profile
from tests.dds.our_keystore import allow
from tests.dds.probe import Participant, Probe

pytestmark = pytest.mark.dds

ZONES = ("UTC", "Asia/Tokyo", "Asia/Kolkata", "America/Los_Angeles", "Pacific/Kiritimati")
NOW = datetime.now(timezone.utc)


def started(dds: Probe, domain: int, root: Path, made: datetime, lifetime: timedelta) -> dict[str, bool]:
    """Which participants start, one for each time zone, in an enclave that was made then for that time."""
    long = timedelta(days=3650)
    creation = keystore.CreateOptions(now=NOW - timedelta(days=2), ca_lifetime=long, durable=False)
    keystore.create_keystore(root, creation)
    options = keystore.ProvisionOptions(
        domains=Domains.single(domain), now=made, lifetime=lifetime, durable=False
    )
    policy = EnclavePolicy("/a", (Profile("/", "a", allow(Operation.PUBLISH, "/x")),))
    keystore.provision(root, [policy], options=options)
    participants = [
        Participant(zone, root / "enclaves/a", publish=("rt/x",), environment=(("TZ", zone),))
        for zone in ZONES
    ]
    return dict(dds.try_endpoints(domain, participants).participants)


def test_an_enclave_of_a_working_day_is_good_at_once_in_every_zone(
    dds: Probe, domain_id: int, tmp_path: Path
) -> None:
    found = started(dds, domain_id, tmp_path / "ks", NOW, timedelta(hours=8))
    assert found == dict.fromkeys(ZONES, True)


def test_an_enclave_that_ended_an_hour_ago_is_refused_in_every_zone(
    dds: Probe, domain_id: int, tmp_path: Path
) -> None:
    found = started(dds, domain_id, tmp_path / "ks", NOW - timedelta(hours=9), timedelta(hours=8))
    assert found == dict.fromkeys(ZONES, False)
