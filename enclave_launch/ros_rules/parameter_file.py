"""Parameter files and values of ``-p`` as rcl reads them: what libyaml finds in, sections of parameters out.

rcl takes less than YAML has, and in places something else: several documents are one file; aliases are refused, so are
a value before ``ros__parameters``, a parameter without a value, a list of two types. No node starts that is given what
rcl refuses. Rules of ros2/rcl ``rcl_yaml_param_parser`` (``parse.c``, ``namespace.c``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

import yaml

from enclave_common.files import MEBIBYTE
from enclave_common.yaml_reader import LIBYAML_LOADER, MAX_NESTING
from enclave_launch.ros_rules.parameter_value import ParameterValue, Scalar, plain_scalar, type_slot

MAX_BYTES = 128 * MEBIBYTE  # of one parameter file

Section = Mapping[str, ParameterValue]

_PARAMETERS_KEY = "ros__parameters"  # a key that begins so counts, too
_TEXT_TAG = "tag:yaml.org,2002:str"
_KINDS = {
    yaml.ScalarEvent: "scalar",
    yaml.MappingStartEvent: "{",
    yaml.MappingEndEvent: "}",
    yaml.SequenceStartEvent: "[",
    yaml.SequenceEndEvent: "]",
    yaml.AliasEvent: "*",
}
_BEGINS, _ENDS = ("{", "["), ("}", "]")
_QUOTES = ("'", '"')
_LONGEST_TOKEN, _LONGEST_NODE_NAME = 244, 255


class RefusedParameters(ValueError):
    """An error of rcl's initialisation, in our words and with the line."""


@lru_cache(maxsize=256)
def sections_of_text(text: str) -> Mapping[str, Section]:
    """Return parameters by section name, later ones over earlier ones; raises ``RefusedParameters``, YAMLError."""
    reader = _FileReader()
    for kind, scalar, style, line in parts_of(text):
        reader.take(kind, scalar, style, line)
    return reader.sections()


def value_of_text(text: str) -> ParameterValue | None:
    """Return the value of ``-p NAME:=text``; None for a comment alone. Raises as ``sections_of_text``."""
    if not text:
        raise RefusedParameters("the value is missing")
    slots: _Slots = {}
    reader = _ValueReader()
    for kind, scalar, style, line in parts_of(text):
        if kind == "scalar":
            reader.take(slots, scalar, style, line)
        elif kind == "[":
            reader.begin_list()
        elif kind == "]":
            reader.end_list(slots)
        else:
            raise RefusedParameters("it must be a value or a list, not a mapping or an alias")
    return _first(slots) if slots else None


def parts_of(text: str) -> Iterator[tuple[str, str, str, int]]:
    """Yield kind, text, style and line of each event: ``scalar``, ``{`` and ``}``, ``[`` and ``]``, ``*`` for an alias.

    The style of a scalar that is tagged as text, and stands without quotes, is its tag.
    """
    loader = LIBYAML_LOADER(text)
    next_event, kind_of = loader.get_event, _KINDS.get
    depth = 0
    try:
        while True:  # until the end of the stream, which each text has
            event: Any = next_event()
            kind = kind_of(type(event))
            if kind == "scalar":
                tag, style = event.tag, event.style
                if tag is not None and tag == _TEXT_TAG and style not in _QUOTES:
                    style = tag
                yield kind, event.value, style, event.start_mark.line + 1
            elif kind:
                depth += (kind in _BEGINS) - (kind in _ENDS)
                if depth > MAX_NESTING:
                    raise RefusedParameters(
                        f"line {event.start_mark.line + 1}: nested more than {MAX_NESTING} deep"
                    )
                yield kind, "", "", event.start_mark.line + 1
            elif type(event) is yaml.StreamEndEvent:
                return
    finally:
        loader.dispose()


# What one parameter was given: a slot for each type, of which readers take the first.
_Slots = dict[int, Scalar | list[Scalar]]


def _first(slots: _Slots) -> ParameterValue:
    value = slots[min(slots)]
    return tuple(value) if isinstance(value, list) else value


class _ValueReader:
    def __init__(self) -> None:
        self.in_list = False
        self._type: type | None = None  # of the items so far
        self._list: tuple[_Slots, list[Scalar]] | None = None  # with the parameter that it is of

    def begin_list(self) -> None:
        self.in_list, self._type, self._list = True, None, None

    def end_list(self, slots: _Slots) -> None:
        if self.in_list and self._type is None:
            slots[type_slot(())] = []
        self.in_list = False

    def take(self, slots: _Slots, text: str, style: str, line: int) -> None:
        value = _scalar_of(text, style, line)
        if not self.in_list:
            slots[type_slot(value)] = value
        elif self._type is None:
            self._type = type(value)
            items = [value]
            slots[type_slot((value,))] = items
            self._list = slots, items
        elif self._list is not None and self._list[0] is slots and self._type is type(value):
            self._list[1].append(value)
        else:
            known = slots.get(type_slot((value,)))
            if self._type is not type(value) or not isinstance(known, list):
                raise _refused(line, "the items of a list must be of one type")
            known.append(value)


class _Path:
    def __init__(self, separator: str) -> None:
        self._separator = separator
        self.text = ""
        self.count = 0

    def add(self, name: str) -> None:
        joined = not self.count or self.text.endswith(self._separator)
        self.text = (self.text if self.count else "") + ("" if joined else self._separator) + name
        self.count += 1

    def drop(self) -> None:
        if self.count > 1:
            before, found, _ = self.text.rpartition(self._separator)
            self.text = before if found else self.text
        self.count = max(0, self.count - 1)


class _Section:
    def __init__(self) -> None:
        self.names: list[str] = []
        self.slots: list[_Slots] = []
        self._index: dict[str, int] = {}

    def find(self, name: str) -> int:
        """Return the index of ``name``, added if it is new."""
        at = self._index.get(name)
        if at is None:
            at = self._index[name] = len(self.names)
            self.names.append(name)
            self.slots.append({})
        return at

    def rename(self, at: int, name: str) -> None:
        self._index.pop(self.names[at], None)
        self.names[at] = name
        self._index.setdefault(name, at)

    def read(self) -> Section:
        return {name: _first(slots) for name, slots in zip(self.names, self.slots, strict=True) if slots}


class _FileReader:
    def __init__(self) -> None:
        self._sections: dict[str, _Section] = {}
        self._section = _Section()  # in turn
        self._at = 0  # the parameter that was named last
        self._node, self._group = _Path("/"), _Path(".")
        self._below_parameters_key = False
        self._depth = 0
        self._key_is_next = True
        self._mapping_began = False
        self._values = _ValueReader()

    def sections(self) -> Mapping[str, Section]:
        return {name: section.read() for name, section in self._sections.items()}

    def take(self, kind: str, text: str, style: str, line: int) -> None:
        """Take the next event of the YAML parser; raises ``RefusedParameters``."""
        if kind == "scalar":
            if self._key_is_next:
                self._take_key(text, line)
            elif self._values.in_list and self._section.names:
                self._values.take(self._section.slots[self._at], text, style, line)
            else:
                self._take_value(text, style, line)
        elif kind == "[":
            if self._key_is_next:
                raise _refused(line, "a list cannot be a key")
            if not self._below_parameters_key:
                raise _too_early(line)
            self._values.begin_list()
        elif kind == "]":
            self._values.end_list(self._section.slots[self._at] if self._section.slots else {})
            self._key_is_next = True
        elif kind == "{":
            self._begin_mapping()
        elif kind == "}":
            self._end_mapping()
        else:
            raise _refused(line, "rcl does not take aliases")

    def _begin_mapping(self) -> None:
        self._depth += 1
        self._key_is_next = True
        of_parameters = self._below_parameters_key and self._depth == self._node.count + 3
        self._mapping_began = not of_parameters

    def _end_mapping(self) -> None:
        if not self._below_parameters_key:
            if self._depth == self._node.count + 1:
                self._node.drop()
        elif self._group.count:
            self._group.drop()
        else:
            self._below_parameters_key = False
        self._depth -= 1

    def _take_key(self, text: str, line: int) -> None:
        if not text:
            raise _refused(line, "a key is empty")
        if self._below_parameters_key:
            self._name_parameter(text, line)
        elif text.startswith(_PARAMETERS_KEY):
            self._begin_section(text, line)
        else:
            self._node.add(text)
        self._key_is_next = False

    def _begin_section(self, text: str, line: int) -> None:
        if not self._node.count:
            raise _refused(line, f"no node is named before {_PARAMETERS_KEY}")
        name = self._node.text
        if why := _why_no_section(name):
            raise _refused(line, f"{name!r} names no node: {why}")
        self._section = self._sections.setdefault(name, _Section())
        self._node.drop()
        self._below_parameters_key = True

    def _name_parameter(self, text: str, line: int) -> None:
        if self._mapping_began:
            if self._at >= len(self._section.names):
                raise _refused(line, "a mapping where a parameter or a node name is expected")
            self._group.text, self._group.count = self._section.names[self._at], self._group.count + 1
            self._mapping_began = False
        if not self._group.count:
            self._at = self._section.find(text)
            return
        self._at = self._section.find(self._group.text)
        self._section.rename(self._at, f"{self._group.text}.{text}")

    def _take_value(self, text: str, style: str, line: int) -> None:
        if not self._below_parameters_key or not self._section.names:
            raise _too_early(line)
        self._values.take(self._section.slots[self._at], text, style, line)
        self._key_is_next = not self._values.in_list


def _scalar_of(text: str, style: str, line: int) -> Scalar:
    quoted = style in _QUOTES
    if not quoted and not text:
        raise _refused(line, "a parameter has no value")
    return text if quoted or style == _TEXT_TAG else plain_scalar(text)


def _why_no_section(name: str) -> str:
    """Return why rcl does not take the name; empty for tokens of a full name, or wildcards for them."""
    if name.endswith("/"):
        return "the name of the node is empty"
    namespace, _, node = name.rpartition("/")
    tokens = namespace.removeprefix("/").split("/") if namespace.strip("/") else []
    if "//" in name:
        return "it contains '//'"
    if not _is_token(node, _LONGEST_NODE_NAME) or not all(
        _is_token(token, _LONGEST_TOKEN) for token in tokens
    ):
        return "a token is letters, digits and '_', without a digit in front, or '*' or '**'"
    return ""


def _is_token(text: str, longest: int) -> bool:
    return text in ("*", "**") or (text.isascii() and text.isidentifier() and len(text) <= longest)


def _too_early(line: int) -> RefusedParameters:
    return _refused(line, f"a value stands before {_PARAMETERS_KEY}")


def _refused(line: int, why: str) -> RefusedParameters:
    return RefusedParameters(f"line {line}: {why}")
