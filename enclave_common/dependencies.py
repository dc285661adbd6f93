"""Report what is not installed and how to get it: a Python package, or an add-on (ARCHITECTURE.md)."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec

_OURS = ("enclave_addons", "enclave_launch", "nodl", "keystore")
_OF_A_NODE = ("rclpy", "rcl_interfaces.srv", "service_msgs.msg", "unique_identifier_msgs.msg")
_APT_AND_PIP = {
    "asn1crypto": ("python3-asn1crypto", "asn1crypto"),
    "cryptography": ("python3-cryptography", "cryptography"),
    "lxml": ("python3-lxml", "lxml"),
    "yaml": ("python3-yaml", "PyYAML"),
    "pydantic": ("python3-pydantic", "pydantic"),
}


def require(*packages: str) -> None:
    """Import them, before anything is written that would stay incomplete. Raises ``ImportError``."""
    for package in packages:
        import_module(package)


def missing_dependency(error: ImportError) -> str | None:
    """Return what to do about ``error``, or None if it is about another package than those we need."""
    module = error.name or ""
    name = module.partition(".")[0]
    if name in _OURS and isinstance(error, ModuleNotFoundError):
        return absence(module)
    if name not in _APT_AND_PIP:
        return None
    apt, pip = _APT_AND_PIP[name]
    return f"the Python package {name} is not installed: apt install {apt}, or pip install {pip}"


def ros_import_failure() -> str:
    """Return why this Python cannot make a node of rclpy, and what to do; empty if it can.

    rclpy is imported without numpy, and its first node fails: messages with arrays of fixed length need it.
    """
    for module in _OF_A_NODE:
        if find_spec(module.partition(".")[0]) is None:
            continue
        try:
            import_module(module)
        except ImportError as error:
            return (
                f"{sys.executable} cannot import {module}: {error}; use the Python that ROS was built for with its "
                "packages: pipx install --system-site-packages, or python3 -m venv --system-site-packages"
            )
    return ""


def absence(room: str) -> str:
    """Return what to do about ``room``, an add-on, if it is not part of this installation; empty if it is."""
    return (
        ""
        if installed(room)
        else f"{room} is not part of this installation; install the whole of enclave-launch"
    )


def installed(module: str) -> bool:
    """Return True if the add-on ``module`` is part of this installation."""
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:  # a package above it is not
        return False
