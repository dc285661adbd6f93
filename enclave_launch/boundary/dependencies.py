"""A Python package that is not installed, in one line that says how to get it."""

from __future__ import annotations

from importlib import import_module

_APT_AND_PIP = {
    "cryptography": ("python3-cryptography", "cryptography"),
    "lxml": ("python3-lxml", "lxml"),
    "pydantic": ("python3-pydantic", "pydantic"),
    "yaml": ("python3-yaml", "PyYAML"),
}


def require(*packages: str) -> None:
    """Import them, before anything is written that would stay incomplete. Raises ``ImportError``."""
    for package in packages:
        import_module(package)


def missing_dependency(error: ImportError) -> str | None:
    """What to do about ``error``; ``None`` where it is about something else than a package that we need."""
    name = (error.name or "").partition(".")[0]
    if name not in _APT_AND_PIP:
        return None
    apt, pip = _APT_AND_PIP[name]
    return f"the Python package {name} is not installed: apt install {apt}, or pip install {pip}"
