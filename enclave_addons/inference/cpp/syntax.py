"""C++ text as a tree: the parser (tree-sitter, extra ``cpp``) and the few questions that everybody asks of a tree."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

from enclave_addons.inference.cpp.entry import CppSupportMissing

if TYPE_CHECKING:
    from tree_sitter import Node, Parser, Tree
else:
    Node = Tree = object  # the extra may not be installed, and only annotations name them

__all__ = ["Node", "Tree", "check_support", "children", "field_of", "line_of", "parse", "parse_expression", "text",
           "unwrapped", "walk", "words_in"]  # fmt: skip


@lru_cache(maxsize=1)
def _parser() -> Parser:
    try:
        import tree_sitter_cpp
        from tree_sitter import Language, Parser
    except ImportError as error:
        raise CppSupportMissing(
            "C++ sources need tree-sitter: pip install tree-sitter tree-sitter-cpp"
        ) from error
    return Parser(Language(tree_sitter_cpp.language()))


def check_support() -> None:
    """Raises ``CppSupportMissing`` where C++ cannot be read."""
    _parser()


def parse(source: bytes) -> Tree:
    """Parse ``source`` to its tree; raises ``CppSupportMissing``."""
    return _parser().parse(source)


@lru_cache(maxsize=4096)
def parse_expression(source: str) -> Node | None:
    """Parse one expression that stands for itself: the body of a macro, the arguments of a declaration."""
    root = parse(f"auto x_ = {source};".encode()).root_node
    for node in walk(root):
        if node.type == "init_declarator":
            return field_of(node, "value")
    return None


def field_of(node: Node | None, name: str) -> Node | None:
    """Return the part of ``node`` that the grammar calls so; ``None`` without one, or for no node."""
    return node.child_by_field_name(name) if node is not None else None


def text(node: Node | None) -> str:
    """Return what the source says; the empty text for no node."""
    found = node.text if node is not None else None  # cut out of the source again each time
    return found.decode("utf-8", "replace") if found is not None else ""


_WORD = re.compile(r"[A-Za-z_]\w*")


def words_in(node: Node) -> frozenset[str]:
    """Return every identifier and keyword below ``node``, those in literals included."""
    return frozenset(_WORD.findall(text(node)))


def addressed(node: Node | None) -> Node | None:
    """Return ``x`` of ``&x`` and of ``(x)``, any other expression as it is."""
    inner = unwrapped(node)
    return unwrapped(field_of(inner, "argument")) if text(inner).startswith("&") else inner


def line_of(node: Node) -> int:
    """Return the line that ``node`` begins in, counted from 1."""
    return int(node.start_point[0]) + 1


def children(node: Node | None) -> list[Node]:
    """Return the named children without comments."""
    if node is None:
        return []
    return [child for child in node.named_children if child.type != "comment"]


def walk(node: Node) -> Iterator[Node]:
    """Yield ``node`` and everything below it, in order."""
    stack = [node]
    while stack:
        current = stack.pop()
        yield current
        stack.extend(reversed(current.named_children))


def unwrapped(node: Node | None) -> Node | None:
    """Return ``node`` without parentheses and ``dependent_name`` around it."""
    while node is not None and node.type in (
        "parenthesized_expression",
        "dependent_name",
        "condition_clause",
    ):
        inner = children(node)
        node = inner[-1] if inner else None
    return node


def callee_name(callee: Node) -> str:
    """Return the name of a callee without its template arguments."""
    whole = "".join(text(callee).split())
    if not whole.endswith(">"):
        return whole.lstrip(":")
    depth = 0
    for position in range(len(whole) - 1, -1, -1):
        depth += (whole[position] == ">") - (whole[position] == "<")
        if depth == 0:
            return whole[:position].lstrip(":")
    return whole


def last_name(callee: Node | None) -> str:
    """Return the name of the function or method that a callee means, without what stands before it."""
    return re.split(r"::|\.|->", callee_name(callee))[-1] if callee is not None else ""


def template_arguments(node: Node | None) -> list[Node]:
    """Return the template arguments that a callee writes out: those of ``f<A, B>``, ``x.f<A>`` and ``a::f<A>``."""
    while node is not None and node.type in ("field_expression", "qualified_identifier", "dependent_name"):
        node = field_of(node, "field") or field_of(node, "name") or next(iter(node.named_children), None)
    listed = field_of(node, "arguments") if node is not None and node.type.startswith("template_") else None
    return [child for child in listed.named_children if child.type != "comment"] if listed is not None else []
