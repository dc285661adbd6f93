"""Read YAML of unknown origin, with line numbers and within limits.

PyYAML composes and constructs, so the values and the errors are those of ``yaml.safe_load``. libyaml, which comes with
PyYAML, scans every text that it reads as PyYAML's own scanner does.

Limited are the length of a text, the depth of its values (libyaml's loader recurses in C, where depth ends the
process), what its aliases stand for (a few lines can stand for billions of values), and integers to base 60 (which
PyYAML computes in quadratic time).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from typing import Any, NamedTuple, TypeVar

import yaml
from yaml.constructor import SafeConstructor

MAX_CHARACTERS = (
    8_000_000  # libyaml and PyYAML together take some ten seconds for a dense text of this length
)
MAX_NESTING = 250  # the recursion of PyYAML, and of launch, ends at about this depth
FREE_EXPANSION = 10_000  # values that aliases may stand for in any document, and
EXPANSION_FACTOR = 20  # how many times its written values a document may stand for beyond that
MAX_BASE_60 = 1_000  # characters of an integer such as 1:30:00
_MAX_READ_AGAIN = 500_000  # characters of a text that PyYAML's own scanner reads for the words of an error

LIBYAML_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# Where libyaml reads otherwise, found by fuzzing: trailing tab, lone tag, "?" in flow context, mark inside.
_LIBYAML_DIFFERS = ("\t", "!", "?", "\ufeff")
# Surely no part of a text whose quotes end in the same line.
_COMMENT = re.compile(r"(?<!\S)#[^'\"\n\r\x85\u2028\u2029]*$", re.MULTILINE)

_Read = TypeVar("_Read")


class RefusedYaml(yaml.YAMLError):
    """Well-formed, but made to exhaust memory, time or the stack."""


class YamlDocument(NamedTuple):
    """A composed YAML document. ``lines``: ``id`` of each mapping and list in ``root`` -> its line, counted from 1."""

    root: Any
    lines: dict[int, int]


def load_yaml(text: str, limit: int = MAX_CHARACTERS) -> Any:
    """Return what ``yaml.safe_load`` gives; raises YAMLError, ``RefusedYaml``, ValueError and OverflowError."""
    return load_yaml_with_lines(text, limit).root


def load_yaml_with_lines(text: str, limit: int = MAX_CHARACTERS) -> YamlDocument:
    """Load as ``load_yaml``, and note the line of each mapping and list."""
    return _read(text, limit, _document)


def load_strict_yaml(text: str) -> YamlDocument:
    """Load a document that a person wrote for us. It has no aliases, and no key twice: only one would count.

    Raises:
        YAMLError: as ``load_yaml``, and ``MarkedYAMLError`` with the place of an alias or of a repeated key.
        ValueError, OverflowError: as ``load_yaml``.
    """

    def document(node: yaml.Node | None) -> YamlDocument:
        _refuse_aliases_and_repeated_keys(node)
        return _document(node)

    return _read(text, MAX_CHARACTERS, document)


def _document(node: yaml.Node | None) -> YamlDocument:
    constructor = _Constructor()
    root = None if node is None else constructor.construct_document(node)
    return YamlDocument(root, constructor.lines)


def problem_of(error: yaml.YAMLError, file: str) -> str:
    """Return ``file:line: what is wrong``, on one line."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
    return f"{file}{f':{mark.line + 1}' if mark else ''}: {problem or str(error) or 'not YAML'}"


def compose_yaml(text: str) -> yaml.Node | None:
    """Return the root node of the one document in ``text``, None without one; raises YAMLError and ``RefusedYaml``."""
    return _read(text, MAX_CHARACTERS, lambda node: node)


def construct(node: yaml.Node) -> Any:
    """Return the value of a composed node by the rules of YAML 1.1. Raises as ``load_yaml``."""
    return _Constructor().construct_document(node)


def line_of(node: yaml.Node) -> int:
    """Return the line of a node, counted from 1."""
    return int(node.start_mark.line) + 1


def libyaml_reads_alike(text: str) -> bool:
    """Return True if libyaml, where it accepts ``text``, reads the same as PyYAML's own scanner."""
    return not _may_differ(text) or not _may_differ(_COMMENT.sub("", text))


def refuse_deep_nesting(text: str) -> None:
    """Raise ``RefusedYaml`` for more than ``MAX_NESTING`` levels. Reads events, which takes no recursion."""
    if not _may_be_deep(text):
        return
    depth = 0
    try:
        for event in yaml.parse(text, Loader=LIBYAML_LOADER):
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > MAX_NESTING:
                    raise RefusedYaml(f"values are nested more than {MAX_NESTING} deep")
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
    except RefusedYaml:
        raise
    except yaml.YAMLError:
        pass  # the loader meets the same error and reports it


def _read(text: str, limit: int, use: Callable[[yaml.Node | None], _Read]) -> _Read:
    if len(text) > limit:
        raise RefusedYaml(f"the text has more than {limit} characters")
    refuse_deep_nesting(text)
    if libyaml_reads_alike(text):
        try:
            return use(_compose(text, LIBYAML_LOADER))
        except RefusedYaml:
            raise
        except yaml.YAMLError:
            if len(text) > _MAX_READ_AGAIN:
                raise
    return use(_compose(text, yaml.SafeLoader))


def _compose(text: str, loader: Any) -> yaml.Node | None:
    node: yaml.Node | None = yaml.compose(text, Loader=loader)
    if node is not None and "&" in text and "*" in text:
        _refuse_many_aliases(node)
    return node


def _may_differ(text: str) -> bool:
    return any(mark in text for mark in _LIBYAML_DIFFERS)


class _Constructor(SafeConstructor):
    def __init__(self) -> None:
        super().__init__()
        self.lines: dict[int, int] = {}

    def construct_yaml_map(self, node: Any) -> Generator[dict[Any, Any], None, None]:
        for data in super().construct_yaml_map(node):
            self.lines[id(data)] = line_of(node)
            yield data

    def construct_yaml_seq(self, node: Any) -> Generator[list[Any], None, None]:
        for data in super().construct_yaml_seq(node):
            self.lines[id(data)] = line_of(node)
            yield data

    def construct_yaml_int(self, node: Any) -> int:
        if len(node.value) > MAX_BASE_60 and ":" in node.value:
            raise RefusedYaml(
                f"line {line_of(node)}: an integer to base 60 has more than {MAX_BASE_60} characters"
            )
        return int(super().construct_yaml_int(node))


for _kind in ("map", "seq", "int"):
    _Constructor.add_constructor(
        f"tag:yaml.org,2002:{_kind}", getattr(_Constructor, f"construct_yaml_{_kind}")
    )


def _may_be_deep(text: str) -> bool:
    """Return False if no value can be nested deep: each level takes a column or a bracket."""
    longest_line = max(map(len, text.splitlines()), default=0)
    return longest_line > MAX_NESTING or text.count("[") + text.count("{") > MAX_NESTING


def _refuse_many_aliases(root: yaml.Node) -> None:
    """Raise ``RefusedYaml`` when the values below ``root``, with every alias written out, are too many."""
    sizes: dict[int, int] = {}
    pending = [root]
    while pending:
        node = pending[-1]
        if id(node) not in sizes:
            sizes[id(node)] = _UNFINISHED
            pending += [part for part in _parts(node) if _is_unsized(part, sizes)]
            continue
        pending.pop()
        if sizes[id(node)] == _UNFINISHED:
            sizes[id(node)] = 1 + sum(sizes[id(part)] for part in _parts(node))
    allowed = FREE_EXPANSION + EXPANSION_FACTOR * len(sizes)
    if sizes[id(root)] > allowed:
        raise RefusedYaml(f"aliases stand for more than {allowed} values")


_UNFINISHED = 0  # size of a node whose parts are being counted


def _is_unsized(node: yaml.Node, sizes: dict[int, int]) -> bool:
    size = sizes.get(id(node))
    if size == _UNFINISHED:
        raise RefusedYaml(f"a value contains itself: line {line_of(node)}")
    return size is None


def _parts(node: yaml.Node) -> Iterator[yaml.Node] | list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


def _refuse_aliases_and_repeated_keys(root: yaml.Node | None) -> None:
    """Raise ``yaml.MarkedYAMLError``: nothing here needs aliases; of two values under one key only one would count."""
    seen: set[int] = set()
    pending = [] if root is None else [root]
    for node in pending:
        if id(node) in seen:
            raise _refused(node, "aliases are not allowed here")
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            pending += node.value
        elif isinstance(node, yaml.MappingNode):
            _refuse_repeated_keys(node)
            pending += [value for _, value in node.value]


def _refuse_repeated_keys(node: yaml.MappingNode) -> None:
    seen: set[str] = set()
    for key, _ in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise _refused(key, "a key must be a plain word")
        if key.value in seen:
            raise _refused(key, f"{key.value!r} is written twice")
        seen.add(key.value)


def _refused(node: yaml.Node, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
