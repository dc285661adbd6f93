"""The public names of a package: listed once, in its stub, and imported when first used."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from enclave_launch.boundary.light import Any


def public_names(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of ``package``, whose ``__init__`` is ``file`` with a stub beside it.

    The stub has a line ``from MODULE import NAME as NAME`` for each name, which type checkers read as well.
    """

    def homes() -> dict[str, str]:
        import re

        with open(os.path.splitext(file)[0] + ".pyi", encoding="utf-8") as stub_file:
            stub = stub_file.read()
        found = re.findall(r"^from (\S+) import (\w+) as \w+$", stub, re.MULTILINE)
        return {name: module for module, name in found}

    def get(name: str) -> Any:
        known = homes() if name == "__all__" or not name.startswith("__") else {}
        if name == "__all__":
            return sorted(known)
        if name not in known:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        from importlib import import_module

        value = getattr(import_module(known[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*homes(), *vars(sys.modules[package]).keys() & {"__version__"}})

    return get, names
