"""The writer's thread: order, bounded memory, and destinations that fail."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.runtime import sinks
from enclave_launch.runtime.sinks import HIGH_WATER, FileSink, ScreenSink, SinkWriter
from tests.runtime.conftest import eventually


class Gated:
    """A destination that takes nothing until it is opened, as a terminal after Ctrl-S."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.received = b""

    def write(self, data: bytes) -> None:
        self.open.wait()
        self.received += data


def test_a_slow_destination_pauses_the_producers_and_loses_nothing() -> None:
    said: list[str] = []
    drained = threading.Event()
    writer = SinkWriter(lambda: said.append("full"), drained.set)
    sink = Gated()
    piece = b"x" * 1000
    for _ in range(HIGH_WATER // 1000 + 2):
        writer.write(sink, piece)
    assert said == ["full"]
    assert not drained.is_set()
    sink.open.set()
    assert drained.wait(10)
    writer.close()
    assert len(sink.received) == (HIGH_WATER // 1000 + 2) * 1000


def test_a_stopped_terminal_holds_up_neither_write_nor_close(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sinks, "FLUSH_TIMEOUT", 0.1)
    writer = SinkWriter(lambda: None, lambda: None)
    writer.write(Gated(), b"never")
    writer.close()


def test_a_screen_whose_reader_went_away_is_given_up(tmp_path: Path) -> None:
    reader, descriptor = os.pipe()
    with os.fdopen(descriptor, "w") as stream:
        screen = ScreenSink(stream)
        os.close(reader)
        screen.write(b"lost")
        screen.write(b"not even tried")


def test_a_file_moved_away_is_opened_anew(tmp_path: Path) -> None:
    sink = FileSink(tmp_path / "launch.log")
    sink.write(b"before\n")
    (tmp_path / "launch.log").rename(tmp_path / "launch.log.1")
    sink.write(b"after\n")
    sink.close()
    assert (tmp_path / "launch.log.1").read_bytes() == b"before\n"
    assert (tmp_path / "launch.log").read_bytes() == b"after\n"


def test_a_full_disk_costs_the_log_and_is_said_once() -> None:
    said: list[str] = []
    sink = FileSink(Path("/dev/full"), said.append)
    sink.write(b"lost")
    sink.write(b"lost too")
    sink.close()
    assert said == [
        "cannot write /dev/full: No space left on device; output for it is lost until it can be written"
    ]


def test_a_log_that_can_be_written_again_says_what_it_lacks(tmp_path: Path) -> None:
    said: list[str] = []
    path = tmp_path / "missing" / "launch.log"
    sink = FileSink(path, said.append)
    sink.write(b"lost\n")
    path.parent.mkdir()
    sink.write(b"kept\n")
    sink.write(b"kept\n")
    sink.close()
    assert path.read_bytes() == b"kept\nkept\n"
    assert [text.split(";")[0] for text in said] == [
        f"cannot write {path}: No such file or directory",
        f"{path} can be written again",
    ]


def test_a_log_with_a_limit_keeps_one_older_file_and_one_without_grows(tmp_path: Path) -> None:
    limited = FileSink(tmp_path / "limited.log", limit=10)
    unlimited = FileSink(tmp_path / "unlimited.log")
    for number in range(5):
        for sink in (limited, unlimited):
            sink.write(f"line{number}\n".encode())
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "limited.log": "line4\n",
        "limited.log.1": "line3\n",
        "unlimited.log": "line0\nline1\nline2\nline3\nline4\n",
    }


@given(
    writes=st.lists(st.lists(st.integers(0, 30), max_size=20), max_size=6),
    limit=st.integers(1, 60),
)
def test_no_file_grows_over_its_limit_however_much_comes_at_once(
    writes: list[list[int]], limit: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Only a line that is longer than the limit has a file of its own; what is kept is the end of what came."""
    path = tmp_path_factory.mktemp("limited") / "a.log"
    sink = FileSink(path, limit=limit)
    everything = b""
    for lengths in writes:
        data = b"".join(b"x" * length + b"\n" for length in lengths)
        everything += data
        sink.write(data)
    sink.close()
    kept = [file.read_bytes() for file in (path.with_name("a.log.1"), path) if file.exists()]
    assert everything.endswith(b"".join(kept))
    assert all(len(text) <= limit or text.count(b"\n") == 1 for text in kept)
    assert not everything or kept[-1], "the newest lines are there"


def test_a_non_blocking_standard_output_still_gets_everything() -> None:
    reader, descriptor = os.pipe()
    os.set_blocking(descriptor, False)
    with os.fdopen(descriptor, "w") as stream, os.fdopen(reader, "rb") as output:
        writer = SinkWriter(lambda: None, lambda: None)
        writer.write(ScreenSink(stream), b"y" * 300_000)
        assert len(output.read(300_000)) == 300_000
        writer.close()


def test_order_within_a_destination_is_kept(tmp_path: Path) -> None:
    writer = SinkWriter(lambda: None, lambda: None)
    files = [FileSink(tmp_path / name) for name in ("a", "b")]
    for number in range(2000):
        writer.write(files[number % 2], f"{number}\n".encode())
    writer.close()
    assert eventually(lambda: (tmp_path / "b").exists())
    for parity, name in enumerate("ab"):
        assert (tmp_path / name).read_text().split() == [str(n) for n in range(parity, 2000, 2)]
