"""rcl_interfaces/msg/ParameterEvent as it was published, read without ROS."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from hypothesis import given
from hypothesis import strategies as st

from enclave_addons.recording.record.lines import declared_values

Value = bool | int | float | str | list[str]


class Writer:
    """CDR as the specification has it; ``order`` as of struct."""

    def __init__(self, order: str) -> None:
        self.order, self.data = order, b""

    def number(self, form: str, value: float) -> None:
        size = struct.calcsize(form)
        self.data += b"\0" * (-len(self.data) % size) + struct.pack(self.order + form, value)

    def text(self, text: str) -> None:
        encoded = text.encode() + b"\0"
        self.number("I", len(encoded))
        self.data += encoded

    def value(self, value: Value) -> None:
        kinds = {bool: 1, int: 2, float: 3, str: 4, list: 9}
        self.number("B", kinds[type(value)])
        self.number("B", value is True)
        self.number("q", value if type(value) is int else 0)
        self.number("d", value if isinstance(value, float) else 0)
        self.text(value if isinstance(value, str) else "")
        for form in "BBqd":
            self.number("I", 1)
            self.number(form, 1)
        entries = value if isinstance(value, list) else []
        self.number("I", len(entries))
        for entry in entries:
            self.text(entry)


def event(declared: Mapping[str, Value], order: str = "<") -> bytes:
    writer = Writer(order)
    writer.number("i", 12)
    writer.number("I", 34)
    writer.text("/a/node")
    writer.number("I", len(declared))
    for name, value in declared.items():
        writer.text(name)
        writer.value(value)
    writer.number("I", 0)  # changed
    writer.number("I", 0)  # deleted
    return (b"\0\1" if order == "<" else b"\0\0") + b"\0\0" + writer.data


TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
VALUES = st.one_of(
    TEXTS, st.lists(TEXTS, max_size=3), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(width=64)
)


@given(st.dictionaries(TEXTS, VALUES, max_size=5), st.sampled_from("<>"))
def test_texts_integers_and_lists_of_texts_are_read_and_other_values_passed_over(
    declared: dict[str, Value], order: str
) -> None:
    expected = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in declared.items()
        if isinstance(value, str | int | list) and not isinstance(value, bool)
    }
    assert declared_values(event(declared, order)) == expected


@given(st.dictionaries(TEXTS, VALUES, min_size=1, max_size=3), st.data())
def test_of_an_event_that_was_cut_the_parameters_before_are_read(
    declared: dict[str, Value], data: st.DataObject
) -> None:
    whole = event(declared)
    cut = whole[: data.draw(st.integers(0, len(whole)))]
    assert declared_values(cut).items() <= declared_values(whole).items()


@given(st.binary(max_size=200))
def test_no_bytes_are_an_error(data: bytes) -> None:
    declared_values(b"\0\1\0\0" + data)


def test_a_value_that_is_too_long_for_a_name_is_passed_over() -> None:
    assert declared_values(event({"robot_description": "x" * 300, "topic": "scan"})) == {"topic": "scan"}


def test_another_way_of_writing_is_not_guessed_at() -> None:
    assert declared_values(b"\0\7" + event({"topic": "scan"})[2:]) == {}
