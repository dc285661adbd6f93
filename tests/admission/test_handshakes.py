"""Cyclone DDS refuses handshakes that Fast DDS begins: the pairs are told, and subjects are chosen that avoid them."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from cryptography import x509

from enclave_launch import provision
from enclave_launch.admission.middleware import (
    EnclaveProcess,
    Pair,
    Vendor,
    failing,
    guid_halves,
    mixed_pairs,
)
from enclave_launch.diagnostics import Code
from keystore import verify
from keystore.formats.subject import Half, common_name, guid_prefix, half_of

from .conftest import Plan

NODE = '<node pkg="demo_nodes" exec="{}" enclave="{}"><env name="RMW_IMPLEMENTATION" value="{}"/>{}</node>'
FAST, CYCLONE = "rmw_fastrtps_cpp", "rmw_cyclonedds_cpp"


def prefix_of(certificate: x509.Certificate) -> int:
    """As running-system measurements on both implementations gave it (DDS-Security 9.3.3)."""
    digest = hashlib.sha256(certificate.subject.public_bytes()).digest()
    return (int.from_bytes(digest[:6], "big") >> 1) | 1 << 47


def certificate(keystore: Path, enclave: str) -> x509.Certificate:
    return x509.load_pem_x509_certificate(
        (keystore / "enclaves" / enclave.lstrip("/") / "cert.pem").read_bytes()
    )


@pytest.mark.parametrize(
    "enclave", ["/", "/a", "/front/camera", "/" + "x" * 60, "/" + "/".join("abcdefghij" * 8)]
)
def test_the_prefix_is_that_of_the_certificate(enclave: str, tmp_path: Path) -> None:
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, common_name(enclave))])
    digest = hashlib.sha256(name.public_bytes()).digest()
    assert guid_prefix(common_name(enclave)) == (int.from_bytes(digest[:6], "big") >> 1) | 1 << 47


def failing_enclaves() -> tuple[str, str]:
    """A Fast enclave and a Cyclone one whose plain subjects never authenticate."""
    names = [f"/e{number}" for number in range(20)]
    low = next(name for name in names if half_of(common_name(name)) is Half.LOW)
    high = next(name for name in names if half_of(common_name(name)) is Half.HIGH)
    return low, high


def both(fast: str, cyclone: str, more: str = "") -> str:
    return NODE.format("talker", fast, FAST, "") + NODE.format("listener", cyclone, CYCLONE, more)


def test_the_plan_names_the_pairs_that_would_fail(plan: Plan) -> None:
    low, high = failing_enclaves()
    (warning,) = plan(both(low, high)).warnings
    assert warning.code is Code.HANDSHAKE_FAILS
    assert f"enclave {low} (Fast DDS) and enclave {high} (Cyclone DDS) never authenticate" in warning.text
    assert not plan(both(high, low)).warnings


def test_processes_in_different_domains_never_meet(plan: Plan) -> None:
    low, high = failing_enclaves()
    assert not plan(both(low, high, '<env name="ROS_DOMAIN_ID" value="9"/>')).warnings


def test_one_enclave_on_both_is_left_to_chance_and_told(plan: Plan) -> None:
    (warning,) = plan(both("/a", "/a")).warnings
    assert warning.code is Code.HANDSHAKE_FAILS and "chance decides" in warning.text


def test_new_enclaves_get_subjects_that_work(plan: Plan, tmp_path: Path) -> None:
    low, high = failing_enclaves()
    found = plan(both(low, high))
    launch = provision(found, tmp_path / "ks")
    assert not launch.handshakes
    assert prefix_of(certificate(tmp_path / "ks", low)) > prefix_of(certificate(tmp_path / "ks", high))
    before = {name: certificate(tmp_path / "ks", name).serial_number for name in (low, high)}
    provision(found, tmp_path / "ks")  # what stands is good
    assert before == {name: certificate(tmp_path / "ks", name).serial_number for name in (low, high)}
    assert not [one for one in verify(tmp_path / "ks").findings if one.severity.value == "error"]


def test_certificates_that_exist_keep_their_subject_and_that_is_told(plan: Plan, tmp_path: Path) -> None:
    low, high = failing_enclaves()
    one_dds = NODE.format("talker", low, FAST, "") + NODE.format("listener", high, FAST, "")
    provision(plan(one_dds), tmp_path / "ks")
    (warning,) = provision(plan(both(low, high)), tmp_path / "ks").handshakes
    assert warning.code is Code.HANDSHAKE_FAILS and "never authenticate" in warning.text


def test_pairs_and_halves() -> None:
    members = [
        EnclaveProcess("/f", 0, Vendor.FAST),
        EnclaveProcess("/c", 0, Vendor.CYCLONE),
        EnclaveProcess("/m", 0, Vendor.FAST),
        EnclaveProcess("/m", 0, Vendor.CYCLONE),
        EnclaveProcess("/x", 1, Vendor.CYCLONE),
        EnclaveProcess("/u", 0, None),
    ]
    pairs = mixed_pairs(members)
    assert pairs == (Pair("/f", "/c"), Pair("/f", "/m"), Pair("/m", "/c"), Pair("/m", "/m"))
    assert guid_halves(members) == {"/f": Half.HIGH, "/c": Half.LOW}
    assert list(failing(pairs, {})) == [Pair("/m", "/m")]
