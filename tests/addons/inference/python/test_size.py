"""Inference of Python stays as small as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons import inference

TOTAL = 19_670
LINES = {"kernel": 1_285, "python": 5_315, "models": 275}


@pytest.mark.parametrize("room", LINES)
def test_a_room_of_inference_does_not_grow(room: str) -> None:
    files = (Path(inference.__file__).parent / room).glob("*.py")
    assert sum(len(file.read_text().splitlines()) for file in files) <= LINES[room]


def test_inference_as_a_whole_does_not_grow() -> None:
    files = Path(inference.__file__).parent.rglob("*.py")
    assert sum(len(file.read_text().splitlines()) for file in files) <= TOTAL
