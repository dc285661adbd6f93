"""YAML text -> plain Python values, with the line of each mapping and list. Pure.

Values are those of ``yaml.safe_load``: libyaml reads the text where it reads the same, PyYAML's own scanner
the rest, so that the same files load with the same errors as upstream's. Anchors and aliases work; a text
whose aliases stand for an excessive number of values, or that nests excessively, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import suppress

import yaml

from enclave_launch.boundary.light import Any, NamedTuple, late_pattern
from enclave_launch.boundary.yaml_nodes import (
    RefusedYaml,
    SafeLoader,
    may_have_aliases,
    refuse_deep_nesting,
    refuse_many_aliases,
)
from enclave_launch.frontend.yaml_scalar import UNDECIDED, plain

MAX_CHARACTERS = 8_000_000  # libyaml and PyYAML together take some ten seconds for each million
MAX_SLOW_CHARACTERS = 500_000  # of a text that only PyYAML's own scanner can read, at a third of that speed

# Where libyaml reads otherwise, found by fuzzing: trailing tab, lone tag, "?" in flow context, mark inside.
_LIBYAML_DIFFERS = ("\t", "!", "?", "\ufeff")
# Surely no part of a text whose quotes end in the same line.
_COMMENT = late_pattern(r"(?<!\S)#[^'\"\n\r\x85\u2028\u2029]*$", re.MULTILINE)


class YamlDocument(NamedTuple):
    """``lines``: ``id`` of each mapping and list in ``root`` -> its line, counted from 1."""

    root: Any
    lines: dict[int, int]


def parse_yaml(text: str) -> YamlDocument:
    """Text -> its one document (``None`` when empty). Raises ``yaml.YAMLError`` or ``RefusedYaml``."""
    if len(text) > MAX_CHARACTERS:
        raise RefusedYaml(f"the text has more than {MAX_CHARACTERS} characters")
    refuse_deep_nesting(text)
    if libyaml_reads_alike(text):
        try:
            return _load(text, SafeLoader)
        except RefusedYaml:
            raise
        except yaml.YAMLError:
            if len(text) > MAX_SLOW_CHARACTERS:
                raise
    if len(text) > MAX_SLOW_CHARACTERS:
        raise RefusedYaml(
            f"a text with tabs, '!' or '?' outside of comments has more than {MAX_SLOW_CHARACTERS} characters"
        )
    return _load(text, yaml.SafeLoader)


def values_of_yaml(text: str) -> Any:
    """As ``parse_yaml``, the values alone."""
    if len(text) <= MAX_SLOW_CHARACTERS and libyaml_reads_alike(text):
        refuse_deep_nesting(text)
        with suppress(Exception):  # what only nodes give, and errors
            return values_of(text, SafeLoader)
    return parse_yaml(text).root


def libyaml_reads_alike(text: str) -> bool:
    """Whether libyaml, where it accepts ``text``, reads the same as PyYAML's own scanner."""
    return not _may_differ(text) or not _may_differ(_COMMENT.sub("", text))


def _may_differ(text: str) -> bool:
    return any(mark in text for mark in _LIBYAML_DIFFERS)


def _load(text: str, base: Any) -> YamlDocument:
    loader = _with_lines(base)(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return YamlDocument(None, {})
        if may_have_aliases(text):
            refuse_many_aliases(node)
        return YamlDocument(loader.construct_document(node), loader.lines)
    finally:
        loader.dispose()


def _with_lines(base: Any) -> Any:
    """Subclass of a safe loader that notes where mappings and lists begin."""
    known = _loaders.get(base)
    if known is not None:
        return known

    class LoaderWithLines(base):  # type: ignore[misc]
        def __init__(self, text: str):
            super().__init__(text)
            self.lines: dict[int, int] = {}

        def construct_yaml_map(self, node: Any) -> Generator[dict[Any, Any], None, None]:
            for data in super().construct_yaml_map(node):
                self.lines[id(data)] = node.start_mark.line + 1
                yield data

        def construct_yaml_seq(self, node: Any) -> Generator[list[Any], None, None]:
            for data in super().construct_yaml_seq(node):
                self.lines[id(data)] = node.start_mark.line + 1
                yield data

    LoaderWithLines.add_constructor("tag:yaml.org,2002:map", LoaderWithLines.construct_yaml_map)
    LoaderWithLines.add_constructor("tag:yaml.org,2002:seq", LoaderWithLines.construct_yaml_seq)
    _loaders[base] = LoaderWithLines
    return LoaderWithLines


_loaders: dict[Any, Any] = {}


class NeedsNodes(ValueError):
    """What only PyYAML's nodes give, or an error that it words."""


def values_of(text: str, loader: Any) -> Any:
    """What ``loader``, one of PyYAML's own as shipped, gives for ``text``, from its events in one pass.

    PyYAML makes a node of each event, tries its patterns on each scalar and runs a generator for each collection.
    Documents without anchors, tags and merged mappings, which nearly all are, need none of that. Raises
    ``NeedsNodes``, ``TypeError`` or ``yaml.YAMLError`` for the others, and where PyYAML words an error.
    """
    reader = loader(text)
    try:
        return _Values(reader).document()
    finally:
        reader.dispose()


class _Values:
    def __init__(self, loader: Any) -> None:
        self._loader = loader
        self._next = loader.get_event
        self._plain: dict[str, Any] = {}  # scalars met

    def document(self) -> Any:
        self._next()  # the stream starts
        if type(self._next()) is yaml.StreamEndEvent:
            return None
        value = self._value(self._next())
        self._next()  # the document ends
        if type(self._next()) is not yaml.StreamEndEvent:
            raise NeedsNodes("several documents")
        return value

    def _value(self, event: Any) -> Any:
        kind = type(event)
        if event.anchor is not None or event.tag is not None:
            raise NeedsNodes("an anchor, an alias or a tag")
        if kind is yaml.ScalarEvent:
            text: str = event.value
            if not event.implicit[0]:
                return text
            if text not in self._plain:
                self._plain[text] = self._plain_value(text)
            return self._plain[text]
        if kind is yaml.SequenceStartEvent:
            items = []
            while type(event := self._next()) is not yaml.SequenceEndEvent:
                items.append(self._value(event))
            return items
        found = {}
        while type(event := self._next()) is not yaml.MappingEndEvent:
            key = self._value(event)
            found[key] = self._value(self._next())
        return found

    def _plain_value(self, text: str) -> Any:
        value = plain(text)
        if value is not UNDECIDED:
            return value
        tag = self._loader.resolve(yaml.ScalarNode, text, (True, False))
        return self._loader.construct_object(yaml.ScalarNode(tag, text))
