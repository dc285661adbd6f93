"""ROS's nodl_python has the import name of our ``nodl``; it comes with ros2launch_security and lies on PYTHONPATH."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.install.test_routes import DEMO, ROOT, do

LAUNCH = (f"--prefix={DEMO}", "demo_nodes", "talker_listener_remap.launch.xml")
COMMANDS = {
    "secure-launch": (("--dry-run", *LAUNCH), "publish: /conversation"),
    "secure-plan": (("check", *LAUNCH), "0 errors"),
    "secure-keystore": (("create", "ks"), "governance signed"),
    "secure-nodl": (("infer", str(ROOT / "fixtures" / "programs" / "repeater.py")), "publisher"),
}
LATER = """
import nodl
theirs = nodl.get_node_by_executable
import enclave_launch
from enclave_launch.flow import resolve
assert theirs(package_name="p", executable_name="e") == "theirs"
import nodl
assert nodl.get_node_by_executable is not theirs
"""


def write_foreign_nodl(folder: Path) -> Path:
    """Write a package of nodl_python's names and none of our modules. Return the folder for PYTHONPATH."""
    package = folder / "nodl"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(
        "from nodl import errors\nfrom nodl._index import get_node_by_executable\n", encoding="utf-8"
    )
    (package / "errors.py").write_text("class NoDLError(Exception):\n    pass\n", encoding="utf-8")
    (package / "_index.py").write_text(
        "def get_node_by_executable(*, package_name, executable_name):\n    return 'theirs'\n",
        encoding="utf-8",
    )
    return folder


@pytest.fixture(params=["first", "last"])
def beside_it(request: pytest.FixtureRequest, tmp_path: Path) -> dict[str, str]:
    """The environment of a shell whose PYTHONPATH has nodl_python before or behind us."""
    order = [str(write_foreign_nodl(tmp_path / "theirs")), str(ROOT)]
    return {"PYTHONPATH": os.pathsep.join(order if request.param == "first" else order[::-1])}


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_works_beside_it(command: str, beside_it: dict[str, str], tmp_path: Path) -> None:
    words, expected = COMMANDS[command]
    home = "enclave_addons.entry" if command == "secure-plan" else "enclave_common.entry"
    entry = f"import sys; from {home} import {command.replace('-', '_')} as main; sys.exit(main())"
    assert expected in do("python", "-c", entry, *words, cwd=tmp_path, more=beside_it)


def test_modules_that_imported_it_before_keep_it(tmp_path: Path) -> None:
    """As ros2launch_security does in ``ros2 launch``, whose extensions are loaded before ours."""
    path = f"{write_foreign_nodl(tmp_path / 'theirs')}{os.pathsep}{ROOT}"
    do("python", "-c", LATER, cwd=tmp_path, more={"PYTHONPATH": path})


def test_no_other_package_comes_from_our_folder_because_of_it(
    beside_it: dict[str, str], tmp_path: Path
) -> None:
    path = "import sys; before = list(sys.path); import enclave_launch; assert sys.path == before"
    do("python", "-c", path, cwd=tmp_path, more=beside_it)
