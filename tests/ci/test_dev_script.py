"""``./dev`` on a bare machine: each task first asks for the system packages that it needs."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
STOPPED = 3


def packages_of(task: list[str], folder: Path) -> list[str]:
    """Return what the task asks ``tools/system-packages`` for; a stand-in prints it and ends the task."""
    shutil.copy2(ROOT / "dev", folder / "dev")
    (folder / "tools").mkdir()
    script = folder / "tools" / "system-packages"
    script.write_text(f'#!/bin/sh\necho "$@"\nexit {STOPPED}\n')
    script.chmod(0o755)
    done = subprocess.run(
        ["sh", "dev", *task], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == STOPPED, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize(
    ("task", "needed", "not_needed"),
    [
        (["test"], {"chromium", "libfastrtps-dev", "podman", "age", "libddsc0debian"}, set()),
        (["test", "--fast"], {"libddsc0debian"}, {"chromium", "podman"}),
        (["lint"], {"libddsc0debian"}, {"chromium", "podman"}),
        (["demo"], {"libddsc0debian", "openssl"}, {"chromium", "podman"}),
        (["bench"], {"libfastrtps-dev"}, set()),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_task_asks_for_its_packages_before_anything_else(
    task: list[str], needed: set[str], not_needed: set[str], tmp_path: Path
) -> None:
    requested = packages_of(task, tmp_path)
    assert needed <= set(requested)
    assert not not_needed & set(requested)
