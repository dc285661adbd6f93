"""Launch files run in the launcher's process: none of them can read the passphrase of the CA."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from keystore import CaAccess, CreateOptions, Secret, create_keystore, verify
from tests.flow.conftest import SecureLaunch

WORD = "open-sesame"
READER = """
import os
from pathlib import Path
from launch import LaunchDescription
from launch.actions import ExecuteProcess

def generate_launch_description():
    seen = [Path('/proc/self/environ').read_bytes(), str(dict(os.environ)).encode()]
    Path({place!r}).write_bytes(b'|'.join(seen))
    return LaunchDescription([ExecuteProcess(cmd=['true'])])
"""


@pytest.fixture
def keystore(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CA_WORD", WORD)
    access = CaAccess(Secret(variable="CA_WORD"))
    create_keystore(tmp_path / "ks", CreateOptions(durable=False, access=access, encrypt_ca_keys=True))
    return tmp_path / "ks"


def secured(keystore: Path) -> tuple[str, ...]:
    return ("--secure", "--keystore", str(keystore), "--ca-passphrase-env", "CA_WORD")


def test_a_python_launch_file_sees_it_nowhere(
    keystore: Path, tmp_path: Path, secure_launch: SecureLaunch
) -> None:
    place = tmp_path / "seen"
    file = tmp_path / "reader.launch.py"
    file.write_text(READER.format(place=str(place)))
    done = secure_launch(*secured(keystore), file)
    assert done.returncode == 0, done.stderr
    assert WORD.encode() not in place.read_bytes() and b"PATH=" in place.read_bytes()
    plainly = secure_launch(file)
    assert plainly.returncode == 0 and WORD.encode() in place.read_bytes(), "else the test sees nothing"


@pytest.mark.parametrize("read", ["$(env CA_WORD unset)", "$(command 'printenv CA_WORD' warn ignore)"])
def test_a_substitution_does_not_see_it(
    read: str, keystore: Path, write: Callable[..., Path], secure_launch: SecureLaunch
) -> None:
    file = write(f'<executable cmd="echo [{read}]" enclave="/tool" output="screen"/>')
    done = secure_launch(*secured(keystore), file)
    assert WORD not in done.stdout + done.stderr


def test_what_is_planned_is_signed(
    keystore: Path, write: Callable[..., Path], secure_launch: SecureLaunch
) -> None:
    file = write('<executable cmd="true" enclave="/tool"/>')
    done = secure_launch(*secured(keystore), file)
    assert done.returncode == 0, done.stderr
    assert "1 enclave created: /tool" in done.stderr
    assert verify(keystore).is_good
    without = write('<executable cmd="true" enclave="/other"/>')
    refused = secure_launch("--secure", "--keystore", keystore, without)
    assert refused.returncode != 0 and "is encrypted" in refused.stderr
