"""Real launch from its public sources, installed as far as its own plug-in look-up needs that."""

from __future__ import annotations

import importlib.util
import runpy
from collections.abc import Mapping
from pathlib import Path
from unittest import mock

ROOT = Path(__file__).parents[3]
NEEDED = ("launch", "launch_ros", "launch_xml", "launch_yaml", "ros2launch", "osrf_pycommon", "lark")

# What upstream's own setup.py files declare.
UPSTREAM = {
    "launch.frontend.launch_extension": ["launch_ros = launch_ros"],
    "launch.frontend.parser": ["xml = launch_xml:Parser", "yaml = launch_yaml:Parser"],
}


def missing() -> list[str]:
    """What of it cannot be imported here."""
    return [name for name in NEEDED if importlib.util.find_spec(name) is None]


def install(site: Path, prefix: Path) -> None:
    """Metadata into ``site``, a folder for PYTHONPATH; launch's grammar, found by ament index, into ``prefix``."""
    spec = importlib.util.find_spec("launch")
    assert spec is not None and spec.origin is not None
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / "launch").touch()
    (prefix / "share/launch").symlink_to(Path(spec.origin).parents[1] / "share/launch")
    install_metadata(site, "upstream_launch", UPSTREAM)
    install_metadata(site, "enclave_launch_here", our_entry_points())


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
