"""The README cannot lie: what it shows is what the commands print, and the code it shows is the code that is tested."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
MODULES = {
    "secure-launch": "enclave_launch",
    "secure-plan": "enclave_addons.review.verb",
    "secure-nodl": "nodl.verb",
    "secure-keystore": "keystore.verb",
}

CONSOLE = re.findall(r"^```console\n\$ (.*?)\n(.*?)\n```$", README, re.S | re.M)


@pytest.mark.parametrize(("command", "shown"), CONSOLE, ids=[command for command, _ in CONSOLE])
def test_a_command_prints_what_the_readme_shows(command: str, shown: str) -> None:
    program, *words = shlex.split(command)
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "AMENT_"))
    }
    run = subprocess.run(
        [sys.executable, "-m", MODULES[program], *words],
        capture_output=True, text=True, cwd=ROOT, env=environment, check=True, timeout=60,
    )  # fmt: skip
    assert run.stdout.replace(f"{ROOT}/", "").rstrip() == shown


def test_the_readme_has_commands_to_check() -> None:
    assert len(CONSOLE) >= 3


def test_the_launcher_in_the_readme_is_the_tested_one() -> None:
    (shown,) = re.findall(r"^```python\n(.*?)\n```$", README, re.S | re.M)
    assert shown in (ROOT / "fixtures" / "custom_launcher.py").read_text()


def test_links_of_the_readme_lead_somewhere() -> None:
    targets = re.findall(r"\]\((?!http)([^)#]+)\)", README)
    assert [target for target in targets if not (ROOT / target).exists()] == []
