"""The values in a rcl_interfaces/msg/ParameterEvent, as it goes over the wire, that could be in a name.

Classic CDR (DDSI-RTPS, 10.2): each number stands at a multiple of its size, counted behind the four bytes that say how
the rest is written; texts and lists have their length before them.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

_LONGEST_NAME = 255  # of a ROS name; a longer value is none
_INTEGER, _STRING, _STRING_LIST = 2, 4, 9  # rcl_interfaces/msg/ParameterType


def declared_values(event: bytes) -> Mapping[str, object]:
    """Return by name the declared parameters that hold a text, an integer or a list of texts."""
    found: dict[str, object] = {}
    if event[:2] not in (b"\0\0", b"\0\1"):
        return found
    cursor = _Cursor(event[4:], "<" if event[1] else ">")
    try:
        cursor.number("I"), cursor.number("I"), cursor.text()  # time and node
        for _ in range(cursor.number("I")):
            name, value = cursor.text(), cursor.value()
            if value is not None:
                found[name] = value
    except (struct.error, UnicodeDecodeError):
        pass
    return found


class _Cursor:
    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order, self._place = data, order, 0

    def number(self, form: str) -> int:
        size = struct.calcsize(form)
        self._place += -self._place % size
        (value,) = struct.unpack_from(self._order + form, self._data, self._place)
        self._place += size
        return int(value)

    def text(self) -> str:
        length = self.number("I")
        if self._place + length > len(self._data):
            raise struct.error("cut")
        text = self._data[self._place : self._place + length]
        self._place += length
        return text.rstrip(b"\0").decode()

    def value(self) -> object:
        """Read a rcl_interfaces/msg/ParameterValue: all its fields are there, whichever counts."""
        kind, _, integer, _ = self.number("B"), self.number("B"), self.number("q"), self.number("Q")
        text = self.text()
        for form in "BBQQ":
            self._skip_list(form)
        texts = tuple(self.text() for _ in range(self.number("I")))
        if kind == _STRING and len(text) <= _LONGEST_NAME:
            return text
        return {_INTEGER: integer, _STRING_LIST: texts}.get(kind)

    def _skip_list(self, form: str) -> None:
        for _ in range(self.number("I")):
            self.number(form)
