"""Colours are for terminals: what is written to a file or a pipe is plain."""

from __future__ import annotations

import io
import sys
import time

import pytest

from enclave_common.colour import coloured, wants_colour
from enclave_common.terminal import choose_colour, safe_output

RED, CYAN, BLUE = "\x1b[1;31m", "\x1b[36m", "\x1b[34m"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("text", "part", "code"),
    [
        ("secure-launch: error: no such file", "error", RED),
        ("exposure: private/: others may read it", "exposure", RED),
        ("├── enclave /front/camera", "/front/camera", CYAN),
        ("demo.launch.xml:12: <node> no such program", "demo.launch.xml:12", BLUE),
    ],
)
def test_severity_enclave_and_place_have_a_colour(text: str, part: str, code: str) -> None:
    assert coloured(text) == text.replace(part, f"{code}{part}\x1b[0m")


@pytest.mark.parametrize(
    "text", ["[talker-1] error: of a node", "no error here", "error_count 3", "/scan", "a 3:12"]
)
def test_other_words_have_none(text: str) -> None:
    assert coloured(text) == text


def test_a_terminal_has_colours_unless_they_are_unwanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert wants_colour("auto", Terminal()) and not wants_colour("auto", io.StringIO())
    assert wants_colour("always", io.StringIO()) and not wants_colour("never", Terminal())
    monkeypatch.setenv("NO_COLOR", "1")
    assert not wants_colour("auto", Terminal()) and wants_colour("always", Terminal())


def test_an_escape_of_others_is_not_taken_for_a_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", shown := Terminal())
    with safe_output():
        choose_colour("always")
        print("error: \x1b[32mgood")
        choose_colour("never")
        print("error: plain")
    assert shown.getvalue() == f"{RED}error\x1b[0m: \\x1b[32mgood\nerror: plain\n"


@pytest.mark.parametrize("piece", ["a", "x/", "a.py:", "enclave ", "/"])
def test_long_lines_take_time_in_proportion(piece: str) -> None:
    started = time.process_time()
    coloured(piece * 100_000)
    assert time.process_time() - started < 5
