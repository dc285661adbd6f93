"""Private names as the compiler writes them: ``__x`` in ``class C`` is ``_C__x`` (language reference, 6.2.1)."""

from __future__ import annotations

import ast
import re

_PRIVATE = re.compile(r"__(?!\w*__\b)\w")  # or the middle of a name, which does no harm


def mangle(tree: ast.Module, text: str) -> ast.Module:
    """``tree`` with private names rewritten in place; cheap for files that have none."""
    if _PRIVATE.search(text):
        _Mangler().visit(tree)
    return tree


class _Mangler(ast.NodeVisitor):
    def __init__(self) -> None:
        self._class = ""

    def visit(self, node: ast.AST) -> None:
        if self._class:
            for field in ("id", "attr", "name", "arg", "asname"):
                name = getattr(node, field, None)
                if isinstance(name, str) and not isinstance(node, ast.keyword):
                    setattr(node, field, self._mangled(name))
            if isinstance(node, ast.Global | ast.Nonlocal):
                node.names = [self._mangled(name) for name in node.names]
        if isinstance(node, ast.ClassDef):
            outer, self._class = self._class, node.name.lstrip("_")
            self.generic_visit(node)
            self._class = outer
        else:
            self.generic_visit(node)

    def _mangled(self, name: str) -> str:
        private = name.startswith("__") and not name.endswith("__") and "." not in name
        return f"_{self._class}{name}" if private else name
