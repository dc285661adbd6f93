"""Numbers, lists and mistyped words in sentences."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def counted(number: int, what: str) -> str:
    """Return ``1 node``, ``2 nodes``."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def some_of(names: Iterable[object], most: int, between: str = ", ") -> str:
    """Return the first ``most`` of them, and how many more there are."""
    texts = [str(name) for name in names]
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return between.join(texts[:most]) + more


_ALIKE = 0.6  # of difflib's ratio: what Python's own "Did you mean" and git take, too


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'talker'?"`` for a mistyped word, or an empty text."""
    meant = nearest(word, known)
    return f"; did you mean {meant!r}?" if meant else ""


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that was probably meant, None if none is alike.

    A word that continues ``word`` comes first: ``--form`` is the beginning of ``--format`` rather than a slip for
    ``--for``."""
    by_letters = {each.lower(): each for each in known if each != word}
    begun = [each for each in by_letters if each.startswith(word.lower())]
    close = difflib.get_close_matches(word.lower(), begun, n=1, cutoff=_ALIKE)
    close = close or difflib.get_close_matches(word.lower(), by_letters, n=1, cutoff=_ALIKE)
    return by_letters[close[0]] if close else None
