"""Look at what this machine has of ROS: its distribution, and the middleware with its security plugins."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path

from enclave_launch.admission.middleware import Vendor, vendor_of
from nodl.ament_index import package_version

_SYSTEM_LIBRARIES = ("/usr/lib/*-linux-gnu", "/usr/local/lib", "/usr/lib", "/usr/lib64")
_PLUGINS: Mapping[Vendor, tuple[tuple[str, ...], bytes]] = {
    Vendor.CYCLONE: (("libdds_security_auth.so*",), b""),
    # Built in, if at all: the library then has the names of its plugins.
    Vendor.FAST: (("libfastdds.so*", "libfastrtps.so*"), b"DDS:Auth:PKI-DH"),
    Vendor.CONNEXT: (("libnddssecurity.so*",), b""),
}


@dataclass(frozen=True)
class Middleware:
    """An ``RMW_IMPLEMENTATION`` on this machine.

    Attributes:
        version: Its package's version, empty if it is not installed.
        security: Path of the library with the security plugins, None if no such library was found.
    """

    name: str
    version: str
    security: str | None


def sourced_distribution(environment: Mapping[str, str]) -> str:
    """Return the distribution of the sourced installation, empty if none is sourced."""
    return environment.get("ROS_DISTRO", "") if environment.get("AMENT_PREFIX_PATH") else ""


def installed_distributions() -> list[str]:
    """Return the setup files of the distributions below ``/opt/ros``."""
    return sorted(glob("/opt/ros/*/setup.bash"))


def look_at_middleware(name: str, prefixes: Sequence[str]) -> Middleware:
    """Return what the machine has of the middleware ``name``."""
    version = next((found for found in (package_version(name, [prefix]) for prefix in prefixes) if found), "")
    vendor = vendor_of(name)
    patterns, mark = _PLUGINS[vendor] if vendor is not None else ((), b"")
    loaded = next((path for pattern in patterns for path in _libraries(pattern, prefixes)), None)
    return Middleware(name, version, loaded if loaded is not None and _holds(loaded, mark) else None)


def _libraries(pattern: str, prefixes: Sequence[str]) -> Iterator[str]:
    folders = [*(os.path.join(prefix, "lib") for prefix in prefixes), *_SYSTEM_LIBRARIES]
    folders += [os.path.join(folder, "*-linux-gnu") for folder in folders[: len(prefixes)]]
    folders += os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    yield from (path for folder in folders if folder for path in glob(os.path.join(folder, pattern)))


def _holds(path: str, mark: bytes) -> bool:
    try:
        return not mark or mark in Path(path).read_bytes()
    except OSError:
        return False
