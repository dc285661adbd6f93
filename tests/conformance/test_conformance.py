"""Our evaluation against what real launch did, case by case (see ``case_files``).

The expectations were recorded by ``python -m tests.conformance`` with launch 1.0.7 (humble), 3.4.3 (jazzy) and
3.7.1 (rolling). With the sources of real launch at hand (``upstream.py``) they are checked against it again.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from . import case_files, our_launch, upstream
from .case_files import DISTROS, Case

CASES = case_files.load_all()


def _named(case: Case) -> str:
    return f"{case.group}: {case.name}"


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("distro", DISTROS)
@pytest.mark.parametrize("case", CASES, ids=_named)
def test_we_launch_what_launch_launches(case: Case, distro: str, prefix: Path, tmp_path: Path) -> None:
    expected = case.expected_of_us(distro)
    assert expected is not None, "no expectation recorded"
    assert our_launch.run(case, distro, tmp_path, prefix, with_suppositions=bool(case.ours)) == expected


def test_every_case_has_an_expectation_of_its_own() -> None:
    names = [_named(case) for case in CASES]
    assert len(set(names)) == len(names)
    assert all(case.syntax for case in CASES)


@pytest.mark.real_launch
@pytest.mark.parametrize("distro", DISTROS)
def test_the_expectations_are_real_launchs(distro: str) -> None:
    if upstream.sources(distro) is None:
        pytest.skip(f"no sources of real launch for {distro}")
    recorded = [case for case in CASES if case.expected(distro) is not None]
    answers = upstream.run_all(recorded, distro)
    different = {
        _named(case): (answer, case.expected(distro))
        for case, answer in zip(recorded, answers, strict=True)
        if answer != case.expected(distro)
    }
    assert not different
