"""Evaluating a launch file given as text, against the packages ``pk`` and ``rc`` on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import evaluate
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Evaluation
from nodl.ament_index import INDEX_FOLDER

Evaluate = Callable[..., Evaluation]


@pytest.fixture(scope="session")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("prefix")
    for package, executable in (("pk", "e"), ("rc", "cc")):
        (folder / INDEX_FOLDER / "packages").mkdir(parents=True, exist_ok=True)
        (folder / INDEX_FOLDER / "packages" / package).touch()
        (folder / "share" / package).mkdir(parents=True)
        (folder / "lib" / package).mkdir(parents=True)
        (folder / "lib" / package / executable).touch(0o755)
    return folder


@pytest.fixture
def launched(tmp_path: Path, prefix: Path, monkeypatch: pytest.MonkeyPatch) -> Evaluate:
    """``launched(text, name:=value..., syntax="xml", **host options)``; XML text is the content of ``<launch>``."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))

    def run(text: str, *arguments: str, syntax: str = "xml", **options: Any) -> Evaluation:
        file = tmp_path / f"main.launch.{syntax}"
        file.write_text(f"<launch>\n{text}\n</launch>" if syntax == "xml" else text)
        pairs = [(name, value) for name, _, value in (argument.partition(":=") for argument in arguments)]
        return evaluate(file, pairs, host=PlanHost(**options))

    return run
