"""Which functions of events a plan need not call, and when what one gave still holds."""

from __future__ import annotations

import functools
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch.host.observed_state import observing
from enclave_launch.host.user_code import only_acts

_SEEN: list[int] = []


def _says(context: Any) -> None:
    print(context.launch_configurations["x"])


def _returns_early(context: Any) -> None:
    if not context:
        return
    print("on")


def _sets(context: Any) -> None:
    context.launch_configurations["x"] = "y"


def _remembers(context: Any) -> None:
    _SEEN.append(1)


def _gives(context: Any) -> Any:
    return [context] if context else None


def _yields(context: Any) -> Any:
    yield context


class _Bound:
    def says(self, context: Any) -> None:
        print(context)


@pytest.mark.parametrize(
    "function",
    [_says, _returns_early, _Bound().says, functools.partial(_says), functools.partial(_Bound().says)],
)
def test_a_function_that_only_acts(function: Callable[..., Any]) -> None:
    assert only_acts(function)


@pytest.mark.parametrize(
    "function", [_sets, _remembers, _gives, _yields, lambda context: [], print, None, _Bound]
)
def test_a_function_from_which_a_plan_may_learn_something(function: object) -> None:
    assert not only_acts(function)


Deed = Callable[[Path], object]

LOOKS: dict[str, Deed] = {
    "open": lambda path: path.open().close() if path.exists() else None,
    "stat": lambda path: path.exists(),
    "isfile": lambda path: os.path.isfile(path),
    "listdir": lambda path: os.listdir(path.parent),
    "glob": lambda path: list(path.parent.glob("*")),
    "program": lambda path: subprocess.run(["cat", path], capture_output=True, check=False),
    "shell": lambda path: subprocess.run(
        f"cat {path} 2>/dev/null", shell=True, capture_output=True, check=False
    ),
    "system": lambda path: os.system(f"test -f {path}"),
}
IGNORES: dict[str, Deed] = {
    "nothing": lambda path: None,
    "a file beside it": lambda path: (path.parent.parent / "beside").exists(),
    "writing": lambda path: (path.parent.parent / "written").write_text("x"),
    "a shell that writes": lambda path: subprocess.run(f"echo x >> {path}", shell=True, check=False),
}


def moment_of(deed: Deed, path: Path) -> Any:
    with observing(None) as looks:
        deed(path)
    return looks.state(None)


@pytest.mark.parametrize("there", [True, False], ids=["changed", "new"])
@pytest.mark.parametrize("deed", LOOKS.values(), ids=LOOKS)
def test_a_moment_ends_with_what_was_looked_at(tmp_path: Path, deed: Deed, there: bool) -> None:
    path = tmp_path / "in" / "file"
    path.parent.mkdir()
    if there:
        path.write_text("before")
    moment = moment_of(deed, path)
    assert moment.is_unchanged(None)
    path.unlink(missing_ok=True)
    path.write_text("something else")
    assert not moment.is_unchanged(None)


@pytest.mark.parametrize("deed", IGNORES.values(), ids=IGNORES)
def test_a_moment_goes_on_when_something_else_changes(tmp_path: Path, deed: Deed) -> None:
    path = tmp_path / "in" / "file"
    path.parent.mkdir()
    moment = moment_of(deed, path)
    path.write_text("new")
    assert moment.is_unchanged(None)


def test_the_environment_counts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    moment = moment_of(IGNORES["nothing"], tmp_path)
    monkeypatch.setenv("OF_THIS_MOMENT", "1")
    assert not moment.is_unchanged(None)


def _binds(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


def _reads_fifo(path: Path) -> None:
    os.mkfifo(path)
    os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))


LEAVES_NO_TRACE: dict[str, Deed] = {
    "the network": lambda path: sys.audit("socket.connect", None, ("127.0.0.1", 1)),
    "a name in the network": lambda path: socket.getaddrinfo("localhost", 1),
    "whether a port is free": _binds,
    "whether a process runs": lambda path: os.kill(os.getpid(), 0),
    "the kernel's files": lambda path: Path("/proc/loadavg").read_text(),
    "a device": _reads_fifo,
}
LEAVES_ONE: dict[str, Deed] = {
    "nothing": lambda path: None,
    "this machine's name": lambda path: socket.gethostname(),
    "a program without input": lambda path: subprocess.run(["true"], stdin=subprocess.DEVNULL, check=True),
    "a file": lambda path: Path(__file__).read_text(),
}


@pytest.mark.parametrize("deed", LEAVES_NO_TRACE.values(), ids=LEAVES_NO_TRACE)
def test_what_looked_at_something_that_changes_unseen_holds_for_no_other_moment(
    deed: Deed, tmp_path: Path
) -> None:
    assert moment_of(deed, tmp_path / "path") is None


@pytest.mark.parametrize("deed", LEAVES_ONE.values(), ids=LEAVES_ONE)
def test_what_can_be_looked_at_again_holds(deed: Deed, tmp_path: Path) -> None:
    assert moment_of(deed, tmp_path / "path").is_unchanged(None)


def test_what_was_put_in_the_place_of_os_functions_is_gone_afterwards(tmp_path: Path) -> None:
    before = os.stat, os.lstat, os.access
    moment_of(LOOKS["stat"], tmp_path)
    assert (os.stat, os.lstat, os.access) == before
