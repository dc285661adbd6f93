"""Installed units are held against what an import brings; who does not fit is named, with what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.deployment import BundleOptions, ImportOptions, export_hosts, import_bundle, pinned
from keystore.verb import main
from tests.keystore.kit import filled

HEAD = "# Written by secure-plan export from robot.launch.xml; generate it again, changes here are lost\n"
CREDENTIALS = "LoadCredential=key.pem:{ks}/enclaves{enclave}/key.pem\n"
CRL = "LoadCredential=crl.pem:{ks}/public/crl.pem\nSetCredential=crl.pem:none\n"


@pytest.fixture
def host(tmp_path: Path) -> Path:
    """An imported keystore with /a, a bundle that has /b as well, and a folder for units."""
    ca = filled(tmp_path / "ca", ["/a", "/b"])
    for name, enclaves in (("one", ["/a"]), ("two", ["/a", "/b"])):
        made = export_hosts(ca, tmp_path / name, {"host": enclaves}, options=BundleOptions(durable=False))
        if name == "one":
            pins = ImportOptions("host", pinned(made[0].manifest))
            import_bundle(tmp_path / "ks", made[0].path, options=pins)
    (tmp_path / "units").mkdir()
    return tmp_path


def told(host: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What the import of the next bundle says of units."""
    capsys.readouterr()
    bundle = str(host / "two/host.bundle")
    assert main(["import", str(host / "ks"), bundle, "--units", str(host / "units")]) == 0
    return capsys.readouterr().err


def write_unit(host: Path, name: str, enclave: str, more: str = CRL, keystore: str = "ks") -> None:
    text = f"[Unit]\nX-Node={enclave}\nPartOf=robot.target\n[Service]\n"
    places = {"ks": host / keystore, "enclave": enclave}
    (host / "units" / name).write_text(HEAD + text + CREDENTIALS.format(**places) + more.format(**places))


def test_units_that_fit_are_not_spoken_of(host: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_unit(host, "robot-a.service", "/a")
    write_unit(host, "robot-b.service", "/b")
    assert ".service" not in told(host, capsys)


def test_a_unit_that_loads_no_crl_is_named(host: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_unit(host, "robot-a.service", "/a", more="")
    write_unit(host, "robot-b.service", "/b")
    said = told(host, capsys)
    assert "robot-a.service does not load crl.pem, so that no revocation reaches it: export it again" in said
    assert "robot-b.service" not in said


def test_units_and_enclaves_without_each_other_are_named(
    host: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_unit(host, "robot-c.service", "/c")
    write_unit(host, "robot-a.service", "/a")
    said = told(host, capsys)
    assert "robot-c.service runs enclave /c, which this bundle does not have" in said
    assert "no unit of this host runs enclave /b" in said and "enclave /a" not in said


def test_units_of_others_and_of_other_keystores_are_not_looked_at(
    host: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_unit(host, "robot-c.service", "/c", keystore="elsewhere")
    (host / "units/ssh.service").write_text("[Unit]\nDescription=ROS 2: /c\n")
    assert ".service" not in told(host, capsys)


def test_a_folder_that_is_not_one_hosts_export_is_not_installed(
    host: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (host / "mine").mkdir()
    assert main(["units", "install", str(host / "mine"), "--units", str(host / "units")]) == 2
    assert "is not the folder of one host" in capsys.readouterr().err
    assert main(["units", "remove", "robot", "--units", str(host / "units")]) == 2
    assert list((host / "units").iterdir()) == []
