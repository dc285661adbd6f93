"""requirements/ locks what pyproject.toml asks for, by hash; the bill of materials describes what runs."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
LOCKS = sorted((ROOT / "requirements").glob("*.txt"))
OF_DEVELOPMENT = ("dds", "cpp", "pkcs11", "test", "lint")


def locked(path: Path) -> dict[str, str]:
    """Name -> all that is written for it."""
    entries = re.split(r"^(?=[A-Za-z0-9])", path.read_text(), flags=re.MULTILINE)
    return {re.split(r"[=\[ ]", entry)[0].lower(): entry for entry in entries if "==" in entry}


def asked_for(section: str) -> set[str]:
    """Names of the packages in a list of pyproject.toml."""
    text = (ROOT / "pyproject.toml").read_text()
    listed = re.search(rf"^{section} = \[(.*?)\]\n", text, re.MULTILINE | re.DOTALL)
    assert listed, section
    return {re.split(r"[\[<>=;]", name)[0].lower() for name in re.findall(r'"([^"]+)"', listed[1])}


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.stem)
def test_everything_locked_has_a_hash(path: Path) -> None:
    entries = locked(path)
    assert entries and all("--hash=sha256:" in entry for entry in entries.values())


def test_development_has_all_that_is_asked_for() -> None:
    names = asked_for("dependencies").union(*(asked_for(extra) for extra in OF_DEVELOPMENT))
    assert names <= set(locked(ROOT / "requirements/development.txt")), "run tools/lock"


def test_setup_py_asks_for_the_same() -> None:
    text = (ROOT / "setup.py").read_text()
    listed = set(
        re.findall(r'"([a-z0-9]+)>=', text[text.index("REQUIRES") : text.index("]", text.index("REQUIRES"))])
    )
    assert listed == asked_for("dependencies") == {"lxml", "pyyaml", "cryptography", "asn1crypto", "pydantic"}


def test_the_bill_of_materials_names_what_runs() -> None:
    pytest.importorskip("cyclonedx_py", reason="part of the extra lint")
    command = [
        sys.executable,
        "-W",
        "ignore",
        "-m",
        "cyclonedx_py",
        "requirements",
        "--output-format",
        "JSON",
    ]
    run = subprocess.run(
        [*command, "--output-reproducible", str(ROOT / "requirements/runtime.txt")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    document = json.loads(run.stdout)
    assert document["bomFormat"] == "CycloneDX"
    assert asked_for("dependencies") <= {component["name"] for component in document["components"]}
