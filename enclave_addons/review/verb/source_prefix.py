"""Install prefixes made from the sources of a colcon workspace, so that a revision can be planned without a build.

Places what the install rules of ``CMakeLists.txt`` or ``setup.py`` name: launch files, parameters, manifests, scripts.
Compiled programs are placeholders; inference reads their sources. ``setup.py`` is run, as colcon does, with a ``setup``
that only records its arguments; CMake is read, not run. What a build generates is not there.
"""

from __future__ import annotations

import configparser
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from enclave_addons.inference.cpp.reading.cmake import Build, BuildReader, absolute
from enclave_addons.inference.cpp.reading.project import find_packages
from enclave_launch.errors import UsageError
from nodl.ament_index import INDEX_FOLDER
from nodl.package_xml import read_package_xml

_KEYWORDS = frozenset({
    "DESTINATION", "RENAME", "RUNTIME", "LIBRARY", "ARCHIVE", "OBJECTS", "FRAMEWORK", "BUNDLE", "INCLUDES", "EXPORT",
    "PATTERN", "REGEX", "FILES_MATCHING", "PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "OPTIONAL",
    "USE_SOURCE_PERMISSIONS", "COMPONENT", "CONFIGURATIONS", "EXCLUDE_FROM_ALL", "MESSAGE_NEVER", "TYPE",
})  # fmt: skip
_FOLDERS = {"CMAKE_INSTALL_LIBDIR": "lib", "CMAKE_INSTALL_BINDIR": "bin", "CMAKE_INSTALL_DATADIR": "share"}
_COMPILED = b"\x7fELF stands for a compiled program, whose sources are read\n"
_ENTRY_POINT = """#!/usr/bin/env python3
load_entry_point({package!r}, 'console_scripts', {executable!r})
"""
_SECONDS = 60
# Runs in an interpreter of its own. Arguments: the file for the answer.
_RECORD_SETUP = """
import json, runpy, sys, types
given = {}
module = types.ModuleType("setuptools")
module.setup = lambda **keywords: given.update(keywords)
module.find_packages = module.find_namespace_packages = lambda *words, **options: []
sys.modules["setuptools"] = module
sys.argv[0], answer = "setup.py", sys.argv.pop()
runpy.run_path("setup.py", run_name="__main__")
wanted = {name: given.get(name) for name in ("data_files", "entry_points", "package_dir", "scripts")}
with open(answer, "w") as file:
    json.dump(wanted, file)
"""


def source_packages(sources: Path) -> dict[str, Path]:
    """Return the folder of each package below ``sources`` by its name; as colcon, without what is to be ignored."""
    return {name: Path(package.folder) for name, package in find_packages([str(sources)]).items()}


def install_sources(sources: Path, target: Path) -> dict[str, Path]:
    """Make an install prefix for each package below ``sources``; raises UsageError if a ``setup.py`` fails."""
    prefixes = {}
    for name, folder in sorted(source_packages(sources.resolve()).items()):
        prefix = target / name
        (prefix / INDEX_FOLDER / "packages").mkdir(parents=True)
        (prefix / INDEX_FOLDER / "packages" / name).touch()
        _place(folder / "package.xml", prefix / "share" / name / "package.xml")
        if (folder / "CMakeLists.txt").is_file() and not _is_python(folder):
            _InstallRules(name, prefix).read(str(folder), dict(_FOLDERS))
        elif (folder / "setup.py").is_file():
            _install_python(name, folder, prefix)
        prefixes[name] = prefix
    return prefixes


def _is_python(folder: Path) -> bool:
    """Return True if colcon builds the package with ``setup.py``, whatever else lies beside it (REP 149)."""
    return "ament_python" in read_package_xml(folder).build_types


class _InstallRules(BuildReader):
    """Follows the install rules of one package. Both branches of an undecided condition count."""

    def __init__(self, package: str, prefix: Path) -> None:
        super().__init__(Build())
        self._package = package
        self._prefix = prefix

    def _do_install(self, given: list[str], variables: dict[str, str]) -> None:
        kind = given[0]
        end = next((i for i, word in enumerate(given) if word in _KEYWORDS), len(given))
        named, options = given[1:end], given[end:]
        if kind == "TARGETS":
            self._programs(named, _after("RUNTIME", options))
            return
        destination = _option("DESTINATION", options)
        if destination is None:
            return
        folder = self._prefix / destination.lstrip("/")
        for word in named:
            source = Path(absolute(word, variables))
            if kind == "DIRECTORY" and source.is_dir():
                _place_folder(source, folder if word.endswith("/") else folder / source.name)
            elif kind in ("FILES", "PROGRAMS") and source.is_file():
                place = folder / (_option("RENAME", options) or source.name)
                _place(source, place, executable=kind == "PROGRAMS")

    def _do_ament_auto_package(self, given: list[str], variables: dict[str, str]) -> None:
        if "INSTALL_TO_SHARE" in given:
            for word in given[given.index("INSTALL_TO_SHARE") + 1 :]:
                folder = Path(absolute(word, variables))
                if folder.is_dir():
                    _place_folder(folder, self._prefix / "share" / self._package / folder.name)
        self._programs([target.name for target in self.build.targets.values() if target.automatic], [])

    def _do_nodl_export_node_description_file(self, given: list[str], variables: dict[str, str]) -> None:
        source = Path(absolute(given[0], variables))
        _place(source, self._prefix / "share" / self._package / source.name)

    def _do_ament_python_install_package(self, given: list[str], variables: dict[str, str]) -> None:
        folder = Path(absolute(given[0], variables))
        if folder.is_dir():
            _place_folder(folder, _site(self._prefix) / folder.name)

    def _do_rclcpp_components_register_node(self, given: list[str], variables: dict[str, str]) -> None:
        super()._do_rclcpp_components_register_node(given, variables)
        for executable in filter(None, self.build.plugins.values()):
            _write_program(self._prefix / "lib" / self._package / executable, _COMPILED)

    def _programs(self, targets: Iterable[str], options: Sequence[str]) -> None:
        destination = _option("DESTINATION", options) or f"lib/{self._package}"
        for name in targets:
            target = self.build.targets.get(name)
            if target is not None and target.executable:
                file = self._prefix / destination.lstrip("/") / self.build.renamed.get(name, name)
                _write_program(file, _COMPILED)


def _option(name: str, options: Sequence[str]) -> str | None:
    return options[options.index(name) + 1] if name in options[:-1] else None


def _after(word: str, options: Sequence[str]) -> Sequence[str]:
    return options[options.index(word) :] if word in options else options


def _install_python(name: str, folder: Path, prefix: Path) -> None:
    given = _setup_arguments(folder)
    for destination, files in given["data_files"]:
        for file in files:
            _place(folder / file, prefix / destination / Path(file).name)
    site = _site(prefix)
    site.mkdir(parents=True, exist_ok=True)
    top = folder / (given["package_dir"] or {}).get("", "")
    (site / f"{name}.pth").write_text(f"{top}\n")
    scripts = given["console_scripts"]
    info = site / f"{name}.egg-info"
    info.mkdir()
    (info / "entry_points.txt").write_text("\n".join(["[console_scripts]", *scripts]) + "\n")
    for script in scripts:
        executable = script.partition("=")[0].strip()
        text = _ENTRY_POINT.format(package=name, executable=executable)
        _write_program(prefix / "lib" / name / executable, text.encode())
    for script in given["scripts"] or ():
        _place(folder / script, prefix / "lib" / name / Path(script).name, executable=True)


def _setup_arguments(folder: Path) -> dict[str, Any]:
    last = ""
    given: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="secure-plan-") as scratch:
        answer = Path(scratch, "setup.json")
        command = [sys.executable, "-B", "-c", _RECORD_SETUP, str(answer)]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, timeout=_SECONDS, check=False
            )
            last = done.stderr.strip().rpartition("\n")[2]
            given = json.loads(answer.read_text()) if answer.exists() else {}
        except subprocess.TimeoutExpired:
            last = f"it took longer than {_SECONDS} s"
    if not given:
        raise UsageError(
            f"{folder / 'setup.py'} cannot be read: {last}; build the revision instead: --build 'colcon build'"
        )
    entries = given["entry_points"]
    given["console_scripts"] = entries.get("console_scripts", []) if isinstance(entries, Mapping) else []
    given["data_files"] = given["data_files"] or []
    _add_setup_cfg(folder / "setup.cfg", given)
    return given


def _add_setup_cfg(file: Path, given: dict[str, Any]) -> None:
    parser = configparser.ConfigParser(delimiters=("=",), interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # names keep their case
    parser.read(file)
    listed = parser.get("options.entry_points", "console_scripts", fallback="")
    given["console_scripts"] = [*given["console_scripts"], *filter(None, map(str.strip, listed.splitlines()))]
    if parser.has_section("options.data_files"):
        for destination, files in parser.items("options.data_files"):
            given["data_files"].append((destination, files.split()))


def _site(prefix: Path) -> Path:
    return prefix / "lib" / f"python3.{sys.version_info.minor}" / "site-packages"


def _place_folder(source: Path, target: Path) -> None:
    for folder, _, names in os.walk(source):
        for name in names:
            file = Path(folder, name)
            _place(file, target / file.relative_to(source))


def _place(source: Path, target: Path, *, executable: bool = False) -> None:
    """Link a file, or copy it if it must become executable; the first rule that places a file wins."""
    if not source.is_file() or target.exists():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    if executable:
        shutil.copyfile(source, target)
        target.chmod(0o755)
    else:
        target.symlink_to(source.resolve())


def _write_program(target: Path, content: bytes) -> None:
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
        target.chmod(0o755)
