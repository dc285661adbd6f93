"""Real DDS for the tests: which implementations are there, and a domain for each test alone.

Where a component is missing the tests that need it are skipped; under ``CI=true`` they fail.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.dds.probe import Probe

HERE = Path(__file__).parent
# Ports of a domain are 7400 + 250 * domain and up; from domain 100 on they are ports that the kernel
# hands out to others.
DOMAINS = range(1, 100)


def missing(what: str, how: str) -> None:
    """Skip, or fail where nothing may be missing."""
    message = f"{what} is not available: {how}"
    if os.environ.get("CI") == "true":
        pytest.fail(message)
    pytest.skip(message)


@contextlib.contextmanager
def domain() -> Iterator[int]:
    """A DDS domain that no other test on this machine uses meanwhile, whatever process it runs in."""
    folder = Path(tempfile.gettempdir()) / f"enclave-launch-dds-domains-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    for candidate in DOMAINS:
        with open(folder / str(candidate), "w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield candidate
            return
    raise RuntimeError("all DDS domains are in use by other tests")


@pytest.fixture
def domain_id() -> Iterator[int]:
    with domain() as chosen:
        yield chosen


@pytest.fixture(scope="session")
def cyclone() -> Probe:
    return cyclone_probe()


@pytest.fixture(scope="session")
def fastdds() -> Probe:
    return fastdds_probe()


def cyclone_probe() -> Probe:
    if importlib.util.find_spec("cyclonedds") is None:
        missing("Cyclone DDS", "pip install --no-binary cyclonedds '.[dds]' with CYCLONEDDS_HOME set")
    return Probe("Cyclone DDS", (sys.executable, str(HERE / "cyclone_probe.py")), crowd=7)


def fastdds_probe() -> Probe:
    # Handshakes of three and more at once sometimes take Fast DDS 2.9 half a minute, of two always a second.
    return Probe("Fast DDS", (str(_built_fastdds_probe()),), crowd=1)


@pytest.fixture(params=["cyclone", "fastdds"])
def dds(request: pytest.FixtureRequest) -> Probe:
    """Each of the implementations in turn."""
    probe = request.getfixturevalue(request.param)
    assert isinstance(probe, Probe)
    return probe


@pytest.fixture(scope="session")
def patched_dds() -> Path:
    """To preload into an attacker: a DDS library that believes everything."""
    if shutil.which("gcc") is None:
        missing("A C compiler", "apt-get install gcc libc6-dev")
    return build([HERE / "patched_attacker.c"], ["gcc", "-shared", "-fPIC"], ["-ldl"])


def _built_fastdds_probe() -> Path:
    if shutil.which("g++") is None or not Path("/usr/include/fastdds/dds").is_dir():
        missing("Fast DDS", "apt-get install g++ libfastrtps-dev")
    sources = sorted((HERE / "fastdds_probe").iterdir())
    return build(sources, ["g++", "-std=c++17", "-O1"], ["-lfastrtps", "-lfastcdr"])


def build(sources: list[Path], compiler: list[str], libraries: list[str]) -> Path:
    """Compiled once per version of its source and way of building, also when several test processes come at once."""
    way = repr((compiler, libraries)).encode()  # with the folders that the result looks into when it runs
    version = hashlib.sha256(way + b"".join(source.read_bytes() for source in sources)).hexdigest()[:16]
    folder = Path(tempfile.gettempdir()) / f"enclave-launch-dds-tests-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    result, unfinished = folder / version, folder / f"{version}.unfinished"
    with open(folder / f"{version}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not result.exists():
            units = [str(source) for source in sources if source.suffix in (".c", ".cpp")]
            command = [*compiler, "-o", str(unfinished), *units, *libraries]
            run = subprocess.run(command, capture_output=True, text=True, timeout=300)
            assert run.returncode == 0, run.stderr
            unfinished.rename(result)
    return result
