"""An identity CA of somebody else: openssl stands for Vault, step-ca and cert-manager, which sign requests, too."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from enclave_addons.deployment import (
    BundleOptions,
    ImportOptions,
    accept_certificates,
    export_hosts,
    import_bundle,
    pinned,
    request,
)
from enclave_addons.deployment.host_keys import Request, parse_requests, requests_text
from keystore import InvalidInputError, Role, Severity, SigningUnavailableError, provision, verify
from keystore.disk.view import KeystoreView
from keystore.verb import main
from tests.keystore.kit import actions, openssl, options, policy

NAMES = ("/arm", "/arm/hand")


class ExternalCa:
    """What the operator of the other CA does."""

    def __init__(self, folder: Path, name: str = "Company identity CA"):
        folder.mkdir()
        self.folder, self.cert, self.key = folder, folder / "ca.pem", folder / "ca.key"
        curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
        more = ("-addext", "keyUsage=critical,keyCertSign,cRLSign", "-days", "3650")
        openssl("req", "-x509", *curve, "-keyout", self.key, "-out", self.cert, "-subj", f"/CN={name}", *more)

    def issue(self, requests: tuple[Request, ...], *more: str, days: int = 30) -> bytes:
        """A PEM bundle, as such CAs hand out."""
        extensions = self.folder / "extensions"
        extensions.write_text(
            "basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n"
            "extendedKeyUsage=serverAuth,clientAuth\n"
        )
        issued = b""
        for one in requests:
            csr, cert = self.folder / "csr", self.folder / "cert"
            csr.write_bytes(one.pem)
            signing = ("-CA", self.cert, "-CAkey", self.key, "-CAcreateserial", "-days", str(days))
            openssl("x509", "-req", "-in", csr, *signing, "-extfile", extensions, "-out", cert, *more)
            issued += cert.read_bytes()
        return issued


@pytest.fixture
def external(tmp_path: Path) -> ExternalCa:
    return ExternalCa(tmp_path / "company")


@pytest.fixture
def ks(tmp_path: Path, external: ExternalCa) -> Path:
    """Governance and permissions are signed here, identities are not."""
    assert main(["create", str(tmp_path / "ks"), "--external-identity-ca", str(external.cert)]) == 0
    return tmp_path / "ks"


def carried(ks: Path, tmp_path: Path, number: int = 0) -> None:
    made = export_hosts(ks, tmp_path / f"out{number}", {"arm": ["*"]}, options=BundleOptions(durable=False))[
        0
    ]
    pins = () if number else pinned(made.manifest)
    import_bundle(tmp_path / "host", made.path, options=ImportOptions("arm", pins))


def test_from_the_request_to_a_host_that_is_ready(ks: Path, external: ExternalCa, tmp_path: Path) -> None:
    asked = request(tmp_path / "host", NAMES)
    assert accept_certificates(ks, asked, external.issue(asked)) == NAMES
    provision(ks, [policy(name) for name in NAMES], options=options())
    assert [one for one in verify(ks).findings if one.severity is not Severity.NOTE] == []
    carried(ks, tmp_path)
    assert verify(tmp_path / "host").is_good
    assert not list(ks.rglob("key.pem")), "and no private key was ever here"


def test_a_renewed_certificate_keeps_the_permissions_and_takes_its_own_dates(
    ks: Path, external: ExternalCa, tmp_path: Path
) -> None:
    asked = request(tmp_path / "host", NAMES)
    accept_certificates(ks, asked, external.issue(asked))
    wanted = [policy(name) for name in NAMES]
    provision(ks, wanted, options=options())
    carried(ks, tmp_path)
    accept_certificates(ks, asked, external.issue(asked, days=60))
    assert actions(provision(ks, wanted, options=options())) == {}, "nothing is missing"
    carried(ks, tmp_path, 1)
    again = request(tmp_path / "host", ["/arm"])
    assert again[0].key != asked[0].key
    accept_certificates(ks, again, external.issue(again))
    carried(ks, tmp_path, 2)
    assert verify(tmp_path / "host").is_good


def test_without_permissions_a_new_enclave_may_do_nothing(
    ks: Path, external: ExternalCa, tmp_path: Path
) -> None:
    asked = request(tmp_path / "host", ["/arm"])
    accept_certificates(ks, asked, external.issue(asked))
    document = (ks / "enclaves/arm/permissions.xml").read_text()
    assert set(re.findall("<topic>(.*)</topic>", document)) == {"ros_discovery_info"}, (
        "what every participant has"
    )


def test_a_launch_says_which_enclaves_want_a_certificate(ks: Path) -> None:
    with pytest.raises(SigningUnavailableError, match="/arm: new enclave\nRequest them on their hosts"):
        provision(ks, [policy("/arm")], options=options())


def test_what_is_advised_for_a_certificate_of_another_ca_works(
    ks: Path,
    external: ExternalCa,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = request(tmp_path / "host", ["/arm"])
    (tmp_path / "csr").write_bytes(asked[0].pem)
    bare = ("-CA", external.cert, "-CAkey", external.key, "-CAcreateserial", "-days", "90")
    openssl("x509", "-req", "-in", tmp_path / "csr", *bare, "-out", tmp_path / "bare.pem")
    accept_certificates(ks, asked, (tmp_path / "bare.pem").read_bytes())
    found = {one.code: one.repair for one in verify(ks).findings}
    assert set(found) == {"no-key-usage", "no-extended-key-usage", "no-ca-key"}
    assert main(["renew", str(ks)]) == 0, "which cannot replace the certificate, and has nothing else to do"

    on_the_host, here = found["no-key-usage"].split("  # on its host. ")
    host = str(tmp_path / "host2")
    assert main(shlex.split(on_the_host.replace("HOST_KEYSTORE", shlex.quote(host)))[1:]) == 0
    requests = Path("requests.pem")
    Path("issued.pem").write_bytes(external.issue(parse_requests(requests.read_bytes(), "requests"), days=90))
    assert main(shlex.split(here.rpartition("Then here: ")[2])[1:]) == 0
    assert {one.code for one in verify(ks).findings} == {"no-ca-key"}

    capsys.readouterr()
    assert main(["renew", str(ks), "/arm"]) == 1
    assert "--issued issued.pem" in capsys.readouterr().err, "and never the advice to find CA keys"


def test_a_host_without_ca_keys_is_never_advised_to_renew(
    ks: Path, external: ExternalCa, tmp_path: Path
) -> None:
    asked = request(tmp_path / "host", NAMES)
    accept_certificates(ks, asked, external.issue(asked))
    carried(ks, tmp_path)
    host = (tmp_path / "host").resolve()
    (host / "enclaves/arm/permissions.xml").write_text("garbled")
    faults = [one for one in verify(tmp_path / "host").findings if one.severity is Severity.ERROR]
    assert faults and all(
        one.repair.startswith(f"secure-keystore import {tmp_path / 'host'} HOST.bundle") for one in faults
    )


def refused(ks: Path, asked: tuple[Request, ...], issued: bytes, told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        accept_certificates(ks, asked, issued)
    assert not (ks / "enclaves/arm").exists()


def test_what_does_not_fit_the_request_is_refused(ks: Path, external: ExternalCa, tmp_path: Path) -> None:
    asked = request(tmp_path / "host", ["/arm"])
    refused(ks, asked, external.issue(request(tmp_path / "other", ["/arm"])), "none is for the requested key")
    refused(ks, asked, ExternalCa(tmp_path / "another").issue(asked), "not signed by the identity CA")
    same_name = ExternalCa(tmp_path / "impostor")
    refused(ks, asked, same_name.issue(asked), "not signed by the identity CA")
    refused(
        ks, asked, external.issue(asked, "-subj", "/O=Company/CN=ros.arm"), "another subject than CN=ros.arm"
    )
    refused(ks, asked, external.issue(asked, "-subj", "/CN=ros.base"), "another subject")


def test_the_commands(
    ks: Path, external: ExternalCa, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, issued = tmp_path / "requests.pem", tmp_path / "issued.pem"
    assert main(["request", str(tmp_path / "host"), "/arm", "-o", str(file)]) == 0
    issued.write_bytes(external.issue(parse_requests(file.read_bytes(), "requests")))
    assert main(["sign", str(ks), str(file), "--issued", str(issued)]) == 0
    assert "/arm: certificate taken, key SHA-256 " in capsys.readouterr().out
    assert main(["create-enclave", str(ks), "/arm"]) == 0, "it exists"
    assert requests_text(parse_requests(file.read_bytes(), "requests")) == file.read_bytes()


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--identity-ca", "CERT", "KEY"], "leave out one"),
        (["--identity-ca-name", "Foo"], "leave out --identity-ca-name"),
    ],
)
def test_no_option_of_an_external_ca_is_dropped(
    external: ExternalCa, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], told: str
) -> None:
    root, files = tmp_path / "new", {"CERT": str(external.cert), "KEY": str(external.key)}
    create = ["create", str(root), "--external-identity-ca", str(external.cert)]
    assert main([*create, *(files.get(word, word) for word in more)]) == 2
    assert told in capsys.readouterr().err and not root.exists()
    assert main([*create, "--permissions-ca-name", "Foo"]) == 0, "that one is made here"
    assert KeystoreView(root).ca(Role.PERMISSIONS).common_name == "Foo"
