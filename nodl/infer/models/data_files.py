"""YAML and JSON that a program reads where it starts, in a launch: files of installed packages, and texts.

What lies below the install prefixes is what the launch's own parameter files are: read for the plan and taken to be
the same at the start. All other files are unknown, as every file is without a launch.
"""

from __future__ import annotations

import json
import os.path
from collections.abc import Callable
from typing import Any

import yaml

from enclave_common.files import read_text
from enclave_common.yaml_reader import RefusedYaml, load_yaml
from nodl.ament_index import INDEX_FOLDER, PackageNotFoundError, package_share_directory
from nodl.infer.interpreter.run import Call, Run
from nodl.infer.start import NO_LAUNCH
from nodl.infer.text import MAX_LENGTH, constant_text
from nodl.infer.values import (
    ANY,
    BOOLEAN,
    CONSTANTS,
    NONE,
    Dictionary,
    Instance,
    Items,
    Key,
    Value,
    result_of,
    sole,
    unknown,
)

FILE = "io.TextIOWrapper"
CONTENTS = "the contents of a file, read when the program runs"
MAX_BYTES = 200_000
MAX_VALUES = 2_000


def share_directory(run: Run, call: Call) -> Value:
    """Model ``get_package_share_directory``: the folder of a package that is installed."""
    run.asks_launch = True
    package = sole(call.args.at(0, "package_name"))
    if run.launch is NO_LAUNCH or not isinstance(package, str):
        return result_of("ament_index_python")
    for prefix in run.program.prefixes:
        run.program.ask("folder", os.path.join(prefix, INDEX_FOLDER, "packages"))
    try:
        return (package_share_directory(package, run.program.prefixes),)
    except (PackageNotFoundError, ValueError):
        return result_of("ament_index_python")


def exists(run: Run, call: Call) -> Value:
    """Model ``os.path.exists`` and ``isfile``; whether a file is not there is left open."""
    path = _installed(run, call.args.at(0))
    return BOOLEAN if path is None else (True,)


def opened(run: Run, call: Call) -> Value:
    """Model ``open``: a file, whose path is kept if it is an installed one that is only read."""
    run.understood.add(call.node)
    mode = call.args.at(1, "mode")
    path = _installed(run, call.args.at(0, "file")) if mode is None or sole(mode) in ("r", "rt") else None
    file = run.library_object(call, FILE)
    run.state.store(file, "path", (path,))
    return (file,)


def _installed(run: Run, path: Value | None) -> str | None:
    """Return the path of a file below the install prefixes."""
    name = constant_text(sole(path))
    if run.launch is NO_LAUNCH or not isinstance(name, str) or not os.path.isabs(name):
        return None
    name = os.path.normpath(name)
    if not any(name.startswith(prefix.rstrip(os.sep) + os.sep) for prefix in run.program.prefixes):
        return None
    run.program.ask("file", name)
    return name if os.path.isfile(name) else None


def read(run: Run, file: Instance, call: Call) -> Value:
    """Model ``file.read()``."""
    text = _text_of(run, (file,))
    known = text is not None and len(text) <= MAX_LENGTH and not call.args.positional
    return (text,) if known else unknown(CONTENTS)


def loaded(run: Run, call: Call, parse: Callable[[str], Any]) -> Value:
    """Return what ``parse`` makes of a text, or of a file that was opened."""
    run.asks_launch = True
    text = _text_of(run, call.args.at(0)) if run.launch is not NO_LAUNCH else None
    if text is None or len(text) > MAX_BYTES or set(call.args.keywords) - {"Loader"}:
        return unknown(CONTENTS)
    try:
        data = parse(text)
    except (yaml.YAMLError, RefusedYaml, ValueError, OverflowError, RecursionError):
        return unknown(CONTENTS)
    left = [MAX_VALUES]
    found = _value(run, call, data, "data", left)
    return found if left[0] > 0 else unknown(CONTENTS)


PARSERS: dict[str, Callable[[str], Any]] = {
    "yaml.safe_load": load_yaml,
    "yaml.load": load_yaml,
    "json.load": json.loads,
    "json.loads": json.loads,
}


def _text_of(run: Run, value: Value | None) -> str | None:
    atom = constant_text(sole(value))
    if not isinstance(atom, Instance):
        return atom if isinstance(atom, str) else None
    path = sole(atom.cells.get("path"))
    if not isinstance(path, str):
        return None
    try:
        return read_text(path, MAX_BYTES)
    except (OSError, UnicodeDecodeError):
        return None


def _value(run: Run, call: Call, data: object, place: str, left: list[int]) -> Value:
    """Return ``data`` as a value; ``left`` counts how many more there may be."""
    left[0] -= 1
    if left[0] <= 0:
        return ANY
    if isinstance(data, dict) and all(isinstance(key, CONSTANTS) for key in data):
        made = run.allocate(call.node, place, Dictionary)
        for key, each in data.items():
            run.state.store(made, Key(key), _value(run, call, each, f"{place}.{key}", left))
        return (made,)
    if isinstance(data, list):
        items = tuple(_value(run, call, each, f"{place}[{index}]", left) for index, each in enumerate(data))
        return run.sequence(call.node, "list", Items(items), f"{place}[]")
    return (data,) if isinstance(data, CONSTANTS) else ANY


def closed(run: Run, file: Instance, call: Call) -> Value:
    """Model what ends the use of a file."""
    return NONE


def entered(run: Run, file: Instance, call: Call) -> Value:
    """Model ``with open(...) as file``."""
    return (file,)
