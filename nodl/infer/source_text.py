"""A source file's bytes as the text that Python's parser reads: declared encoding, newlines, identifiers in NFKC.

What is searched in this text (``yield``, private names, whatever makes interfaces) must find every name that the parser
finds. An encoding in which plain ASCII can spell another text (``utf-7``, ``unicode_escape``) is refused.
"""

from __future__ import annotations

import io
import unicodedata

_ASCII = b"\\x41\\u0041+AEE-"


class HidingEncodingError(ValueError):
    """The declared encoding writes letters as other letters."""


def source_text(data: bytes) -> str:
    """The text of a file that could be parsed. Raises ``HidingEncodingError``."""
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
