"""Data files that the launch knows: below the share directory of an installed package whose name the program says.

Their text is read, never run, and what a program makes of it depends on it from then on (``Findings.files``). What lies
anywhere else, is not there, is too large or is named by something not known has unknown contents.
"""

from __future__ import annotations

import io
import os
import posixpath
from collections.abc import Callable
from pathlib import PurePosixPath

from enclave_launch.boundary.files import read_bytes
from nodl.ament_index import PackageNotFoundError, package_prefix, package_share_directory
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Model, Run
from nodl.infer.values import BOOLEAN, NativeObject, Value, sole, unknown

MAX_FILE_BYTES = 1 << 18
CONTENTS = "the contents of a file, read when the program runs"


def _directory(find: Callable[..., str], as_path: bool) -> Model:
    def model(run: Run, call: Call) -> Value:
        package = sole(call.args.at(0, "package_name"))
        if not isinstance(package, str):
            return unknown("the folder of a package whose name is not known")
        run.program.ask("package", package)
        try:
            found = find(package, run.program.prefixes)
        except (PackageNotFoundError, ValueError):
            return unknown(f"the folder of package {package}, which is not installed where it was looked for")
        run.shares[posixpath.normpath(package_share_directory(package, run.program.prefixes))] = None
        run.understood.add(call.node)
        return (NativeObject(PurePosixPath(found), run.state.forks),) if as_path else (found,)

    return model


def opened(run: Run, path: object, mode: object, call: Call) -> Value:
    """``open(path, mode)``: the file for reading, as a real object."""
    place = _known_place(run, path)
    if place is None:
        return unknown(CONTENTS)
    if not isinstance(mode, str) or set(mode) - set("rbt"):
        run.gap(call.node, call.frame, f"the program writes {place}, which it may read")
        return unknown(CONTENTS)
    data = _read(run, place)
    if data is None:
        return unknown(f"the contents of {place}, which cannot be read")
    made = io.BytesIO(data) if "b" in mode else io.StringIO(data.decode())
    return (NativeObject(made, run.state.forks),)


def path_method(run: Run, path: PurePosixPath, name: str, call: Call) -> Value:
    """A method of a ``pathlib.Path`` that asks the file system."""
    if name == "open":
        return opened(run, path, sole(call.args.at(0, "mode") or ("r",)), call)
    if name in ("read_text", "read_bytes"):
        place = _known_place(run, path)
        data = _read(run, place) if place is not None else None
        if data is None:
            return unknown(CONTENTS if place is None else f"the contents of {place}, which cannot be read")
        return (data.decode(),) if name == "read_text" else (data,)
    if name in ("exists", "is_file"):
        return _exists(run, path)
    if name in ("resolve", "absolute") and path.is_absolute() and _known_place(run, path) is not None:
        return (NativeObject(path, run.state.forks),)
    return unknown("what a file system says")


def _open(run: Run, call: Call) -> Value:
    mode, encoding = call.args.at(1, "mode") or ("r",), sole(call.args.at(3, "encoding") or ("utf-8",))
    if not isinstance(encoding, str) or encoding.lower() not in ("utf-8", "utf8"):
        return unknown(CONTENTS)
    return opened(run, _real(call.args.at(0, "file")), sole(mode), call)


def _is_there(run: Run, call: Call) -> Value:
    return _exists(run, _real(call.args.at(0, "path")))


def _real(value: Value | None) -> object:
    atom = sole(value)
    return atom.object if isinstance(atom, NativeObject) else atom


def _exists(run: Run, path: object) -> Value:
    """A file that is there will be there; one that is not may be made until the program asks."""
    place = _known_place(run, path)
    return (True,) if place is not None and _read(run, place) is not None else BOOLEAN


def _known_place(run: Run, path: object) -> str | None:
    if not isinstance(path, str | PurePosixPath) or not run.shares:
        return None
    place = posixpath.normpath(str(path))
    return place if any(place.startswith(f"{share}/") for share in run.shares) else None


def _read(run: Run, place: str) -> bytes | None:
    """The file's text; ``None``: not there, too large, no regular file, or in another encoding than UTF-8."""
    run.program.ask("file", os.path.abspath(place))
    try:
        data = read_bytes(place, MAX_FILE_BYTES)
        data.decode()
    except (OSError, UnicodeDecodeError):
        return None
    run.findings.files.setdefault(os.path.abspath(place))
    return data


_INDEX = ("ament_index_python", "ament_index_python.packages")
FUNCTIONS: dict[str, Model] = {
    **{f"{module}.get_package_share_directory": _directory(package_share_directory, False) for module in _INDEX},
    **{f"{module}.get_package_share_path": _directory(package_share_directory, True) for module in _INDEX},
    **{f"{module}.get_package_prefix": _directory(package_prefix, False) for module in _INDEX},
    "builtins.open": _open,
    "io.open": _open,
    "os.path.exists": _is_there,
    "os.path.isfile": _is_there,
}  # fmt: skip
