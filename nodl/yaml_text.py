"""Parse YAML (or JSON) into plain values that know their line; duplicate keys are errors, aliases are limited."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import yaml

from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from enclave_common.yaml_reader import compose_yaml, construct, line_of
from nodl.errors import InvalidYAMLError

MAX_BYTES = 1_000_000
MAX_NODES = 100_000
MAX_DEPTH = 40
_MAX_SCALAR = 20_000
_MERGE_TAG = "tag:yaml.org,2002:merge"
_SCALAR_TAGS = frozenset(f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float", "bool", "null"))


Scalar = str | int | float | bool | None


class YamlScalar(NamedTuple):
    """A scalar with its place."""

    value: Scalar
    source: SourceLocation


class YamlList(NamedTuple):
    """A sequence, and where it is written."""

    items: tuple[YamlValue, ...]
    source: SourceLocation


class YamlMap(NamedTuple):
    """A mapping with its place. ``items`` in document order; ``keys`` says where each key is written."""

    items: dict[str, YamlValue]
    keys: dict[str, SourceLocation]
    source: SourceLocation

    def scalar(self, key: str) -> Scalar:
        """Return the value under ``key``, None if there is none or it is a mapping or list."""
        found = self.items.get(key)
        return found.value if isinstance(found, YamlScalar) else None

    def text(self, key: str) -> str:
        """Return the text under ``key``, empty if there is none."""
        found = self.scalar(key)
        return found if isinstance(found, str) else ""

    def mapping(self, key: str) -> YamlMap:
        """Return the mapping under ``key``, an empty one if there is none."""
        found = self.items.get(key)
        return found if isinstance(found, YamlMap) else YamlMap({}, {}, self.source)

    def listed(self, key: str) -> tuple[YamlValue, ...]:
        """Return the elements of the list under ``key``, none if there is none."""
        found = self.items.get(key)
        return found.items if isinstance(found, YamlList) else ()

    def mappings(self, key: str) -> Iterator[YamlMap]:
        """Yield the elements of the list under ``key`` that are mappings."""
        return (each for each in self.listed(key) if isinstance(each, YamlMap))

    def texts(self, key: str) -> tuple[str, ...]:
        """Return the scalars in the list under ``key`` as text."""
        return tuple(str(each.value) for each in self.listed(key) if isinstance(each, YamlScalar))


YamlValue = YamlScalar | YamlList | YamlMap


def plain(value: YamlValue) -> object:
    """Return the value without its places."""
    if isinstance(value, YamlScalar):
        return value.value
    if isinstance(value, YamlList):
        return [plain(item) for item in value.items]
    return {name: plain(item) for name, item in value.items.items()}


def parse_yaml(text: bytes, file: str, *, last_counts: bool = False) -> YamlValue:
    """Parse one document; a key given twice is refused unless the ``last_counts``. Raises ``InvalidYAMLError``."""
    if len(text) > MAX_BYTES:
        raise InvalidYAMLError.at(SourceLocation(file), f"larger than the allowed {MAX_BYTES} bytes")
    try:
        root = compose_yaml(text.decode("utf-8"))
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 0
        raise InvalidYAMLError.at(
            SourceLocation(file, line), f"not well-formed YAML: {error.problem}"
        ) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InvalidYAMLError.at(SourceLocation(file), f"not readable as YAML: {error}") from None
    if root is None:
        raise InvalidYAMLError.at(SourceLocation(file), "the document is empty")
    return _Builder(file, last_counts).build(root, 0)


class _Builder:
    def __init__(self, file: str, last_counts: bool):
        self._file, self._last_counts = file, last_counts
        self._nodes = 0

    def build(self, node: yaml.Node, depth: int) -> YamlValue:
        source = self._at(node)
        self._nodes += 1
        if self._nodes > MAX_NODES or depth > MAX_DEPTH:
            raise InvalidYAMLError.at(source, "the document unfolds too far (aliases or nesting)")
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, source, depth)
        if isinstance(node, yaml.SequenceNode):
            return YamlList(tuple(self.build(child, depth + 1) for child in node.value), source)
        assert isinstance(node, yaml.ScalarNode)  # a node is one of three
        return self._scalar(node, source)

    def _mapping(self, node: yaml.MappingNode, source: SourceLocation, depth: int) -> YamlMap:
        result = YamlMap({}, {}, source)
        merged: list[YamlMap] = []
        for key_node, value_node in node.value:
            value = self.build(value_node, depth + 1)
            if key_node.tag == _MERGE_TAG:
                merged.extend(self._merged(value))
                continue
            key = self._key(key_node)
            if key in result.items and not self._last_counts:
                raise InvalidYAMLError.at(
                    self._at(key_node),
                    f"key {quoted(key)} is given twice, first on line {result.keys[key].line}",
                )
            result.items[key] = value
            result.keys[key] = self._at(key_node)
        for other in merged:
            for key, value in other.items.items():
                if key not in result.items:
                    result.items[key], result.keys[key] = value, other.keys[key]
        return result

    def _merged(self, value: YamlValue) -> list[YamlMap]:
        maps = value.items if isinstance(value, YamlList) else (value,)
        found = [each for each in maps if isinstance(each, YamlMap)]
        if len(found) != len(maps):
            raise InvalidYAMLError.at(value.source, "'<<' can only merge mappings")
        return found

    def _key(self, node: yaml.Node) -> str:
        value = self.build(node, 0)
        if not isinstance(value, YamlScalar) or not isinstance(value.value, str):
            raise InvalidYAMLError.at(value.source, "a key must be text")
        return value.value

    def _scalar(self, node: yaml.ScalarNode, source: SourceLocation) -> YamlScalar:
        text = str(node.value)
        if len(text) > _MAX_SCALAR:
            raise InvalidYAMLError.at(source, f"a value is longer than {_MAX_SCALAR} characters")
        if node.tag == "tag:yaml.org,2002:timestamp":
            return YamlScalar(text, source)
        if node.tag not in _SCALAR_TAGS:
            raise InvalidYAMLError.at(source, f"tag {quoted(node.tag)} is not allowed")
        try:
            return YamlScalar(construct(node), source)
        except (ValueError, OverflowError, yaml.YAMLError):
            raise InvalidYAMLError.at(source, f"{quoted(text[:40])} is not a number we can read") from None

    def _at(self, node: yaml.Node) -> SourceLocation:
        return SourceLocation(self._file, line_of(node))
