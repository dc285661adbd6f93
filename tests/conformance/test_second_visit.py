"""What a launch file gives is the same when it is visited a second time from what the first visit noted.

That is what a secured launch does: the plan is made from the first visit, the processes are started by the second.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from enclave_launch.evaluation.evaluate import EvaluationError, evaluate, parse_arguments
from enclave_launch.host.host import HostOptions
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.host.user_code_results import RecordedResults
from enclave_launch.process import Evaluation

from . import case_files
from .case_files import Case

AGAIN = {"an event handler with a function for many actions"}
"""What an event calls asks about that moment: this function counts its calls, and is called again."""

PYTHON = [
    case
    for case in case_files.load_all()
    if any(name.endswith(".py") for name in case.files) and case.name not in AGAIN
]


def visited(main: Path, case: Case, user_code_results: RecordedResults) -> tuple[Evaluation, str]:
    host = PlanHost(HostOptions("rolling@2024-12", anonymous_seed=1), user_code_results=user_code_results)
    try:
        return evaluate(main, parse_arguments(case.arguments), host=host), ""
    except EvaluationError as error:
        return error.partial, re.sub(r"0x[0-9a-f]+", "0x..", str(error))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("case", PYTHON, ids=lambda case: f"{case.group}: {case.name}")
def test_a_second_visit_gives_the_same(
    case: Case, prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    main = case_files.write(case, tmp_path)
    variables = {"AMENT_PREFIX_PATH": str(prefix), "D": str(tmp_path), **case.environment}
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)
    user_code_results = RecordedResults()
    before = dict(os.environ)
    first = visited(main, case, user_code_results)
    assert user_code_results.rewind()
    second = visited(main, case, user_code_results)
    assert second[1] == first[1]
    assert second[0].processes == first[0].processes
    assert second[0].components == first[0].components
    assert second[0].launcher_calls == first[0].launcher_calls
    assert dict(os.environ) == before


def test_there_are_many_such_cases() -> None:
    assert len(PYTHON) > 100
