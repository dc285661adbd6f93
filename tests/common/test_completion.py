"""A shell is offered verbs, options, packages, launch files and enclaves: real argcomplete asks, as the shell does."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.keystore.kit import filled

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "fixtures" / "demo_ws"
MODULES = {
    "secure-launch": "enclave_launch",
    "secure-plan": "enclave_addons.review.verb",
    "secure-keystore": "keystore.verb",
}


def offered(line: str, folder: Path) -> list[str]:
    """Return what follows at the end of ``line``, for a shell in ``folder``.

    argcomplete answers at file descriptor 8, as shells read it; version 1.8 (Ubuntu 22.04) knows no other way.
    """
    out = folder / "offered"
    environment = {
        **os.environ,
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
        "PYTHONPATH": str(ROOT),
        "AMENT_PREFIX_PATH": str(DEMO),
    }
    words = [sys.executable, "-m", MODULES[line.split()[0]]]
    answered_at_8 = ["sh", "-c", f'exec "$@" 8>{shlex.quote(str(out))}', "sh", *words]
    subprocess.run(answered_at_8, cwd=folder, env=environment, check=True, timeout=60)
    return [each.strip() for each in out.read_text().splitlines()]


@pytest.mark.parametrize(
    ("line", "one", "not_one"),
    [
        ("secure-keystore re", "renew", "create"),
        (
            "secure-plan check --acc",
            "--accept-patterns",
            "--expect",
        ),  # described by another help, completed here
        ("secure-plan check demo", "demo_nodes", "--nodl"),
        ("secure-launch --dry-run demo_nodes talker", "talker_listener.launch.xml", "demo_nodes"),
    ],
)
def test_verbs_options_packages_and_launch_files(line: str, one: str, not_one: str, tmp_path: Path) -> None:
    found = offered(line, tmp_path)
    assert one in found and not_one not in found


def test_enclaves_of_the_keystore_where_they_exist_already(tmp_path: Path) -> None:
    filled(tmp_path / "ks", ["/front/camera", "/arm"])
    assert set(offered("secure-keystore renew ks /", tmp_path)) == {"/front/camera", "/arm"}
    assert "/arm" not in offered("secure-keystore create-enclave ks /", tmp_path)


def test_no_keystore_has_no_enclaves(tmp_path: Path) -> None:
    assert "/arm" not in offered("secure-keystore renew absent /a", tmp_path)
