"""Keys that are made where they are used: asked for on the host, signed where the CA is, imported."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from enclave_addons.deployment import (
    BundleOptions,
    HostBundle,
    ImportOptions,
    ImportReport,
    export,
    export_hosts,
    import_bundle,
    pinned,
    request,
    sign_requests,
)
from enclave_addons.deployment.host_keys import parse_requests, requests_text
from keystore import (
    DamagedKeystoreError,
    InvalidInputError,
    RemoveOptions,
    RenewOptions,
    UnsafeKeystoreError,
    provision,
    remove,
    renew,
    verify,
)
from keystore.disk import layout
from keystore.verb import main
from tests.addons.deployment.kit import files_of_bundle
from tests.keystore.kit import actions, certificate_of, filled, mode, openssl, options, policy

NAMES = ("/arm", "/arm/hand")
SIGNING = options()


@pytest.fixture
def ca(tmp_path: Path) -> Path:
    return filled(tmp_path / "ca", [*NAMES, "/base"])


def bundle_of(ca: Path, place: Path) -> HostBundle:
    return export_hosts(ca, place, {"arm": ["/arm*"]}, options=BundleOptions(durable=False))[0]


def carried(host: Path, ca: Path, place: Path) -> ImportReport:
    bundle = bundle_of(ca, place)
    pins = pinned(bundle.manifest) if not os.path.lexists(host) else ()
    return import_bundle(host, bundle.path, options=ImportOptions("arm", pins))


def made_here(host: Path, ca: Path, place: Path) -> ImportReport:
    """The whole way once: ask, sign, export, import."""
    asked = parse_requests(requests_text(request(host, NAMES)), "requests")
    sign_requests(ca, asked, options=SIGNING)
    return carried(host, ca, place)


def private_keys(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("key.pem")}


def test_the_private_key_never_leaves_its_host(ca: Path, tmp_path: Path) -> None:
    host = tmp_path / "ks"
    made_here(host, ca, tmp_path / "out")
    keys = private_keys(host.resolve())
    assert set(keys) == {"enclaves/arm/key.pem", "enclaves/arm/hand/key.pem"}
    assert private_keys(ca).keys() == {"enclaves/base/key.pem"}, "the CA has none of them any more"
    travelled = files_of_bundle((tmp_path / "out/arm.bundle").read_bytes())
    assert not [name for name in travelled if name.endswith("key.pem")]
    assert not set(keys.values()) & set(travelled.values())


def test_what_is_imported_is_a_good_keystore(ca: Path, tmp_path: Path) -> None:
    host = tmp_path / "ks"
    made_here(host, ca, tmp_path / "out")
    assert verify(host).is_good
    assert verify(ca).is_good
    assert mode(host / "enclaves/arm/key.pem") == 0o600
    assert list((tmp_path / "ks.d/pending").iterdir()) == [], "the keys wait no more"


def test_waiting_keys_are_private_and_asked_for_again_unchanged(tmp_path: Path) -> None:
    first = request(tmp_path / "ks", NAMES)
    assert request(tmp_path / "ks", NAMES) == first
    assert mode(tmp_path / "ks.d/pending") == 0o700
    assert mode(tmp_path / "ks.d/pending/e.arm/key.pem") == 0o600
    (tmp_path / "one.csr").write_bytes(requests_text(first[:1]))
    assert "CN = ros.arm" in openssl("req", "-in", tmp_path / "one.csr", "-noout", "-subject", "-verify")


def test_renewal_keeps_the_key_on_its_host(ca: Path, tmp_path: Path) -> None:
    host = tmp_path / "ks"
    made_here(host, ca, tmp_path / "out")
    before = private_keys(host.resolve())
    renew(ca, NAMES, options=RenewOptions(provisioning=options()))
    carried(host, ca, tmp_path / "renewed")
    assert private_keys(host.resolve()) == before
    assert verify(host).is_good


def test_a_launch_on_the_ca_leaves_such_enclaves_as_they_are(ca: Path, tmp_path: Path) -> None:
    made_here(tmp_path / "ks", ca, tmp_path / "out")
    assert actions(provision(ca, [policy(name) for name in NAMES], options=options())) == {}
    more = provision(ca, [policy("/arm", "/chatter", "/more")], options=options())
    assert actions(more) == {"/arm": ("permissions",)}
    carried(tmp_path / "ks", ca, tmp_path / "more")
    with pytest.raises(InvalidInputError, match="a new one is made there"):
        renew(ca, ["/arm"], options=RenewOptions(new_keys=True, provisioning=options()))


def test_a_new_key_replaces_the_one_of_before_when_it_comes_back_signed(ca: Path, tmp_path: Path) -> None:
    host = tmp_path / "ks"
    made_here(host, ca, tmp_path / "out")
    before = private_keys(host.resolve())
    asked = request(host, ["/arm"])
    assert private_keys(host.resolve()) == before, "in use until then"
    sign_requests(ca, asked, revoke_old=True, options=options())
    carried(host, ca, tmp_path / "again")
    after = private_keys(host.resolve())
    assert after["enclaves/arm/key.pem"] != before["enclaves/arm/key.pem"]
    assert after["enclaves/arm/hand/key.pem"] == before["enclaves/arm/hand/key.pem"]
    assert verify(host).is_good


def test_a_bundle_for_a_key_that_is_elsewhere_is_refused(ca: Path, tmp_path: Path) -> None:
    sign_requests(ca, request(tmp_path / "elsewhere", NAMES), options=SIGNING)
    request(tmp_path / "ks", NAMES)
    with pytest.raises(UnsafeKeystoreError, match="for a key that is not on this host; make a new request"):
        carried(tmp_path / "ks", ca, tmp_path / "out")
    assert not os.path.lexists(tmp_path / "ks")


def test_such_a_key_is_in_no_plain_bundle(ca: Path, tmp_path: Path) -> None:
    made_here(tmp_path / "ks", ca, tmp_path / "out")
    with pytest.raises(InvalidInputError, match="was made on its host and is only there"):
        export(ca, tmp_path / "plain", ["/arm"])
    export(ca, tmp_path / "plain", ["/base"])


def test_removing_the_enclave_forgets_the_request(ca: Path, tmp_path: Path) -> None:
    made_here(tmp_path / "ks", ca, tmp_path / "out")
    remove(ca, ["/arm/hand"], options=RemoveOptions(durable=False))
    assert not (ca / layout.request("/arm/hand")).exists()
    assert (ca / layout.request("/arm")).exists()
    assert verify(ca).is_good


# What the CA refuses


def test_a_request_must_be_signed_by_its_own_key(tmp_path: Path) -> None:
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    made = requests_text(request(tmp_path / "ks", ["/arm"]))
    # The key of another pair in the place of the one that signed.
    point = ec.generate_private_key(ec.SECP256R1()).public_key()
    raw = (serialization.Encoding.X962, serialization.PublicFormat.UncompressedPoint)
    (tmp_path / "own.csr").write_bytes(made.partition(b"\n")[2])
    der = tmp_path / "own.der"
    openssl("req", "-in", tmp_path / "own.csr", "-outform", "DER", "-out", der)
    data = der.read_bytes()
    at = data.index(b"\x03\x42\x00\x04") + 3
    der.write_bytes(data[:at] + point.public_bytes(*raw) + data[at + 65 :])
    forged = openssl("req", "-inform", "DER", "-in", der).encode()
    with pytest.raises(DamagedKeystoreError, match="not signed by the key that it is for"):
        parse_requests(b"enclave: /arm\n" + forged, "requests")


def test_a_request_for_what_does_not_exist_or_is_anothers_is_refused(ca: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="no enclave /leg in"):
        sign_requests(ca, request(tmp_path / "ks", ["/leg"]), options=SIGNING)
    asked = request(tmp_path / "ks", NAMES)
    with pytest.raises(InvalidInputError, match="another enclave's subject"):
        sign_requests(ca, [asked[0]._replace(enclave="/base")], options=SIGNING)
    sign_requests(ca, asked, options=SIGNING)
    csr = tmp_path / "stolen.csr"
    key = tmp_path / "ks.d/pending/e.arm/key.pem"
    openssl("req", "-new", "-key", key, "-subj", "/CN=ros.base", "-out", csr)
    stolen = parse_requests(b"enclave: /base\n" + csr.read_bytes(), "requests")
    with pytest.raises(InvalidInputError, match=r"the key in the request of /base is that of /arm"):
        sign_requests(ca, stolen, options=SIGNING)
    assert private_keys(ca).keys() == {"enclaves/base/key.pem"}


@pytest.mark.parametrize("kind", ["ed25519", "ec:secp256k1", "ec:P-384", "ec:P-224"])
def test_a_key_that_dds_cannot_use_is_refused(tmp_path: Path, kind: str) -> None:
    name, _, curve = kind.partition(":")
    more = ["-pkeyopt", f"ec_paramgen_curve:{curve}"] if curve else []
    key, csr = tmp_path / "key", tmp_path / "csr"
    openssl("genpkey", "-algorithm", name, *more, "-out", key)
    openssl("req", "-new", "-key", key, "-subj", "/CN=ros.arm", "-out", csr)
    with pytest.raises(DamagedKeystoreError, match="DDS-Security takes P-256 and RSA-2048"):
        parse_requests(b"enclave: /arm\n" + csr.read_bytes(), "requests")


def test_openssls_own_request_does_as_well(ca: Path, tmp_path: Path) -> None:
    """The way in for keys that other tools make: RSA of a TPM, for example."""
    key, csr = tmp_path / "key.pem", tmp_path / "csr"
    openssl("genpkey", "-algorithm", "RSA", "-pkeyopt", "rsa_keygen_bits:2048", "-out", key)
    openssl("req", "-new", "-key", key, "-subj", "/CN=ros.base", "-out", csr)
    sign_requests(ca, parse_requests(b"enclave: /base\n" + csr.read_bytes(), "requests"), options=SIGNING)
    assert certificate_of(ca, "/base").common_name == "ros.base"
    assert verify(ca).is_good
    assert actions(provision(ca, [policy("/base")], options=options())) == {}


def test_the_commands(ca: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    host, file = str(tmp_path / "ks"), str(tmp_path / "requests.pem")
    assert main(["request", host, "/arm", "-o", file]) == 0
    told = capsys.readouterr().err.strip()
    assert main(["sign", str(ca), file]) == 0
    assert told in capsys.readouterr().out, "both sides show the same fingerprint"
    assert main(["sign", str(ca), file]) == 0, "and repeating does nothing more"
    assert main(["sign", str(ca), str(tmp_path / "nothing")]) == 2
