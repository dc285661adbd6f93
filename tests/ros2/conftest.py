"""Real launch for these tests: its sources importable, and installed as far as plug-ins need that."""

from __future__ import annotations

import importlib.util
import os
import runpy
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

ROOT = Path(__file__).parents[2]
NEEDED = ("launch", "launch_ros", "launch_xml", "launch_yaml", "ros2launch", "osrf_pycommon", "lark")

# What upstream's own setup.py files declare.
UPSTREAM = {
    "launch.frontend.launch_extension": ["launch_ros = launch_ros"],
    "launch.frontend.parser": ["xml = launch_xml:Parser", "yaml = launch_yaml:Parser"],
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if not missing:
        return
    skip = pytest.mark.skip(reason=f"real launch is not on PYTHONPATH: no {', '.join(missing)}")
    for item in items:
        if item.get_closest_marker("real_launch") is not None and Path(__file__).parent in item.path.parents:
            item.add_marker(skip)


def our_entry_points() -> Mapping[str, list[str]]:
    """As setup.py gives them to colcon."""
    with mock.patch("setuptools.setup"):
        found: dict[str, list[str]] = runpy.run_path(str(ROOT / "setup.py"))["ENTRY_POINTS"]
    return {group: entries for group, entries in found.items() if group != "console_scripts"}


def install_metadata(site: Path, name: str, entry_points: Mapping[str, list[str]]) -> None:
    """What importlib.metadata reads of an installed distribution."""
    folder = site / f"{name}-1.0.dist-info"
    folder.mkdir(parents=True)
    (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    text = "".join(f"[{group}]\n" + "\n".join(entries) + "\n\n" for group, entries in entry_points.items())
    (folder / "entry_points.txt").write_text(text)


class Workspace:
    """An install prefix with launch files, and a Python path on which real launch finds its plug-ins."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.site = directory / "site"
        self.prefix = directory / "prefix"
        index = self.prefix / "share/ament_index/resource_index/packages"
        index.mkdir(parents=True)
        spec = importlib.util.find_spec("launch")
        assert spec is not None and spec.origin is not None
        (index / "launch").touch()  # launch reads its own grammar through the index
        (self.prefix / "share/launch").symlink_to(Path(spec.origin).parents[1] / "share/launch")
        install_metadata(self.site, "upstream_launch", UPSTREAM)
        install_metadata(self.site, "enclave_launch_here", our_entry_points())

    def add(self, name: str, text: str) -> Path:
        path = self.directory / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def environment(self, *prefixes: Path) -> dict[str, str]:
        path = [
            self.site,
            Path(__file__).parent,
            ROOT,
            *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep)),
        ]
        return {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(map(str, path)),
            "AMENT_PREFIX_PATH": os.pathsep.join(map(str, (*prefixes, self.prefix))),
            "ROS_LOG_DIR": str(self.directory / "log"),
            "PYTHONDONTWRITEBYTECODE": "1",
        }

    def python(self, script: str, *arguments: str, prefixes: tuple[Path, ...] = ()) -> Any:
        return self._run(["-c", script, *arguments], prefixes)

    def ros2_launch(self, *arguments: str, prefixes: tuple[Path, ...] = ()) -> Any:
        return self._run([str(Path(__file__).with_name("ros2_launch.py")), *arguments], prefixes)

    def _run(self, words: list[str], prefixes: tuple[Path, ...]) -> Any:
        return subprocess.run(
            [sys.executable, *words],
            env=self.environment(*prefixes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=60,
            check=False,
        )


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)


Visited = Callable[[Workspace, str, str], list[dict[str, Any]]]
