"""keystore and nodl are packages of their own: built from these sources without the others, installed, used."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.install.test_routes import DEMO, ROOT, do

MANIFEST = DEMO / "share" / "demo_nodes" / "demo_nodes.nodl.xml"
# package -> command, what it does in the test, what it needs from PyPI
ALONE = {
    "keystore": (
        "secure-keystore",
        ("create", "ks"),
        ("lxml", "pyyaml", "cryptography", "asn1crypto", "pydantic"),
    ),
    "nodl": ("secure-nodl", ("validate", str(MANIFEST)), ("pyyaml",)),
}


def project(package: str, folder: Path) -> Path:
    """Write a source tree with ``package``, what all packages share, and the project file cut to both."""
    for each in ("enclave_common", package):
        shutil.copytree(ROOT / each, folder / each, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("README.md", "LICENSE"):
        shutil.copy2(ROOT / name, folder / name)
    command, _, needed = ALONE[package]
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    text = text.replace('name = "enclave-launch"', f'name = "{package}-alone"')
    text = re.sub(r"^dependencies = \[.*?^\]", f"dependencies = {list(needed)}", text, flags=re.M | re.S)
    text = re.sub(rf"^secure-(?!{command.removeprefix('secure-')} ).*\n", "", text, flags=re.M)
    text = re.sub(r"^\[project\.entry-points.*\n(?:[\w-]+ = .*\n)+", "", text, flags=re.M)
    text = re.sub(r"^dynamic = .*\n", "", text, flags=re.M)  # what setup.py adds is for colcon
    text = re.sub(r"^include = .*", f'include = ["enclave_common*", "{package}*"]', text, flags=re.M)
    (folder / "pyproject.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("package", ALONE)
def test_a_package_is_built_and_used_without_the_others(package: str, tmp_path: Path) -> None:
    source, command = project(package, tmp_path / "source"), ALONE[package][0]
    do("python3", "-m", "venv", str(tmp_path / "venv"), cwd=tmp_path)
    bin_folder = tmp_path / "venv" / "bin"
    do(str(bin_folder / "pip"), "install", "-q", str(source), cwd=tmp_path)
    assert [each.name for each in bin_folder.glob("secure-*")] == [command]
    absent = {"enclave_addons", "enclave_launch", "keystore", "nodl"} - {package}
    for other in absent:
        do(str(bin_folder / "python"), "-c", f"import {other}", cwd=tmp_path, status=1)
    helped = do(str(bin_folder / command), "--help", cwd=tmp_path)
    assert "usage:" in helped and "not part of this installation" not in helped
    do(str(bin_folder / command), *ALONE[package][1], cwd=tmp_path)
