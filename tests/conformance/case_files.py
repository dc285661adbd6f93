"""Conformance cases as text: launch file in, what is launched out.

A file of ``cases/`` looks like this; everything up to the next ``---`` or ``===`` belongs to a section:

    === shared                           files that all cases of this file find beside the launch file
    --- file inc.launch.xml
    <launch>...</launch>

    === E01 `let` is scoped by `group`   id and a sentence
    --- arguments a:=cli                 command-line arguments
    --- environment A=1                  set before the launch starts
    --- xml                              content of <launch>; or ``yaml`` (whole file); or ``py`` (statements
    <executable cmd="echo"/>             that define ``entities``, with all public names imported)
    --- expect                           from real launch in every distribution, or ``expect humble``
    run echo

``outcome.render`` defines the lines of ``expect``. ``--- ours`` replaces them where we differ on purpose,
with the reason on the line itself.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.programs import install_package

CASES = Path(__file__).parent / "cases"
DISTROS = ("humble", "jazzy", "rolling")
RECORDED_IN = "2024-12"  # what was run: launch 1.0.7, 3.4.3 and 3.7.1 with their launch_ros
EVERYWHERE = "everywhere"
SYNTAXES = ("xml", "yaml", "py")


@dataclass
class Case:
    """``expect`` and ``ours``: distribution or ``EVERYWHERE`` -> text."""

    name: str
    group: str
    files: dict[str, str] = field(default_factory=dict)
    syntax: str = ""
    text: str = ""
    arguments: list[str] = field(default_factory=list)
    environment: dict[str, str] = field(default_factory=dict)
    expect: dict[str, str] = field(default_factory=dict)
    ours: dict[str, str] = field(default_factory=dict)

    def expected(self, distro: str) -> str | None:
        """What real launch does; ``None`` where it was not recorded."""
        return self.expect.get(distro, self.expect.get(EVERYWHERE))

    def expected_of_us(self, distro: str) -> str | None:
        return self.ours.get(distro, self.ours.get(EVERYWHERE, self.expected(distro)))


def load_all() -> list[Case]:
    return [case for path in sorted(CASES.glob("*.txt")) for case in load(path)]


def load(path: Path) -> list[Case]:
    cases: list[Case] = []
    shared: dict[str, str] = {}
    for title, sections in _blocks(path.read_text(encoding="utf-8")):
        case = Case(title, path.stem, dict(shared))
        for heading, body in sections:
            _add(case, heading, body)
        if title == "shared":
            shared = case.files
        else:
            cases.append(case)
    return cases


def _add(case: Case, heading: str, body: str) -> None:
    kind, _, rest = heading.partition(" ")
    if kind in SYNTAXES:
        case.syntax, case.text = kind, body
    elif kind == "file":
        case.files[rest] = body
    elif kind == "arguments":
        case.arguments = shlex.split(rest)
    elif kind == "environment":
        case.environment = dict(item.split("=", 1) for item in shlex.split(rest))
    elif kind in ("expect", "ours"):
        for distro in rest.split() or [EVERYWHERE]:
            getattr(case, kind)[distro] = body.strip()
    else:
        raise ValueError(f"{case.group}: {case.name}: unknown section '{heading}'")


def _blocks(text: str) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    for block in ("\n" + text).split("\n=== ")[1:]:
        title, _, rest = block.partition("\n")
        parts = ("\n" + rest).split("\n--- ")
        yield title.strip(), [_split(part) for part in parts[1:]]


def _split(part: str) -> tuple[str, str]:
    heading, _, body = part.partition("\n")
    return heading.strip(), body.rstrip() + "\n" if body.strip() else ""


_PYTHON = """\
import os, pathlib, sys
import launch, launch_ros
from launch import Action, Event, EventHandler, LaunchContext, LaunchDescription, Substitution
from launch.actions import *
from launch.conditions import *
from launch.event_handlers import *
from launch.launch_description_sources import *
from launch.substitutions import *
from launch_ros.actions import *
from launch_ros.descriptions import *
from launch_ros.substitutions import ExecutableInPackage, FindPackagePrefix, FindPackageShare
EP, LC = ExecuteProcess, LaunchConfiguration
"""


def write(case: Case, folder: Path) -> Path:
    """Put the case's files into ``folder``; give the launch file to run."""
    for name, text in case.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    main = folder / f"main.launch.{case.syntax}"
    main.write_text(_whole(case), encoding="utf-8")
    return main


def _whole(case: Case) -> str:
    if case.syntax == "xml":
        return case.text if case.text.startswith("<?xml") else f"<launch>\n{case.text}</launch>\n"
    if case.syntax == "yaml":
        return case.text
    body = "".join(f"    {line}\n" if line.strip() else "\n" for line in case.text.splitlines())
    return f"{_PYTHON}\ndef generate_launch_description():\n{body}    return LaunchDescription(entities)\n"


def install_packages(prefix: Path) -> None:
    """The packages that cases start nodes from: ``pk``, ``rc`` and ``empty`` (without executables)."""
    for package, executables in (("pk", ("e", "one", "two", "late")), ("rc", ("cc",)), ("empty", ())):
        install_package(prefix, package, dict.fromkeys(executables, "#!/bin/sh\n"))
