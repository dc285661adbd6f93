"""Bounds of YAML documents that hold for whoever walks over PyYAML's nodes afterwards.

Nodes that aliases share are visited once by PyYAML, but as often as they are named by most of what comes after it; a
few lines can stand for billions of values. libyaml's loader also recurses in C, where depth ends the process. Pure.
"""

from __future__ import annotations

from collections.abc import Iterator

import yaml

from enclave_launch.boundary.light import Any

MAX_NESTING = 250  # the recursion of PyYAML, and of launch, ends at about this depth
FREE_EXPANSION = 10_000  # values that aliases may stand for in any document, and
EXPANSION_FACTOR = 20  # how many times its written values a document may stand for beyond that

SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
EventParser: Any = getattr(yaml, "CLoader", yaml.Loader)


class RefusedYaml(yaml.YAMLError):
    """Well-formed, but made to exhaust memory, time or the stack."""


def may_have_aliases(text: str | bytes) -> bool:
    """Whether the marks of an anchor and of an alias are in ``text``."""
    return ("&" in text and "*" in text) if isinstance(text, str) else (b"&" in text and b"*" in text)


def refuse_deep_nesting(text: str | bytes) -> None:
    """Raises ``RefusedYaml`` for more than ``MAX_NESTING`` levels. Reads events, which takes no recursion."""
    if not _may_be_deep(text):
        return
    depth = 0
    try:
        for event in yaml.parse(text, Loader=EventParser):
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


def _may_be_deep(text: str | bytes) -> bool:
    """A block inside a block begins further to the right, a flow inside a flow after one more bracket."""
    plain = text if isinstance(text, bytes) else text.encode("utf-8", "replace")
    longest_line = max(map(len, plain.splitlines()), default=0)
    return longest_line > MAX_NESTING or plain.count(b"[") + plain.count(b"{") > MAX_NESTING


def refuse_many_aliases(root: Any) -> None:
    """Raises ``RefusedYaml`` when the values below ``root``, with every alias written out, are too many.

    Each distinct node is visited once.
    """
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


def _is_unsized(node: Any, sizes: dict[int, int]) -> bool:
    size = sizes.get(id(node))
    if size == _UNFINISHED:
        raise RefusedYaml(f"a value contains itself: line {node.start_mark.line + 1}")
    return size is None


def _parts(node: Any) -> Iterator[Any] | list[Any]:
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []
