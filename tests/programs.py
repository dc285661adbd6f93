"""Programs and packages that tests write, in a repository whose path may have a blank in it."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping
from pathlib import Path

PYTHON = shlex.quote(sys.executable)
COMPILED = b"\x7fELF\x02\x01\x01"
"""The first bytes of a compiled program (ELF)."""


def python_program(text: str, python: str | Path = sys.executable) -> str:
    """Return an executable file that runs ``text``: a ``#!`` line cannot name an interpreter with a blank in its path.

    The shell reads the first two lines and becomes Python, for which they are a text."""
    return f"#!/bin/sh\n'''exec' {shlex.quote(str(python))} \"$0\" \"$@\"\n' '''\n{text}"


def install_package(
    prefix: Path, package: str, programs: Mapping[str, str | bytes] | None = None, version: str = "1.0.0"
) -> Path:
    """Install a package below an ament prefix, as colcon does: marker, package.xml, and executables by their names.

    Without ``programs`` the folder of executables is left empty for the caller; with an empty mapping there is none.
    Returns its share folder."""
    marker = prefix / "share/ament_index/resource_index/packages" / package
    share, binaries = prefix / "share" / package, prefix / "lib" / package
    for folder in (marker.parent, share, *([binaries] if programs is None or programs else ())):
        folder.mkdir(parents=True, exist_ok=True)
    marker.touch()
    text = f'<package format="3"><name>{package}</name><version>{version}</version></package>'
    (share / "package.xml").write_text(text)
    for name, content in (programs or {}).items():
        (binaries / name).write_bytes(content.encode() if isinstance(content, str) else content)
        (binaries / name).chmod(0o755)
    return share
