"""One text -> value by YAML 1.1, equal to ``yaml.safe_load(text)``, for parameter values and booleans.

Most values in launch files are plain words, numbers and ``$(...)`` templates. Those are decided here; PyYAML
is only loaded (20 ms) and run (50 us a value) for the rest. ``tests/frontend`` holds the two equal.
"""

from __future__ import annotations

from functools import lru_cache

from enclave_launch.boundary.light import Any, late_pattern
from enclave_launch.boundary.plain_yaml import decimal

# PyYAML types a plain scalar by its first character; one of these can only become text, a bool or null.
# Printable ASCII without ': ' and ' #' has no other meaning in YAML once the first character is harmless.
_WORD = late_pattern(r"[A-Za-z_/$](?:[!-~ ]*[!-~])?")
_BEGIN_OTHER_TYPES = frozenset("+-.0123456789<=")
_NOT_TEXT: dict[str, bool | None] = {
    **{word: True for text in ("yes", "true", "on") for word in (text, text.title(), text.upper())},
    **{word: False for text in ("no", "false", "off") for word in (text, text.title(), text.upper())},
    **dict.fromkeys(("null", "Null", "NULL", "~", "")),
}
UNDECIDED = object()


def load(text: str) -> Any:
    """``yaml.safe_load(text)``; raises ``yaml.YAMLError`` or ``ValueError`` as it does."""
    if not _WORD.fullmatch(text):
        value = _number(text)
    elif ": " in text or " #" in text or text[-1] == ":":
        value = UNDECIDED
    else:
        value = plain(text)
    return _load_with_yaml(text) if value is UNDECIDED else value


def plain(text: str) -> Any:
    """The value of a plain scalar by YAML 1.1; ``UNDECIDED`` where PyYAML's patterns must be asked."""
    if text in _NOT_TEXT:
        return _NOT_TEXT[text]
    return _number(text) if text[0] in _BEGIN_OTHER_TYPES else text


def _number(text: str) -> Any:
    number = decimal(text)
    return UNDECIDED if number is None else number


_MAX_KEPT = 10_000  # characters of a text whose value is remembered


def _load_with_yaml(text: str) -> Any:
    value = _load_cached(text) if len(text) <= _MAX_KEPT else _load_bounded(text)
    return value.copy() if isinstance(value, list | dict) else value


@lru_cache(maxsize=1024)
def _load_cached(text: str) -> Any:
    import yaml

    if "&" in text and "*" in text:
        return _load_bounded(text)
    # The pure-Python loader, as upstream: libyaml differs in what it rejects.
    return yaml.safe_load(text)


def _load_bounded(text: str) -> Any:
    """The same value; what is made to take long is refused (``boundary.yaml_nodes``)."""
    from enclave_launch.frontend.yaml_tree import parse_yaml

    return parse_yaml(text).root
