"""Asks real launch, one subprocess for many cases. Only used when its sources are given.

``REAL_LAUNCH_PYTHONPATH`` holds the PYTHONPATH of the rolling sources, ``REAL_LAUNCH_PYTHONPATH_HUMBLE`` and
``..._JAZZY`` those of the other distributions.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import case_files
from .case_files import Case
from .outcome import Component, Outcome, Process, render

DRIVER = Path(__file__).with_name("real_driver.py")


def sources(distro: str) -> str | None:
    """The PYTHONPATH of this distribution's sources, if given."""
    name = "REAL_LAUNCH_PYTHONPATH" + ("" if distro == "rolling" else f"_{distro.upper()}")
    return os.environ.get(name) or None


def api(distro: str) -> dict[str, list[str]]:
    """The public names of real launch's packages (see ``public_api``)."""
    with tempfile.TemporaryDirectory() as temporary:
        answer = _drive("api", sources(distro), Path(temporary))
    return json.loads(answer)  # type: ignore[no-any-return]


def run_all(cases: Sequence[Case], distro: str) -> list[str]:
    """What real launch does with each case, rendered. Raises ``RuntimeError`` without sources."""
    with tempfile.TemporaryDirectory(prefix="conformance_") as temporary:
        root = Path(temporary).resolve()
        prefix = root / "prefix"
        case_files.install_packages(prefix)
        jobs = [_job(case, root / f"case{number}") for number, case in enumerate(cases)]
        lines = _drive(jobs, sources(distro), prefix).splitlines()
        folders = [{job["folder"]: "DIR", str(prefix): "PREFIX"} for job in jobs]
        return [_render(json.loads(line), names) for line, names in zip(lines, folders, strict=True)]


def _drive(jobs: object, path: str | None, prefix: Path) -> str:
    if path is None:
        raise RuntimeError("no sources of real launch given")
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": os.environ.get("HOME", "/"),
        "PYTHONPATH": path,
        "AMENT_PREFIX_PATH": str(prefix),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    command = [sys.executable, "-W", "ignore", str(DRIVER)]
    answer = subprocess.run(
        command, input=json.dumps(jobs), capture_output=True, text=True, env=environment, check=False
    )
    if answer.returncode != 0:
        raise RuntimeError(answer.stderr[-4000:])
    return answer.stdout


def _job(case: Case, folder: Path) -> dict[str, Any]:
    folder.mkdir()
    main = case_files.write(case, folder)
    return {
        "file": str(main),
        "arguments": case.arguments,
        "environment": {"D": str(folder), **case.environment},
        "folder": str(folder),
    }


def _render(answer: dict[str, Any], folders: dict[str, str]) -> str:
    if "crash" in answer:
        return f"crash {answer['crash']}"
    error = answer["error"]
    return render(
        Outcome(
            processes=[Process(**item) for item in answer["processes"]],
            components=[
                Component(
                    **{
                        **item,
                        "parameters": dict(item["parameters"]),
                        "extra_arguments": dict(item["extra_arguments"]),
                    }
                )
                for item in answer["loads"]
            ],
            logs=[(level, text) for level, text in answer["logs"]],
            error=None if error is None else (error[0], error[1]),
            parameter_files=answer["parameter_files"],
            folders=folders,
        )
    )
