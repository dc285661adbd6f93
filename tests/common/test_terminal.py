"""What a terminal is given of text that others chose."""

from __future__ import annotations

import io
import json
import sys
from contextlib import redirect_stdout

import pytest
from hypothesis import given
from hypothesis import strategies as st

from enclave_common.terminal import json_text, printable, printable_lines, quoted, safe_output

UNSAFE = {
    "escape sequence": ("\x1b[31m", "\\x1b[31m"),
    "window title": ("\x1b]0;x\x07", "\\x1b]0;x\\x07"),
    "8-bit control sequence introducer": ("\x9b31m", "\\x9b31m"),
    "delete": ("\x7f", "\\x7f"),
    "carriage return": ("good\rbad", "good\\rbad"),
    "right-to-left override": ("\u202egpj", "\\u202egpj"),
    "zero-width space": ("a\u200bb", "a\\u200bb"),
    "byte that is not UTF-8": ("a\udcffb", "a\\udcffb"),
}


@pytest.mark.parametrize(("text", "shown"), UNSAFE.values(), ids=UNSAFE.keys())
def test_what_moves_or_hides_is_escaped(text: str, shown: str) -> None:
    assert printable(text) == printable_lines(text) == shown


@pytest.mark.parametrize("text", ["/front/camera", "Größe", "日本語", "a b\\c", ""])
def test_readable_text_stays(text: str) -> None:
    assert printable(text) == printable_lines(text) == text


def test_a_name_cannot_begin_a_new_line_but_a_report_may() -> None:
    assert printable("talker\n0 findings: good") == "talker\\n0 findings: good"
    assert printable_lines("one\n\ttwo") == "one\n\ttwo"


def test_quotes_around_a_name_cannot_be_left_by_the_name() -> None:
    assert quoted("a") == "'a'"
    assert quoted("a' is good, 'b") == "\"a' is good, 'b\""
    assert quoted("\x1b") == "'\\x1b'"


@given(st.text())
def test_nothing_unprintable_passes(text: str) -> None:
    assert printable(text).isprintable() and quoted(text).isprintable()
    assert printable_lines(text).replace("\n", "").replace("\t", "").isprintable()


@given(st.recursive(st.text(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)))
def test_json_is_readable_and_still_the_same_value(value: object) -> None:
    text = json_text(value)
    assert text.isprintable()
    assert json.loads(text) == value


def test_json_keeps_readable_characters() -> None:
    assert json_text({"name": "Größe\x7f\x9b\U000e0001"}) == '{"name": "Größe\\u007f\\u009b\\udb40\\udc01"}'


def test_whatever_python_code_prints_is_safe_within_the_block(capsys: pytest.CaptureFixture[str]) -> None:
    with safe_output(), safe_output():
        print("\x1b[2Jone\ntwo")
        print("\x1b]0;title\x07", file=sys.stderr)
    print("\x1b after")
    assert capsys.readouterr() == ("\\x1b[2Jone\ntwo\n\x1b after\n", "\\x1b]0;title\\x07\n")


def test_a_terminal_that_knows_no_unicode_gets_escapes_and_no_error() -> None:
    ascii_only = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    with redirect_stdout(ascii_only), safe_output():
        print("├── ö")
    ascii_only.seek(0)
    assert ascii_only.read() == "\\u251c\\u2500\\u2500 \\xf6\n"
