"""Nav2's bring-up as an install prefix: launch files and helpers of a checkout, stand-ins for its programs."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from bench.synthetic_stack import install_package

_STARTED = re.compile(r"package='(\w+)',\s*(?:executable|plugin)='([\w:]+)'")


def install_bringup(checkout: Path, prefix: Path) -> Path:
    """Put ``nav2_bringup`` and ``nav2_common`` of ``checkout`` below ``prefix``; returns ``bringup_launch.py``.

    Its Python is below ``prefix / "python"``.
    """
    share = install_package(prefix, "nav2_bringup")
    for folder in ("launch", "params", "maps"):
        shutil.copytree(checkout / "nav2_bringup" / folder, share / folder, dirs_exist_ok=True)
    shutil.copytree(
        checkout / "nav2_common" / "nav2_common", prefix / "python" / "nav2_common", dirs_exist_ok=True
    )
    for file in (share / "launch").glob("*.py"):
        for name, program in _STARTED.findall(file.read_text(encoding="utf-8")):
            install_package(prefix, name, program.replace("::", "_"))
    install_package(prefix, "rclcpp_components", "component_container", "component_container_isolated")
    return share / "launch" / "bringup_launch.py"
