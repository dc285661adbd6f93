"""Programs on real DDS, and an observer beside them; a domain for each test alone."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from enclave_addons.observation.graph.cyclone import CycloneObserver
from tests.addons.observation.graph.nodes import LOOPBACK, Implementation, Program
from tests.dds.conftest import build, missing
from tests.dds.conftest import domain_id as domain_id

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def cyclone() -> Implementation:
    if importlib.util.find_spec("cyclonedds") is None:
        missing("Cyclone DDS", "pip install --no-binary cyclonedds '.[dds]' with CYCLONEDDS_HOME set")
    return Implementation("Cyclone DDS", (sys.executable, str(HERE / "cyclone_nodes.py")))


@pytest.fixture(scope="session")
def fastdds() -> Implementation:
    import shutil

    if shutil.which("g++") is None or not Path("/usr/include/fastdds/dds").is_dir():
        missing("Fast DDS", "apt-get install g++ libfastrtps-dev")
    program = build([HERE / "fastdds_nodes.cpp"], ["g++", "-std=c++17"], ["-lfastrtps", "-lfastcdr"])
    return Implementation("Fast DDS", (str(program),))


@pytest.fixture(params=["cyclone", "fastdds"])
def dds(request: pytest.FixtureRequest) -> Implementation:
    """Each of the implementations in turn."""
    found = request.getfixturevalue(request.param)
    assert isinstance(found, Implementation)
    return found


Start = Callable[..., Program]


@pytest.fixture
def start(domain_id: int) -> Iterator[Start]:
    """``start(implementation, gid_size=16, enclave="/")``: a program that ends with the test."""
    with ExitStack() as programs:

        def started(
            implementation: Implementation, *more: str, gid_size: int = 16, enclave: str = "/"
        ) -> Program:
            program = Program(implementation.command, domain_id, enclave, gid_size, *more)
            programs.callback(program.end)
            return program

        yield started


@pytest.fixture
def observer(cyclone: Implementation, domain_id: int) -> Iterator[CycloneObserver]:
    up = CycloneObserver(domain_id, LOOPBACK)
    yield up
    up.close()
