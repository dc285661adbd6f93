"""Each test has a cache of its own, and may ask which programs were followed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.entry import Entry
    from enclave_addons.inference.cpp.program import ProgramFindings, Sources
    from enclave_addons.inference.start import Start


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    return folder


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The first source of each program that was really followed, as the test goes on."""
    from enclave_addons.inference.cpp.program import run_program

    followed: list[str] = []

    def counted(sources: Sources, entry: Entry, start: Start | None) -> ProgramFindings:
        followed.append(os.path.basename(entry.files[0]))
        return run_program(sources, entry, start)

    monkeypatch.setattr("enclave_addons.inference.cpp.solved.run_program", counted)
    return followed
