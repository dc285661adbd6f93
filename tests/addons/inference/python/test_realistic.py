"""Programs in the style of public packages, each beside what it makes when it runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths
from tests.addons.inference.truth import claim, infer_launched, read_cases, truth

CASES = {case.title: case for case in read_cases(Path(__file__).parent / "realistic.programs")}
OPEN_BEFORE_A_LAUNCH = {
    "empty default list that is looped over", "environment variable", "number of robots as parameter",
    "path and string edits",
}  # fmt: skip
WIDER_BEFORE_A_LAUNCH = {"namespace from parameter with default", "int parameter selects"}
OPEN_IN_A_LAUNCH = {"path and string edits"}


@pytest.fixture
def written(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    file = tmp_path / "program.py"
    file.write_text(CASES[request.node.callspec.params["title"]].text, encoding="utf-8")
    return file


@pytest.mark.parametrize("title", CASES)
def test_in_a_launch_inference_names_what_the_program_makes_and_nothing_else(
    title: str, written: Path
) -> None:
    for parameters in CASES[title].scenarios:
        found = infer_launched(written, parameters)
        claimed = claim(InferredSystem(found.interfaces, (), ()), parameters)
        made = truth(CASES[title], written, parameters)
        assert {fact for fact in made if not claimed.covers(fact)} == set()
        if title not in OPEN_IN_A_LAUNCH:
            assert claimed.exact
            assert claimed.facts == made


@pytest.mark.parametrize("title", CASES)
def test_without_a_launch_nothing_is_missing_and_both_sides_of_a_parameter_are_granted(
    title: str, written: Path
) -> None:
    system = infer_paths([written])
    for parameters in CASES[title].scenarios:
        claimed = claim(system, parameters)
        made = truth(CASES[title], written, parameters)
        assert {fact for fact in made if not claimed.covers(fact)} == set()
        assert claimed.exact == (title not in OPEN_BEFORE_A_LAUNCH)
        if title not in OPEN_BEFORE_A_LAUNCH | WIDER_BEFORE_A_LAUNCH:
            assert claimed.facts == made
