"""Text that others chose -> HTML. Everything that enters a page goes through here."""

from __future__ import annotations

import html
from collections.abc import Iterable

from enclave_launch.boundary.terminal import json_text, printable


def text(value: object) -> str:
    """``value`` as text of an element or of a quoted attribute; what is not printable is shown as an escape."""
    return html.escape(printable(str(value)))


def script_data(content: object) -> str:
    """JSON for a ``script`` element of a data type: no ``<`` in it can end the element or begin a comment (HTML
    standard, "Restrictions for contents of script elements")."""
    escaped = json_text(content, separators=(",", ":"))
    return escaped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def row(cells: Iterable[str], *, attributes: str = "") -> str:
    """A table row of cells that are HTML already."""
    return f"<tr{attributes}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def table(caption: str, headings: Iterable[str], rows: Iterable[str]) -> str:
    """``caption`` and ``headings`` are our own words."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    body = "\n".join(rows)
    return f"<table><caption>{caption}</caption><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>\n"
