"""Programs that tests write, in a repository whose path may have a blank in it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

PYTHON = shlex.quote(sys.executable)


def python_program(text: str, python: str | Path = sys.executable) -> str:
    """Return an executable file that runs ``text``: a ``#!`` line cannot name an interpreter with a blank in its path.

    The shell reads the first two lines and becomes Python, for which they are a text."""
    return f"#!/bin/sh\n'''exec' {shlex.quote(str(python))} \"$0\" \"$@\"\n' '''\n{text}"
