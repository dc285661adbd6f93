"""A keystore holds CA keys: ``git add -A`` must not take it along."""

from __future__ import annotations

import subprocess
from pathlib import Path

import keystore


def git(folder: Path, *words: str) -> str:
    return subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True, text=True).stdout


def test_a_keystore_in_a_git_work_tree_is_ignored_by_git(tmp_path: Path) -> None:
    git(tmp_path, "init", "-q")
    (tmp_path / "robot.launch.xml").write_text("<launch/>")
    report = keystore.create_keystore(tmp_path / "config" / "ks")
    keystore.create_enclaves(tmp_path / "config" / "ks", ["/a"])
    git(tmp_path, "add", "-A")
    assert git(tmp_path, "diff", "--cached", "--name-only").split() == ["robot.launch.xml"]
    assert any(".gitignore" in action for action in report.actions)
    assert keystore.verify(tmp_path / "config" / "ks").findings == ()


def test_a_keystore_elsewhere_has_no_gitignore(tmp_path: Path) -> None:
    keystore.create_keystore(tmp_path / "ks")
    assert not (tmp_path / "ks" / ".gitignore").exists()
