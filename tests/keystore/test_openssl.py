"""What OpenSSL refuses, and with it every DDS: at ``create``, at ``sign --issued``, and where it lies in a keystore."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from enclave_addons.deployment import request
from enclave_addons.deployment.host_keys import Request, requests_text
from keystore import Role, Severity, verify
from keystore.disk import layout
from keystore.formats.certificate import CertificateFacts, given_certificates
from keystore.signing.openssl import refusals
from keystore.verb import main
from tests.keystore.kit import filled, openssl

EC = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
CA = "basicConstraints=critical,CA:TRUE\nkeyUsage=critical,keyCertSign,cRLSign,digitalSignature\n"
LEAF = "basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n"
UNKNOWN = "1.2.3.4=critical,DER:0500\n"


def made(folder: Path, name: str, extensions: str, *signing: str | Path) -> Path:
    """A certificate with these extensions: signed by itself, or as ``signing`` says."""
    key, csr, cert, text = (folder / f"{name}.{end}" for end in ("key", "csr", "pem", "ext"))
    text.write_text(extensions)
    if not key.exists():
        openssl("req", "-new", *EC, "-keyout", key, "-subj", f"/CN={name}", "-out", csr)
    openssl(
        "x509",
        "-req",
        "-in",
        csr,
        *(signing or ("-signkey", key)),
        "-days",
        "900",
        "-extfile",
        text,
        "-out",
        cert,
    )
    return cert


def created(folder: Path, role: Role, cert: Path) -> int:
    option = f"--{role.use}-ca"
    shutil.rmtree(folder / "ks", ignore_errors=True)
    return main(["create", str(folder / "ks"), option, str(cert), str(cert.with_suffix(".key"))])


BOTH = tuple(Role)
AUTHORITIES = {
    "plain": (CA, ()),
    "for mail": (f"{CA}extendedKeyUsage=emailProtection,serverAuth\n", ()),
    "for servers": (f"{CA}extendedKeyUsage=serverAuth\n", (Role.PERMISSIONS,)),
    "for code": (f"{CA}extendedKeyUsage=codeSigning\n", (Role.PERMISSIONS,)),
    "with an unknown critical extension": (f"{CA}{UNKNOWN}", BOTH),
    "with the same, not critical": (f"{CA}1.2.3.4=DER:0500\n", ()),
    "for names of a company": (f"{CA}nameConstraints=critical,permitted;DNS:company.com\n", (Role.IDENTITY,)),
    "for all names but those of a company": (f"{CA}nameConstraints=critical,excluded;DNS:company.com\n", ()),
}


@pytest.mark.parametrize("role", Role)
@pytest.mark.parametrize("kind", AUTHORITIES)
def test_an_authority_that_openssl_refuses_is_refused(
    tmp_path: Path, kind: str, role: Role, capsys: pytest.CaptureFixture[str]
) -> None:
    extensions, refused = AUTHORITIES[kind]
    status = created(tmp_path, role, made(tmp_path, "ca", extensions))
    assert status == (2 if role in refused else 0), capsys.readouterr().err
    if role in refused:
        assert f"cannot be the {role.label}: OpenSSL" in capsys.readouterr().err
        assert not (tmp_path / "ks").exists(), "nothing was written"


@pytest.mark.parametrize("role", Role)
def test_an_intermediate_is_refused_with_or_without_its_root_behind_it(tmp_path: Path, role: Role) -> None:
    root = made(tmp_path, "root", CA)
    inner = made(tmp_path, "inner", CA, "-CA", root, "-CAkey", root.with_suffix(".key"), "-CAcreateserial")
    assert created(tmp_path, role, inner) == 2
    inner.write_bytes(inner.read_bytes() + root.read_bytes())
    assert created(tmp_path, role, inner) == 2
    assert created(tmp_path, role, root) == 0
    if role is Role.IDENTITY:
        assert main(["create", str(tmp_path / "other"), "--external-identity-ca", str(inner)]) == 2


@pytest.mark.parametrize("role", Role)
def test_an_authority_that_openssl_refuses_is_found(tmp_path: Path, role: Role) -> None:
    """The same key and name under another certificate, as a hand may put it there."""
    root = tmp_path / "ks"
    assert created(tmp_path, role, made(tmp_path, "ca", CA)) == 0
    filled(root)
    assert verify(root).findings == ()
    shutil.copy(made(tmp_path, "ca", f"{CA}{UNKNOWN}"), root / layout.ca_cert(role))
    (one,) = [one for one in verify(root).findings if one.code == "ca-refused"]
    assert one.severity is Severity.ERROR and one.place == layout.ca_cert(role)
    assert "unhandled critical extension (error 34)" in one.message and "--ca start" in one.repair


LEAVES = {
    "plain": (LEAF, ""),
    "with an extension that need not be known": (f"{LEAF}1.2.3.4=DER:0500\n", ""),
    "with an unknown critical extension": (f"{LEAF}{UNKNOWN}", "error 34"),
    "with the key identifier of another authority": (
        f"{LEAF}authorityKeyIdentifier=keyid:always\n",
        "error 20",
    ),
    "with a critical TLS feature": (f"{LEAF}tlsfeature=critical,status_request\n", "error 34"),
    "of a proxy": (f"{LEAF}proxyCertInfo=critical,language:id-ppl-anyLanguage\n", "proxy"),
    "of an authority": (CA, "may certify enclaves of its own"),
    "that may sign certificates": (LEAF.replace("digital", "keyCertSign,digital"), "may certify"),
}


class Company:
    """An identity CA elsewhere, and a keystore that trusts it."""

    def __init__(self, folder: Path):
        self.folder, self.root = folder, folder / "ks"
        self.ca, self.other = made(folder, "company", CA), made(folder, "other", CA)
        assert main(["create", str(self.root), "--external-identity-ca", str(self.ca)]) == 0
        (self.asked,) = request(folder / "host", ["/arm"])
        (folder / "requests").write_bytes(requests_text([self.asked]))

    def issue(self, extensions: str) -> Path:
        """Signed by this CA; a key identifier is that of the other one."""
        ca = self.ca
        if "authorityKeyIdentifier" in extensions:  # the same name and key: only the identifier differs
            ca = self.folder / "renamed.pem"
            text = self.folder / "renamed.ext"
            text.write_text(f"{CA}subjectKeyIdentifier=00:11:22:33\n")
            csr, key = self.ca.with_suffix(".csr"), self.ca.with_suffix(".key")
            openssl("x509", "-req", "-in", csr, "-signkey", key, "-days", "900", "-extfile", text, "-out", ca)
        return _issued(self.folder, self.asked, extensions, ca, self.ca.with_suffix(".key"))

    def sign(self, issued: Path) -> int:
        return main(["sign", str(self.root), str(self.folder / "requests"), "--issued", str(issued)])


def _issued(folder: Path, asked: Request, extensions: str, ca: Path, key: Path) -> Path:
    csr, text, cert = folder / "arm.csr", folder / "arm.ext", folder / "arm.pem"
    csr.write_bytes(asked.pem)
    text.write_text(extensions)
    signing = ("-CA", ca, "-CAkey", key, "-CAcreateserial", "-days", "30")
    openssl("x509", "-req", "-in", csr, *signing, "-extfile", text, "-out", cert)
    return cert


@pytest.mark.parametrize("kind", LEAVES)
def test_a_certificate_that_openssl_refuses_is_neither_taken_nor_good(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    extensions, told = LEAVES[kind]
    company = Company(tmp_path)
    issued = company.issue(extensions)
    assert company.sign(issued) == (2 if told else 0)
    if not told:
        assert verify(company.root).is_good
        return
    assert told in capsys.readouterr().err and not (company.root / "enclaves/arm").exists()
    assert company.sign(company.issue(LEAF)) == 0
    put_there = given_certificates(company.issue(extensions).read_bytes(), "issued")[0]
    (company.root / "enclaves/arm/cert.pem").write_bytes(put_there.pem)
    codes = {one.code for one in verify(company.root).findings if one.place == "enclaves/arm/cert.pem"}
    assert codes & {"certificate-refused", "leaf-is-ca", "leaf-can-certify"}, codes


def test_each_of_many_gets_its_own_answer(tmp_path: Path) -> None:
    ca = made(tmp_path, "ca", CA)
    signing = ("-CA", ca, "-CAkey", ca.with_suffix(".key"), "-CAcreateserial")
    good, bad = (
        _facts(made(tmp_path, name, text, *signing)) for name, text in (("a", LEAF), ("b", LEAF + UNKNOWN))
    )
    answers = refusals(_facts(ca), [good, bad, good, _facts(ca), *[good] * 1200, bad], Role.IDENTITY)
    refused = "unhandled critical extension (error 34)"
    assert answers == ["", refused, "", "", *[""] * 1200, refused]


def _facts(cert: Path) -> CertificateFacts:
    return given_certificates(cert.read_bytes(), "x")[0]


def test_without_openssl_nothing_is_called_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root, ca = filled(tmp_path / "ks"), made(tmp_path, "ca", CA)
    assert subprocess.run(["openssl", "version"], capture_output=True).returncode == 0
    monkeypatch.setenv("PATH", str(tmp_path))
    (one,) = verify(root).findings
    assert one.code == "openssl-missing" and one.severity is Severity.WARNING and "apt install" in one.repair
    assert (
        main(["create", str(tmp_path / "other"), "--identity-ca", str(ca), str(ca.with_suffix(".key"))]) == 1
    )
