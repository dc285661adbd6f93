"""YAML text -> plain Python values, with the line of each mapping and list. Pure.

Values are those of ``yaml.safe_load``: libyaml reads the text where it reads the same, PyYAML's own scanner
the rest, so that the same files load with the same errors as upstream's. Anchors and aliases work; a text
whose aliases stand for an excessive number of values, or that nests excessively, is refused.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import yaml

MAX_NESTING = 250  # upstream's recursion ends at about this depth
MAX_EXPANDED_NODES = 4_000_000  # values in a document once each alias is written out

_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_CParser: Any = getattr(yaml, "CLoader", yaml.Loader)
# Where libyaml reads otherwise, found by fuzzing: trailing tab, lone tag, "?" in flow context, mark inside.
_LIBYAML_DIFFERS = re.compile(r"[\t!?\ufeff]")
# Surely no part of a text whose quotes end in the same line.
_COMMENT = re.compile(r"(?:^|\s)#[^'\"\n\r\x85\u2028\u2029]*$", re.MULTILINE)


class RefusedYaml(ValueError):
    """Well-formed, but made to exhaust memory or the stack."""


@dataclass(frozen=True, slots=True)
class YamlDocument:
    """``lines``: ``id`` of each mapping and list in ``root`` -> its line, counted from 1."""

    root: Any
    lines: dict[int, int] = field(repr=False)


def parse_yaml(text: str) -> YamlDocument:
    """Text -> its one document (``None`` when empty). Raises ``yaml.YAMLError`` or ``RefusedYaml``."""
    _refuse_deep_nesting(text)
    if not (_LIBYAML_DIFFERS.search(text) and _LIBYAML_DIFFERS.search(_COMMENT.sub("", text))):
        with contextlib.suppress(yaml.YAMLError):
            return _load(text, _SafeLoader)
    return _load(text, yaml.SafeLoader)


def _load(text: str, base: Any) -> YamlDocument:
    loader = _with_lines(base)(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return YamlDocument(None, {})
        if "*" in text and "&" in text:
            _refuse_many_aliases(node)
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


def _refuse_many_aliases(root: Any) -> None:
    """Count the nodes of the document with every alias written out; each distinct node is visited once."""
    sizes: dict[int, int] = {}
    pending = [root]
    while pending:
        node = pending[-1]
        parts = _parts(node)
        if id(node) not in sizes:
            sizes[id(node)] = _UNFINISHED
            pending += [part for part in parts if _is_unsized(part, sizes)]
            continue
        pending.pop()
        if sizes[id(node)] == _UNFINISHED:
            sizes[id(node)] = 1 + sum(sizes[id(part)] for part in parts)
    if sizes[id(root)] > MAX_EXPANDED_NODES:
        raise RefusedYaml(f"aliases stand for more than {MAX_EXPANDED_NODES} values")


_UNFINISHED = 0  # size of a node whose parts are being counted


def _is_unsized(node: Any, sizes: dict[int, int]) -> bool:
    size = sizes.get(id(node))
    if size == _UNFINISHED:
        raise RefusedYaml(f"a value contains itself: line {node.start_mark.line + 1}")
    return size is None


def _parts(node: Any) -> list[Any]:
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


def _refuse_deep_nesting(text: str) -> None:
    """Libyaml's loader would overflow the C stack; events are read without recursion."""
    # A block inside a block begins further to the right, a flow inside a flow after one more bracket.
    longest_line = max(map(len, text.splitlines()), default=0)
    if longest_line <= MAX_NESTING and text.count("[") + text.count("{") <= MAX_NESTING:
        return
    depth = 0
    try:
        for event in yaml.parse(text, Loader=_CParser):
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > MAX_NESTING:
                    raise RefusedYaml(f"values are nested more than {MAX_NESTING} deep")
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
    except yaml.YAMLError:
        pass  # the loader meets the same error and reports it
