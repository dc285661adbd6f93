"""What colcon reads: package.xml, setup.py and the resource marker agree with pyproject.toml."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

ROOT = Path(__file__).parents[3]


def setup_py() -> dict[str, Any]:
    with mock.patch("setuptools.setup"):
        return runpy.run_path(str(ROOT / "setup.py"))


def pyproject(key: str) -> str:
    found = re.search(rf'(?m)^{key} = "(.*)"$', (ROOT / "pyproject.toml").read_text())
    assert found is not None
    return found[1]


def test_one_version_everywhere() -> None:
    package = ElementTree.parse(ROOT / "package.xml").getroot()
    assert package.findtext("version") == pyproject("version") == setup_py()["VERSION"]


def test_package_xml_is_an_ament_python_package_of_our_name() -> None:
    package = ElementTree.parse(ROOT / "package.xml").getroot()
    assert package.findtext("name") == setup_py()["NAME"] == "enclave_launch"
    assert package.findtext("export/build_type") == "ament_python"


def test_the_index_gets_the_marker_and_the_manifest() -> None:
    files = dict(setup_py()["DATA_FILES"])
    assert files == {
        "share/ament_index/resource_index/packages": ["resource/enclave_launch"],
        "share/enclave_launch": ["package.xml"],
        "share/man/man1": [
            f"docs/man/secure-{command}.1" for command in ("launch", "plan", "keystore", "nodl")
        ],
    }
    assert all((ROOT / file).is_file() for group in files.values() for file in group)


def test_requirements_are_those_of_pyproject() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    listed = re.search(r"(?ms)^dependencies = \[(.*?)\]", text)
    assert listed is not None
    assert re.findall(r'"(.*?)"', listed[1]) == setup_py()["REQUIRES"]


def test_entry_points_are_those_of_pyproject() -> None:
    text = (ROOT / "pyproject.toml").read_text()
    for group, entries in setup_py()["ENTRY_POINTS"].items():
        title = "project.scripts" if group == "console_scripts" else f'project.entry-points."{group}"'
        section = re.search(rf"(?ms)^\[{re.escape(title)}\]\n(.*?)(?=^\[|\Z)", text)
        assert section is not None, f"pyproject.toml has no [{title}]"
        declared = re.findall(r'(?m)^([\w-]+) = "(.*)"$', section[1])
        assert [f"{name} = {value}" for name, value in declared] == entries


AS_COLCON = """
import ast, json, sys
import setuptools
from distutils.core import run_setup

distribution = run_setup("setup.py", script_args=("--dry-run",), stop_after="config")
read = ("packages", "entry_points", "data_files", "python_requires", "install_requires")
print(json.dumps({key: ast.literal_eval(repr(getattr(distribution, key))) for key in read}))
assert isinstance(distribution.metadata.python_requires, str)
"""


def as_colcon_reads(folder: Path) -> Any:
    """colcon takes the attributes of the distribution as Python literals."""
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", AS_COLCON],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


def test_colcon_reads_the_same_with_pyproject_toml_and_without(tmp_path: Path) -> None:
    """``colcon build --symlink-install`` works in a folder of links to all that setup.py names."""
    for name in (
        "setup.py",
        "package.xml",
        "resource",
        "enclave_addons",
        "enclave_common",
        "enclave_launch",
        "nodl",
        "keystore",
        "README.md",
        "LICENSE",
    ):
        (tmp_path / name).symlink_to(ROOT / name)
    without = as_colcon_reads(tmp_path)
    (tmp_path / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")
    beside = as_colcon_reads(tmp_path)
    for read in (without, beside):
        read["install_requires"].sort()
        # Folders of data are packages to one of the two.
        read["packages"] = sorted(name for name in read["packages"] if python_package(name))
    assert without == beside
    assert {"enclave_launch.runtime", "enclave_addons.inference", "keystore.verb"} <= set(beside["packages"])


def python_package(name: str) -> bool:
    return (ROOT / name.replace(".", "/") / "__init__.py").is_file()
