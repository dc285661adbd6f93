"""A source file's bytes as the text and the tree that Python has of it: encoding, newlines, NFKC, private names.

What is searched in this text (``yield``, private names, whatever makes interfaces) must find every name that the parser
finds. An encoding in which plain ASCII can spell another text (``utf-7``, ``unicode_escape``) is refused.
"""

from __future__ import annotations

import ast
import io
import re
import unicodedata

_PRIVATE = re.compile(r"__(?!\w*__\b)\w")  # or the middle of a name, which does no harm
_ASCII = b"\\x41\\u0041+AEE-"


class HidingEncodingError(ValueError):
    """The declared encoding writes letters as other letters."""


def source_text(data: bytes) -> str:
    """Return the text of a file that could be parsed. Raises ``HidingEncodingError``."""
    encoding = "utf-8"
    if any(b"coding" in line for line in data.split(b"\n", 2)[:2]):  # PEP 263: in one of the first two
        import tokenize

        encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
        if _ASCII.decode(encoding, "replace") != _ASCII.decode("ascii"):
            raise HidingEncodingError(f"the encoding {encoding} hides what the file says")
    text = data.decode(encoding, "replace")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text if text.isascii() else unicodedata.normalize("NFKC", text)  # language reference, 2.3


def mangle(tree: ast.Module, text: str) -> ast.Module:
    """Write private names in ``tree`` as the compiler does, in place: ``__x`` in ``class C`` is ``_C__x``.

    Source: language reference, 6.2.1. Cheap for files that have none.
    """
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
