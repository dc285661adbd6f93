"""For the tests of conformance: the packages that their cases name."""

from __future__ import annotations

from pathlib import Path

import pytest

from . import case_files


@pytest.fixture(scope="session")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An install prefix of the packages that the cases name."""
    folder = tmp_path_factory.mktemp("prefix")
    case_files.install_packages(folder)
    return folder
