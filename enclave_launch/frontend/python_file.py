"""Run a Python launch file. This is foreign code with all rights of the user: alone here, behind a switch.

Nothing is written: no ``__pycache__`` beside the launch file."""

from __future__ import annotations

import os
from functools import lru_cache
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from types import CodeType, ModuleType
from typing import Any

from enclave_common.files import check_regular, read_bytes
from enclave_common.source_location import SourceLocation
from enclave_launch.frontend.error_location import frames

MODULE_NAME = "python_launch_file"


class PythonRefused(RuntimeError):
    """A Python launch file was not run: ``--no-python`` is in force."""


def run(path: str, *, allowed: bool) -> ModuleType:
    """Execute the file as a new module; raises ``PythonRefused`` unless ``allowed``, and whatever the file raises."""
    check_regular(path)  # a missing file is reported as such even where Python is refused
    if not allowed:
        raise PythonRefused(f"'{path}' would have to be run as Python, which --no-python refuses")
    loader = _Loader(MODULE_NAME, path)
    spec = spec_from_loader(MODULE_NAME, loader)
    assert spec is not None  # only namespace packages have none
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


def user_frame(error: BaseException, path: str) -> SourceLocation | None:
    """Return where in ``path`` the exception came from: the innermost of that file's own frames."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return SourceLocation(path, error.lineno or 0)
    lines = [step.tb_lineno for step in frames(error) if step.tb_frame.f_code.co_filename == path]
    return SourceLocation(path, lines[-1]) if lines else None


class _Loader(SourceFileLoader):
    """Takes each version of a file once: from the ``__pycache__`` that ``ros2 launch`` left beside it, as upstream
    does, else compiled in memory."""

    def get_code(self, fullname: str) -> CodeType:
        status = os.stat(self.path)
        return _code(self.path, status.st_ino, status.st_mtime_ns, status.st_size)

    def get_data(self, path: str) -> bytes:
        return read_bytes(path)

    def set_data(self, path: str, data: Any, *, _mode: int = 0) -> None:
        """Write nothing: no byte code is cached beside launch files."""


@lru_cache(maxsize=512)
def _code(path: str, *_version: int) -> CodeType:
    code = SourceFileLoader.get_code(_Loader(MODULE_NAME, path), MODULE_NAME)
    assert code is not None  # only packages without a file have none
    return code
