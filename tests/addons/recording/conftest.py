"""The recorder, the stand-in for rcl, and real rclpy."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from enclave_addons.recording.programs import RECORD_VARIABLE, recorder_library
from enclave_addons.recording.record.assembly import Record, read_record
from tests.addons.recording.stand_in_launch import build_stand_in
from tests.dds.conftest import domain_id as domain_id

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def recorder() -> Path:
    return recorder_library()


@pytest.fixture(scope="session")
def stand_in(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_stand_in(tmp_path_factory.mktemp("stand_in"))


class Recorded:
    """One program that was run with the recorder."""

    def __init__(self, status: int, record: Record, text: str, stderr: str) -> None:
        self.status, self.record, self.text, self.stderr = status, record, text, stderr


RunRecorded = Callable[..., Recorded]


@pytest.fixture
def run_recorded(recorder: Path, stand_in: Path, tmp_path: Path) -> RunRecorded:
    """``run(script, *arguments, preload=…, record=…, **environment)`` runs the stand-in with the recorder."""

    def run(
        script: str,
        *arguments: str,
        command: tuple[str, ...] = (),
        preload: str = "{}",
        record: Path | None = None,
        program: Path | None = None,
        variables: Mapping[str, str] | None = None,
    ) -> Recorded:
        file = record or tmp_path / "record"
        if record is None:
            file.write_bytes(b"")
        folder = tmp_path / "program"
        folder.mkdir(exist_ok=True)
        executable = program or stand_in / "program"
        link = folder / "node"
        link.unlink(missing_ok=True)
        link.symlink_to(executable)
        (folder / "node.asks").write_text(script)
        environment = {
            "PATH": os.environ["PATH"],
            "LD_PRELOAD": preload.format(recorder),
            RECORD_VARIABLE: str(file),
            **(variables or {}),
        }
        ran = subprocess.run(
            [*command, str(link), *arguments],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        data = file.read_bytes() if file.is_file() else b""
        return Recorded(ran.returncode, read_record(data), data.decode(errors="replace"), ran.stderr)

    return run


def rclpy_python(release: str) -> Path:
    """The python of real rclpy of this release, which ``./dev test`` sets up; fails in CI where it is missing."""
    python = ROOT / ".ros" / release / "bin" / "python"
    if not python.exists():
        message = f"no rclpy of {release}: ./dev test sets it up in .ros/{release}"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    return python


def prefix_of_rclpy(release: str, folder: Path) -> Path:
    """An install prefix whose index has rcl in the version that this rclpy runs on, as an installed ROS has it."""
    (found,) = (ROOT / ".ros" / release).glob("lib/python*/site-packages/ros_rcl-*.dist-info")
    version = found.name.removeprefix("ros_rcl-").removesuffix(".dist-info")
    for place in ("share/ament_index/resource_index/packages/rcl", "share/rcl/package.xml"):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text(
            f'<package format="3"><name>rcl</name><version>{version}</version><description/></package>\n'
        )
    return folder
