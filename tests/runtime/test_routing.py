"""Where a process's lines go and how they look, by launch's rules."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch import RuntimeFailure
from enclave_launch.ros_rules.output import OutputSetting, output_routes
from enclave_launch.runtime.launch_log import LaunchLog, Writers
from enclave_launch.runtime.live_process import (
    LONGEST_LINE,
    LineBuffer,
    OutputRouter,
)
from enclave_launch.runtime.sinks import ScreenSink, SinkWriter


class Outputs:
    """Screen and log directory of one run, read back after everything was written."""

    def __init__(
        self, directory: Path, environment: dict[str, str] | None = None, debug: bool = False
    ) -> None:
        self.directory = directory
        self.stream = io.StringIO()
        writers = Writers(
            screen=SinkWriter(lambda: None, lambda: None), files=SinkWriter(lambda: None, lambda: None)
        )
        self.log = LaunchLog(directory, ScreenSink(self.stream), writers, environment or {}, debug)

    def close(self) -> dict[str, str]:
        """What is where; times in launch.log are shown as T."""
        self.log.close()
        found = {path.name: path.read_text(encoding="utf-8") for path in sorted(self.directory.iterdir())}
        if self.stream.getvalue():
            found["screen"] = self.stream.getvalue()
        return {name: re.sub(r"(?m)^\d+\.\d{7}", "T", text) for name, text in found.items()}


# Twins of launch: get_output_loggers(name, setting) of launch 3.7, one line "o" on stdout and one "e" on
# stderr.
CASES: dict[str, tuple[OutputSetting, dict[str, str]]] = {
    "screen": ("screen", {"screen": "[a-1] o\n[a-1] e\n"}),
    "log: all to launch.log, stderr to the screen as well": (
        "log",
        {"launch.log": "T [a-1] o\nT [a-1] e\n", "screen": "[a-1] e\n"},
    ),
    "both": ("both", {"launch.log": "T [a-1] o\nT [a-1] e\n", "screen": "[a-1] o\n[a-1] e\n"}),
    "own_log": (
        "own_log",
        {"a-1-stdout.log": "[a-1] o\n", "a-1-stderr.log": "[a-1] e\n", "a-1.log": "[a-1] o\n[a-1] e\n"},
    ),
    "full": (
        "full",
        {
            "a-1-stdout.log": "[a-1] o\n",
            "a-1-stderr.log": "[a-1] e\n",
            "a-1.log": "[a-1] o\n[a-1] e\n",
            "launch.log": "T [a-1] o\nT [a-1] e\n",
            "screen": "[a-1] o\n[a-1] e\n",
        },
    ),
    "by stream": (
        {"stdout": "log", "stderr": {"screen", "own_log"}},
        {"launch.log": "T [a-1] o\n", "a-1-stderr.log": "[a-1] e\n", "screen": "[a-1] e\n"},
    ),
    "both and one stream add up": (
        {"both": "screen", "stdout": ["own_log"]},
        {"a-1-stdout.log": "[a-1] o\n", "screen": "[a-1] o\n[a-1] e\n"},
    ),
    "nowhere": ({}, {}),
}


@pytest.mark.parametrize(("setting", "expected"), CASES.values(), ids=CASES)
def test_destinations(setting: OutputSetting, expected: dict[str, str], tmp_path: Path) -> None:
    outputs = Outputs(tmp_path)
    router = OutputRouter(outputs.log, "a-1", output_routes(setting))
    router.feed("stdout", b"o\n")
    router.feed("stderr", b"e\n")
    assert outputs.close() == expected


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("loud", "loud is not a valid standard output config"),
        ({"stdin": "screen"}, "stdin is not a valid output source"),
        ({"stdout": "printer"}, "printer is not a valid output destination"),
    ],
)
def test_what_launch_refuses(setting: OutputSetting, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        output_routes(setting)


def test_a_line_split_over_chunks_is_one_line_and_the_last_needs_no_line_end(tmp_path: Path) -> None:
    outputs = Outputs(tmp_path)
    router = OutputRouter(outputs.log, "a-1", output_routes("screen"))
    for chunk in ("Grü".encode()[:3], "Grü".encode()[3:], b"ezi\nsecond", b" half\n\nlast"):
        router.feed("stdout", chunk)
    router.flush()
    assert outputs.close() == {"screen": "[a-1] Grüezi\n[a-1] second half\n[a-1] \n[a-1] last\n"}


def test_bytes_that_are_no_text_are_shown_as_replacement_characters(tmp_path: Path) -> None:
    outputs = Outputs(tmp_path)
    OutputRouter(outputs.log, "a-1", output_routes("both")).feed("stdout", b"\xff\xfe ok\n")
    shown = outputs.close()
    assert shown["screen"] == "[a-1] �� ok\n"
    assert shown["launch.log"] == "T [a-1] �� ok\n"


def test_a_custom_format_is_applied_line_by_line(tmp_path: Path) -> None:
    outputs = Outputs(tmp_path)
    router = OutputRouter(outputs.log, "a-1", output_routes("screen"), lambda line: f"<{line}>")
    router.feed("stdout", b"one\ntwo\n")
    assert outputs.close() == {"screen": "<one>\n<two>\n"}


def test_a_line_without_end_does_not_grow_for_ever() -> None:
    buffer = LineBuffer()
    kept = b"x" * (LONGEST_LINE - 1)
    assert buffer.feed(kept) == b""
    assert buffer.feed(b"yz") == kept + b"yz\n"
    assert buffer.flush() == b""


@given(st.lists(st.binary(max_size=40)))
def test_cutting_into_lines_loses_and_adds_nothing(chunks: list[bytes]) -> None:
    buffer = LineBuffer()
    parts = [buffer.feed(chunk) for chunk in chunks]
    assert all(part == b"" or part.endswith(b"\n") for part in parts)
    whole = b"".join(chunks)
    assert b"".join(parts) + buffer.flush() == whole + (b"" if not whole or whole.endswith(b"\n") else b"\n")


def test_launch_lines_on_screen_and_in_the_file(tmp_path: Path) -> None:
    outputs = Outputs(tmp_path)
    outputs.log.log("INFO", "talker-1", "process started with pid [42]")
    outputs.log.log("DEBUG", "launch", "not without --debug")
    assert outputs.close() == {
        "launch.log": "T [INFO] [talker-1]: process started with pid [42]\n",
        "screen": "[INFO] [talker-1]: process started with pid [42]\n",
    }


def test_formats_can_be_overridden_as_in_launch(tmp_path: Path) -> None:
    formats = {
        "OVERRIDE_LAUNCH_SCREEN_FORMAT": r"\033[1m{levelname}\033[0m {name}|{msg}",
        "OVERRIDE_LAUNCH_LOG_FORMAT": "{name}: {message}",
    }
    outputs = Outputs(tmp_path, formats)
    outputs.log.log("ERROR", "launch", "50 % done")
    assert outputs.close() == {
        "launch.log": "launch: 50 % done\n",
        "screen": "\x1b[1mERROR\x1b[0m launch|50 % done\n",
    }


@pytest.mark.parametrize(
    "text", ["{levelname", "{nothing}", "%(message)s", "{levelno:>q}", "{message.x}", r"\x{message}"]
)
@pytest.mark.parametrize("variable", ["OVERRIDE_LAUNCH_SCREEN_FORMAT", "OVERRIDE_LAUNCH_LOG_FORMAT"])
def test_a_format_that_cannot_be_used_is_refused_before_anything_starts(
    variable: str, text: str, tmp_path: Path
) -> None:
    with pytest.raises(RuntimeFailure) as refused:
        Outputs(tmp_path, {variable: text})
    assert str(refused.value).startswith(f"{variable}={text!r} cannot be used: ")


def test_debug_lines_with_debug(tmp_path: Path) -> None:
    outputs = Outputs(tmp_path, debug=True)
    outputs.log.log("DEBUG", "launch", "detail")
    assert outputs.close()["screen"] == "[DEBUG] [launch]: detail\n"
