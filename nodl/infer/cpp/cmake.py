"""What a ``CMakeLists.txt`` builds: executables with their sources, registered components.

Only literal calls and ``set(VARIABLE ...)`` lists are understood; nothing is run.
"""

from __future__ import annotations

import itertools
import os
import re
from dataclasses import dataclass, field
from pathlib import Path

_CALL = re.compile(r"^\s*(\w+)\s*\(([^()]*)\)", re.MULTILINE)
_VARIABLE = re.compile(r"\$\{(\w+)\}")
_EXECUTABLES = frozenset({"add_executable", "ament_auto_add_executable", "rclcpp_add_executable"})


@dataclass
class Build:
    executables: dict[str, set[str]] = field(default_factory=dict)  # name -> file names of its sources
    plugins: dict[str, str | None] = field(default_factory=dict)  # class -> executable made for it


def read_build(folder: str | None) -> Build:
    build = Build()
    if folder is None:
        return build
    try:
        text = Path(folder, "CMakeLists.txt").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return build
    variables: dict[str, str] = {}
    for name, arguments in _CALL.findall(re.sub(r"#.*", "", text)):
        expanded = _VARIABLE.sub(lambda match: variables.get(match[1], match[0]), arguments)
        words = [word.strip('"') for word in expanded.split()]
        if name.lower() == "set" and words:
            variables[words[0]] = " ".join(words[1:])
        elif name.lower() == "project" and words:
            variables["PROJECT_NAME"] = words[0]
        elif name.lower() in _EXECUTABLES and words:
            build.executables[words[0]] = {os.path.basename(word) for word in words[1:]}
        elif name.lower() == "rclcpp_components_register_node" and words:
            _register(build, words)
        elif name.lower() == "rclcpp_components_register_nodes":
            build.plugins.update(dict.fromkeys(words[1:]))
    return build


def _register(build: Build, words: list[str]) -> None:
    options = dict(itertools.pairwise(words))
    if "PLUGIN" in options:
        build.plugins[options["PLUGIN"]] = options.get("EXECUTABLE")
