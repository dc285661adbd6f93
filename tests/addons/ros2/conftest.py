"""Real launch for these tests: its sources importable, and installed as far as plug-ins need that."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.addons.ros2 import upstream


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    missing = upstream.missing()
    if not missing:
        return
    skip = pytest.mark.skip(reason=f"real launch is not on PYTHONPATH: no {', '.join(missing)}")
    for item in items:
        if item.get_closest_marker("real_launch") is not None and Path(__file__).parent in item.path.parents:
            item.add_marker(skip)


class Workspace:
    """An install prefix with launch files, and a Python path on which real launch finds its plug-ins."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.site = directory / "site"
        self.prefix = directory / "prefix"
        upstream.install(self.site, self.prefix)

    def add(self, name: str, text: str) -> Path:
        path = self.directory / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def environment(self, *prefixes: Path) -> dict[str, str]:
        path = [
            self.site,
            Path(__file__).parent,
            upstream.ROOT,
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

    def ros2_launch(self, *arguments: str, prefixes: tuple[Path, ...] = (), stdin: str = "") -> Any:
        return self._run([str(Path(__file__).with_name("ros2_launch.py")), *arguments], prefixes, stdin)

    def _run(self, words: list[str], prefixes: tuple[Path, ...], stdin: str = "") -> Any:
        return subprocess.run(
            [sys.executable, *words],
            env=self.environment(*prefixes),
            input=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=60,
            check=False,
        )


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path)
