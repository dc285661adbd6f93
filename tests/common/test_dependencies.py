"""What a person reads where a package is missing: one line, and how to get it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

COMMANDS = {
    "lxml": ["keystore.verb", "apply-policy", "{keystore}", "{yaml}"],
    "cryptography": ["keystore.verb", "create", "{new}"],
    "yaml": ["enclave_launch", "--dry-run", "{yaml}"],
    "pydantic": ["keystore.verb", "governance", "{keystore}", "{yaml}"],
}


@pytest.mark.parametrize("package", COMMANDS)
def test_a_missing_package_is_one_line(package: str, tmp_path: Path) -> None:
    from tests.keystore.kit import filled

    filled(tmp_path / "ks", ["/a"])
    (tmp_path / "blocked" / package).mkdir(parents=True)
    (tmp_path / "blocked" / package / "__init__.py").write_text(
        f"raise ModuleNotFoundError('No module named {package}', name='{package}')"
    )
    (tmp_path / "a.yaml").write_text("version: 1\ndomain_rules: [{}]\n")
    places = {"keystore": tmp_path / "ks", "new": tmp_path / "new", "yaml": tmp_path / "a.yaml"}
    words = [word.format(**places) for word in COMMANDS[package]]
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path / 'blocked'}{os.pathsep}{ROOT}"}
    run = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    assert f"the Python package {package} is not installed: apt install python3-{package}" in run.stderr
    assert run.stderr.count("\n") == 1, run.stderr
    assert not (tmp_path / "new" / "public").exists()
