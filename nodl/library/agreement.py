"""What the last check of the shipped library against sources said of each document: ``agreement.json`` beside them.

Sources are not at hand where the library is used, so the verdicts are kept: ``secure-nodl library check --keep``
writes them, the table of contents shows them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from nodl.library.check import LibraryVerdict

FILE = "agreement.json"


class Agreement(NamedTuple):
    """``said``: the verdict in a few words; ``version``: of the package whose source was read."""

    said: str
    version: str


def read_agreements(folder: str) -> dict[str, Agreement]:
    """Return what was noted, by the stem of the document."""
    path = os.path.join(folder, FILE)
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as stream:
        return {stem: Agreement(*pair) for stem, pair in json.load(stream).items()}


def keep_agreements(folder: str, verdicts: Iterable[LibraryVerdict], stems: Iterable[str]) -> None:
    """Write ``verdicts`` over what stood there; a document that is gone, not one of ``stems``, loses its line."""
    known: Mapping[str, Agreement] = {**read_agreements(folder), **dict(map(_kept, verdicts))}
    lines = (f"  {json.dumps(stem)}: {json.dumps(list(known[stem]))}" for stem in sorted({*stems} & {*known}))
    with open(os.path.join(folder, FILE), "w", encoding="utf-8") as stream:
        stream.write("{\n" + ",\n".join(lines) + "\n}\n")


def _kept(verdict: LibraryVerdict) -> tuple[str, Agreement]:
    return verdict.document.stem, Agreement(verdict.in_short, verdict.version or "")
