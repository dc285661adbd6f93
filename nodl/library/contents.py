"""The table of what the library knows, how that is known, and what is left open: docs/library-contents.md.

``secure-nodl library table`` prints it; a test holds the document to it. Sources are not at hand where the library is
used: ``secure-nodl library check --keep`` writes their verdict on each document into ``agreement.json``, the table
shows it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from nodl.library.check import LibraryVerdict
from nodl.library.document import LibraryDocument

_HEAD = """\
# What the library knows

Written by `secure-nodl library table`. {documents} documents describe {pairs} pairs of a package and an executable,
component or plugin, in {packages} packages.

*Agreement* is that of `secure-nodl library check` with the analysis of the sources named here, at that version: {agree}
documents agree, {differ} differ, each with a reason (`secure-nodl library show`). Of those that agree {inferred} were
written from that analysis in the first place, all others by a reader of the source. Plugins and further nodes have no
node of their own in the source to compare with. *Left open* is what the document does not say: a gap is reported when a
launch needs it, and refused by `--secure`.

| package | executable, component or class | holds for | known from | agreement | left open |
|---|---|---|---|---|---|
"""


def contents_text(documents: Iterable[LibraryDocument], agreements: Mapping[str, Agreement]) -> str:
    """Return the whole document, one row for each of ``documents``."""
    known = list(documents)
    said = {each.stem: agreements[each.stem].said for each in known if each.stem in agreements}
    agree = [each for each in known if said.get(each.stem) == "agrees"]
    head = _HEAD.format(
        documents=len(known),
        pairs=sum(len(each.programs) + len(each.classes) for each in known),
        packages=len({each.package for each in known}),
        agree=len(agree),
        differ=sum(1 for each in said.values() if each.startswith("differs")),
        inferred=sum(1 for each in agree if each.evidence.how == "inferred"),
    )
    return head + "".join(f"| {' | '.join(_row(each, agreements))} |\n" for each in known)


def _row(document: LibraryDocument, agreements: Mapping[str, Agreement]) -> Iterator[str]:
    evidence = document.evidence
    names = [f"`{name}`" for name in (*document.programs, *document.classes)]
    yield document.package
    yield ", ".join(names) or f"transport `{document.transport}`"
    yield ", ".join(f"{distro} {series}" for distro, series in document.versions.items()) or "any"
    source = evidence.repository.removeprefix("github.com/")
    yield f"{evidence.how}: {source} {evidence.version} `{evidence.commit[:8]}`"
    agreement = agreements.get(document.stem)
    yield agreement.said if agreement else "not compared"
    yield "; ".join(_left_open(document)).replace("|", "\\|")


def _left_open(document: LibraryDocument) -> Iterator[str]:
    depends = document.interface.depends
    yield from document.evidence.missing
    yield from (f"gap: {gap.why}" for gap in (depends.gaps if depends else ()))


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
