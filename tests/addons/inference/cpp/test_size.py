"""Inference of C++ stays as small as it is: whoever adds lines takes others away."""

from __future__ import annotations

from pathlib import Path

import enclave_addons.inference.cpp

FOLDER = Path(enclave_addons.inference.cpp.__file__).parent
MOST = {"engine": 4_765, "reading": 2_650, "models": 1_565}


def test_no_part_of_it_has_more_lines_than_today() -> None:
    for part, most in MOST.items():
        assert sum(len(file.read_text().splitlines()) for file in (FOLDER / part).glob("*.py")) <= most
