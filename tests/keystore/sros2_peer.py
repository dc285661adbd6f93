"""SROS2's own code as the counterpart, where it is: run in an interpreter of its own.

    SROS2_PYTHON      an interpreter with lxml and cryptography < 46 (newer ones break sros2 0.13)
    SROS2_PYTHONPATH  the folder that holds its ``sros2`` package (ros2/sros2, folder ``sros2``)

sros2 needs rclpy and the ament index for small things only; stand-ins take their place (rmw's namespace rules).
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

_STAND_INS = {
    "ament_index_python/__init__.py": (
        "import os\n"
        "def get_package_share_directory(name):\n"
        "    return os.environ['SROS2_SHARE']\n"  # its schemas refer to an XML catalogue there
    ),
    "rclpy/__init__.py": "",
    "rclpy/exceptions.py": "class InvalidNamespaceException(Exception):\n    pass\n",
    "rclpy/utilities.py": "def get_rmw_implementation_identifier():\n    return 'rmw_fastrtps_cpp'\n",
    "rclpy/validate_namespace.py": (
        "import re\n"
        "from rclpy.exceptions import InvalidNamespaceException\n"
        "def validate_namespace(name):\n"
        "    if not re.match(r'/$|(/[A-Za-z_][A-Za-z0-9_]*)+\\Z', name) or len(name) > 245:\n"
        "        raise InvalidNamespaceException(name)\n"
        "    return True\n"
    ),
}


def available() -> bool:
    return bool(os.environ.get("SROS2_PYTHON")) and bool(os.environ.get("SROS2_PYTHONPATH"))


def run(program: str, *arguments: str | Path, scratch: Path) -> str:
    """Output of ``program`` with ``sros2`` importable; ``scratch`` takes the stand-in for rclpy."""
    stand_ins = scratch / "stand_ins"
    for name, text in _STAND_INS.items():
        (stand_ins / name).parent.mkdir(parents=True, exist_ok=True)
        (stand_ins / name).write_text(text)
    path = os.pathsep.join([str(stand_ins), os.environ["SROS2_PYTHONPATH"]])
    share = os.environ["SROS2_PYTHONPATH"].split(os.pathsep)[0]
    done = subprocess.run(
        [os.environ["SROS2_PYTHON"], "-W", "ignore", "-c", program, *map(str, arguments)],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": path, "SROS2_SHARE": share},
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    return done.stdout
