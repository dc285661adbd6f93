"""A CA whose keys live in a token: SoftHSM2 stands for it, openssl judges what it signs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec

from enclave_addons.deployment import (
    ImportOptions,
    RequestOptions,
    export_hosts,
    import_bundle,
    pinned,
    request,
    sign_requests,
)
from keystore import (
    CaAccess,
    ImportedCa,
    InvalidInputError,
    RemoveOptions,
    RenewOptions,
    Role,
    Secret,
    SigningUnavailableError,
    Validity,
    provision,
    remove,
    renew,
    verify,
)
from keystore.formats.validity import utc_now
from keystore.signing import authority
from keystore.signing.private_key import signature
from keystore.signing.token_key import open_key, parse_uri
from tests.keystore.kit import DAY, created, filled, openssl, options, policy

MODULES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib/x86_64-linux-gnu/softhsm/libsofthsm2.so")
PIN = "1234"


def module() -> str | None:
    return next((path for path in MODULES if os.path.exists(path)), None)


@pytest.fixture(scope="session")  # a process logs in once: xdist may run this module's tests in two stretches
def token(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, str]:
    """A token with an EC key for each CA; returns the environment in which it is found."""
    pkcs11 = pytest.importorskip("pkcs11") if os.environ.get("CI") != "true" else __import__("pkcs11")
    found = module()
    if found is None:
        assert os.environ.get("CI") != "true", "apt install softhsm2"
        pytest.skip("SoftHSM2 is not installed (apt install softhsm2)")
    home = tmp_path_factory.mktemp("softhsm")
    (home / "tokens").mkdir()
    (home / "softhsm2.conf").write_text(
        f"directories.tokendir = {home / 'tokens'}\nobjectstore.backend = file\n"
    )
    os.environ["SOFTHSM2_CONF"] = str(home / "softhsm2.conf")
    subprocess.run(
        ["softhsm2-util", "--init-token", "--free", "--label", "robots", "--pin", PIN, "--so-pin", "12345678"],
        check=True, capture_output=True,
    )  # fmt: skip
    with pkcs11.lib(found).get_token(token_label="robots").open(user_pin=PIN, rw=True) as session:
        from pkcs11.util.ec import encode_named_curve_parameters

        curve = encode_named_curve_parameters("secp256r1")
        wanted = {pkcs11.Attribute.EC_PARAMS: curve}
        parameters = session.create_domain_parameters(pkcs11.KeyType.EC, wanted, local=True)
        for role in Role:
            parameters.generate_keypair(mechanism_param=None, store=True, label=role.value)
    (home / "pin").write_text(PIN + "\n")
    return {"PKCS11_MODULE_PATH": found, "pin": str(home / "pin")}


def access(token: Mapping[str, str]) -> CaAccess:
    return CaAccess(pin=Secret(file=Path(token["pin"])), environment=token)


def uri(role: Role) -> str:
    return f"pkcs11:token=robots;object={role.value};type=private"


@pytest.fixture
def root(token: Mapping[str, str], tmp_path: Path) -> Path:
    imported = {}
    for role in Role:
        key = open_key(uri(role).encode(), "the token", access(token))
        made = authority.self_signed_ca(
            role, f"token {role.value}", key, Validity.starting(utc_now(), 90 * DAY)
        )
        (tmp_path / f"{role.value}.pem").write_bytes(made.facts.pem)
        (tmp_path / f"{role.value}.uri").write_text(uri(role) + "\n")
        imported[role] = ImportedCa(tmp_path / f"{role.value}.pem", tmp_path / f"{role.value}.uri")
    return created(tmp_path / "ks", imported=imported, access=access(token))


def test_everything_is_signed_by_the_token(root: Path, token: Mapping[str, str]) -> None:
    provision(root, [policy("/a")], options=options(access=access(token)))
    assert verify(root, access=access(token)).findings == ()
    directory = root / "enclaves/a"
    openssl("verify", "-x509_strict", "-CAfile", directory / "identity_ca.cert.pem", directory / "cert.pem")
    openssl(
        "smime", "-verify", "-text", "-CAfile", directory / "permissions_ca.cert.pem", "-in",
        directory / "permissions.p7s",
    )  # fmt: skip


def test_the_keystore_holds_uris_not_keys(root: Path) -> None:
    assert {path.name: path.read_text() for path in (root / "private").glob("*.key.*")} == {
        f"{role.value}.key.p11": uri(role) + "\n" for role in Role
    }


def test_a_crl_by_the_token(root: Path, token: Mapping[str, str]) -> None:
    provision(root, [policy("/a"), policy("/b")], options=options(access=access(token)))
    remove(root, ["/b"], options=RemoveOptions(access=access(token), durable=False))
    ca = root / "public/identity_ca.cert.pem"
    openssl(
        "verify",
        "-crl_check",
        "-CAfile",
        ca,
        "-CRLfile",
        root / "public/crl.pem",
        root / "enclaves/a/cert.pem",
    )


def test_without_pin_or_module_the_message_says_so(
    root: Path, token: Mapping[str, str], tmp_path: Path
) -> None:
    """The wrong PIN in a process of its own: in ours the token is logged in already."""
    (tmp_path / "wrong").write_text("9999")
    done = subprocess.run(
        [sys.executable, "-m", "keystore.verb", "create-enclave", root, "/a", "--pin-file", tmp_path / "wrong"],
        env={**os.environ, **token}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1 and "refused: PinIncorrect" in done.stderr
    assert "9999" not in done.stderr and "Traceback" not in done.stderr
    cases = {
        "PKCS11_MODULE_PATH": CaAccess(pin=Secret(file=Path(token["pin"])), environment={}),
        "PKCS#11": CaAccess(
            pin=Secret(file=Path(token["pin"])), environment={"PKCS11_MODULE_PATH": "/nonexistent.so"}
        ),
    }
    for message, wrong in cases.items():
        with pytest.raises(SigningUnavailableError, match=message) as caught:
            provision(root, [policy("/a")], options=options(access=wrong))
        assert PIN not in str(caught.value)


def test_what_is_no_certificate_is_signed_by_the_token_too(token: Mapping[str, str]) -> None:
    """As the evidence of a product is."""
    key = open_key(uri(Role.IDENTITY).encode(), "the token", access(token))
    public = key.public_key()
    assert isinstance(public, ec.EllipticCurvePublicKey)
    public.verify(signature(key, b"what was decided"), b"what was decided", ec.ECDSA(hashes.SHA256()))


def test_an_unchanged_launch_needs_no_token(root: Path, token: Mapping[str, str]) -> None:
    provision(root, [policy("/a")], options=options(access=access(token)))
    assert not provision(root, [policy("/a")], options=options()).changed


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pkcs11:object=a?pin-value=1234", "stores the PIN"),
        ("pkcs11:token=a", "object= or id="),
        ("pkcs11:object=a;object=b", "different"),
        ("pkcs11:object", "name=value"),
    ],
)
def test_bad_uris_are_refused_unseen(text: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message) as caught:
        parse_uri(text)
    assert "1234" not in str(caught.value)


def test_uris_are_decoded() -> None:
    assert parse_uri("pkcs11:token=My%20robots;id=%01%02?module-path=/a/b.so") == {
        "token": "My robots", "id": "\x01\x02", "module-path": "/a/b.so",
    }  # fmt: skip


def test_an_enclaves_key_in_a_token_is_asked_for_and_used_by_its_uri(
    token: Mapping[str, str], tmp_path: Path
) -> None:
    """As REP 2015 has it: rcl takes ``key.p11``, which Fast DDS reads; the key in a file of before is gone."""
    ca = filled(tmp_path / "ca", ["/arm"])
    asking = RequestOptions(token=uri(Role.IDENTITY), access=access(token))
    asked = request(tmp_path / "ks", ["/arm"], options=asking)
    for _ in range(2):  # the second time renewed, for the same key
        sign_requests(ca, asked, options=options())
        bundle = export_hosts(ca, tmp_path / "out", {"arm": ["/arm"]})[0]
        import_bundle(tmp_path / "ks", bundle.path, options=ImportOptions("arm", pinned(bundle.manifest)))
        assert (tmp_path / "ks/enclaves/arm/key.p11").read_text() == uri(Role.IDENTITY) + "\n"
        assert not (tmp_path / "ks/enclaves/arm/key.pem").exists()
        assert verify(tmp_path / "ks").is_good
        renew(ca, ["/arm"], options=RenewOptions(provisioning=options()))
    with pytest.raises(InvalidInputError, match="one key in a token is for one enclave"):
        request(tmp_path / "ks", ["/arm", "/leg"], options=asking)
