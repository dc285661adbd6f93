"""Plain values and YAML: numbers that every reader takes alike, and values as the text that ``yaml.dump`` writes.

PyYAML represents, resolves, serializes and analyses every scalar before it writes it; of most one glance tells how they
are written. PyYAML is asked for the others, and for values that are shared and get an anchor. What was written is known
to be YAML, and what it says, without reading it again.
"""

from __future__ import annotations

import marshal
import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

from enclave_launch.boundary.light import Any, late_pattern

_DECIMAL = late_pattern(r"[-+]?(?:[0-9]{1,17}\.[0-9]{0,17}(?:[eE][-+][0-9]{1,2})?|[1-9][0-9]{0,17}|0)")
# Text that stands without quotes, unless it is a word of YAML 1.1 or ": " is in it: "#" may begin a comment.
_PLAIN_TEXT = late_pattern(r"[A-Za-z_/][ !\"$-~]*(?<![: ])")
_WORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null"))
_LONE_SPACE = late_pattern(r"(?<! ) (?! )")
_LONE_SPACE_IN_QUOTES = late_pattern(r"(?<! )(?<!\A') (?! )(?!'\Z)")  # at neither end of what is quoted
WIDTH = 80  # a line goes on below at the first lone space beyond
LONGEST_KEY = 100  # one of 128 characters has a form of its own
_MOST_KEPT = 64
TUPLE_TAG = " !!python/tuple"
QUOTES = ("'", '"')

# Of what a text says, in its order: its kind ("scalar", "{" and "}", "[" and "]"), the text of a scalar, its quotes.
Part = tuple[str, str, str]


def decimal(text: str) -> int | float | None:
    """The number that a plain scalar is for YAML 1.1 as for rcl; ``None`` where they may differ."""
    if not _DECIMAL.fullmatch(text):
        return None
    return float(text) if "." in text else int(text)


def block_text(values: Any, *, sort_keys: bool = True, tuple_tag: str = TUPLE_TAG) -> str | None:
    """``yaml.dump`` of a dict or list; ``None`` where PyYAML must write it."""
    if not values or type(values) not in (dict, list) or _has_anchors(values):
        return None
    try:
        return _written(marshal.dumps(values, 2), sort_keys, tuple_tag)
    # Keys of two types, an object, an endless number.
    except (NeedsPyYAML, TypeError, ValueError, RecursionError):
        return None


def scalar_text(value: Any) -> str:
    """``value`` in a line of such a text. Raises ``NeedsPyYAML``, for collections too."""
    write = _SCALARS.get(type(value))
    if write is None:
        raise NeedsPyYAML
    return write(value)


def known_parts(text: str) -> Sequence[Part] | None:
    """What ``text`` says, where it was just written here."""
    return _known.get(text)


_known: dict[str, Sequence[Part]] = {}


class NeedsPyYAML(Exception):
    """Only PyYAML itself writes these values."""


def _has_anchors(values: Any) -> bool:
    """Whether a collection is in ``values`` twice."""
    pending, seen = [values], set[int]()
    for found in pending:
        if id(found) in seen:
            return True
        seen.add(id(found))
        inside = found.values() if type(found) is dict else found
        pending += [value for value in inside if type(value) in _COLLECTIONS]
    return False


@lru_cache(maxsize=_MOST_KEPT)
def _written(packed: bytes, sort_keys: bool, tuple_tag: str) -> str:
    """Equal values are written once."""
    writer = _Writer(sort_keys, tuple_tag)
    writer.write(marshal.loads(packed), "", "")
    text = "".join(writer.lines)
    if len(_known) == _MOST_KEPT:
        _known.clear()
    _known[text] = writer.parts
    return text


class _Writer:
    def __init__(self, sort_keys: bool, tuple_tag: str) -> None:
        self.lines: list[str] = []
        self.parts: list[Part] = []
        self._sort_keys = sort_keys
        self._tags: dict[type, str] = {dict: "", list: "", tuple: tuple_tag}

    def write(self, values: Any, lead: str, indent: str) -> None:
        """What is in a collection: the first behind ``lead``, the others behind ``indent``."""
        in_list = type(values) is not dict
        self._note("[" if in_list else "{")
        for head, value in self._entries(values):
            write = _SCALARS.get(type(value))
            if write is None:
                self._collection(lead + head, value, indent, in_list)
            else:
                written = write(value)
                text = value if type(value) is str else written
                self._note("scalar", text, "" if written == text else written[0])
                line = f"{lead}{head} {written}\n"
                if len(line) > WIDTH and " " in written:
                    self.lines += _folded(line, len(line) - len(written) - 1, indent)
                else:
                    self.lines.append(line)
            lead = indent
        self._note("]" if in_list else "}")

    def _entries(self, values: Any) -> Iterator[tuple[str, Any]]:
        """Each item with what stands before it, each value with its key."""
        if type(values) is not dict:
            for item in values:
                yield "-", item
            return
        for key in sorted(values) if self._sort_keys else values:
            if type(key) is not str or not 0 < len(key) <= LONGEST_KEY:
                raise NeedsPyYAML
            written = _text_written(key)
            self._note("scalar", key, "" if written == key else written[0])
            yield f"{written}:", values[key]

    def _collection(self, head: str, value: Any, indent: str, in_list: bool) -> None:
        tag = self._tags.get(type(value))
        if tag is None:
            raise NeedsPyYAML
        deeper = f"{indent}  " if in_list or type(value) is dict else indent
        if not value:
            self.lines.append(f"{head}{tag} {'{}' if type(value) is dict else '[]'}\n")
        elif not in_list or tag:
            self.lines.append(f"{head}{tag}\n")
        self.write(value, f"{head} " if in_list and not tag else deeper, deeper)

    def _note(self, kind: str, text: str = "", style: str = "") -> None:
        self.parts.append((kind, text, style))


def _folded(line: str, start: int, indent: str) -> list[str]:
    """The lines that PyYAML makes of one; its value begins at ``start``."""
    lines = []
    lone_space = _LONE_SPACE_IN_QUOTES if line[start] == "'" else _LONE_SPACE
    first, *words = lone_space.split(line[start:-1])
    line = line[:start] + first
    for word in words:
        if len(line) > WIDTH:
            lines.append(f"{line}\n")
            line = f"{indent}  {word}"
        else:
            line = f"{line} {word}"
    return [*lines, f"{line}\n"]


@lru_cache(maxsize=1024)
def _text_written(text: str) -> str:
    if _PLAIN_TEXT.fullmatch(text) and ": " not in text and text.lower() not in _WORDS:
        return text
    if not (text.isascii() and text.isprintable()):
        raise NeedsPyYAML
    from io import StringIO

    from yaml import ScalarNode
    from yaml.emitter import Emitter
    from yaml.resolver import Resolver

    resolver: Any = Resolver()
    kind = resolver.resolve(ScalarNode, text, (True, False))
    if kind == Resolver.DEFAULT_SCALAR_TAG and Emitter(StringIO()).analyze_scalar(text).allow_block_plain:
        return text
    return "'" + text.replace("'", "''") + "'"


def _float_written(value: float) -> str:
    if not abs(value) < math.inf:
        raise NeedsPyYAML
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")


_COLLECTIONS = {dict, list, tuple}
_SCALARS: dict[type, Callable[[Any], str]] = {
    str: _text_written,
    bool: {True: "true", False: "false"}.__getitem__,
    int: str,
    float: _float_written,
    type(None): {None: "null"}.__getitem__,
}
