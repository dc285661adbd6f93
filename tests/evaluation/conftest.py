"""Launch files written by a test, evaluated as a dry run."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import evaluate, parse_arguments
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Evaluation

Launch = Callable[..., Evaluation]

PREAMBLE = """
from launch import *
from launch.actions import *
from launch.conditions import *
from launch.event_handlers import *
from launch.events import matches_action
from launch.substitutions import *
EP, LC = ExecuteProcess, LaunchConfiguration
"""


@pytest.fixture
def files(tmp_path: Path) -> Callable[..., Path]:
    """``files(name=text)``: write launch files (``__`` in a name is a dot), give their folder."""

    def write(**texts: str) -> Path:
        for name, text in texts.items():
            path = tmp_path / name.replace("__", ".")
            body = textwrap.dedent(text)
            path.write_text(f"<launch>{body}</launch>" if path.suffix == ".xml" else body, encoding="utf-8")
        return tmp_path

    return write


@pytest.fixture
def launch_xml(files: Callable[..., Path]) -> Launch:
    """Evaluate the content of ``<launch>``."""

    def run(text: str, *words: str, **options: Any) -> Evaluation:
        folder = files(main__launch__xml=text)
        return evaluate(folder / "main.launch.xml", parse_arguments(words), host=PlanHost(**options))

    return run


@pytest.fixture
def launch_py(files: Callable[..., Path]) -> Launch:
    """Evaluate statements that define ``entities``, with the public names of ``launch`` imported."""

    def run(text: str, *words: str, **options: Any) -> Evaluation:
        body = PREAMBLE + textwrap.dedent(text)
        body += "\ndef generate_launch_description():\n    return LaunchDescription(entities)\n"
        folder = files(main__launch__py=body)
        return evaluate(folder / "main.launch.py", parse_arguments(words), host=PlanHost(**options))

    return run


@pytest.fixture
def started() -> Callable[[Evaluation], list[tuple[str, str | None]]]:
    """Command line and mark of each process."""
    return lambda evaluation: [(" ".join(process.cmd), process.on_event) for process in evaluation.processes]
