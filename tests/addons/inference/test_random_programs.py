"""Nothing that a random program makes is missing silently; ``./dev fuzz inference-python`` makes more programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.random_programs import random_program, silently_missing

PROGRAMS = 300


@pytest.mark.parametrize("first", range(0, PROGRAMS, 50))
def test_nothing_that_a_random_program_makes_is_missing_silently(first: int, tmp_path: Path) -> None:
    for seed in range(first, first + 50):
        assert not silently_missing(seed, tmp_path), random_program(seed)


def test_a_seed_stands_for_one_program() -> None:
    assert random_program(7) == random_program(7)
    assert len({random_program(seed) for seed in range(PROGRAMS)}) == PROGRAMS
