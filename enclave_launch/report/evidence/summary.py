"""The evidence for a reader: what it is, which part supports which requirement, what was checked and what was not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from enclave_launch.report.contents import ReportContents
from enclave_launch.report.evidence.requirements import DISCLAIMER, PARTS
from enclave_launch.report.markdown import code, escaped


def summary(contents: ReportContents, scope: Mapping[str, Any], at: str) -> str:
    """``README.md`` of the folder."""
    return "\n".join(_lines(contents, scope, at)) + "\n"


def _lines(contents: ReportContents, scope: Mapping[str, Any], at: str) -> Iterator[str]:
    open_ones = [told for told, accepted in contents.judged if accepted is None]
    yield from (f"# Evidence for {escaped(contents.title)}", "", DISCLAIMER, "")
    yield f"Examined {escaped(at)} by {escaped(scope['tool'])}. Findings: {len(open_ones)} open,"
    yield f"{len(contents.judged) - len(open_ones)} accepted. `report.html` shows all of it; it needs no network."
    for part in PARTS:
        yield from ("", f"## {part.name}", "", f"{part.shows[:1].upper()}{part.shows[1:]}.", "")
        yield f"Files: {', '.join(f'`{name}`' for name in part.files)}. Supports:"
        yield from ("", *(f"- {each}" for each in part.supports))
    yield from ("", "## Not checked", "", *(f"- {escaped(each)}" for each in scope["not_checked"]))
    if scope["gaps"]:
        yield from ("", "Gaps of the plan:", "", *(f"- {escaped(each)}" for each in scope["gaps"]))
    accepted = [(told, reason) for told, reason in contents.judged if reason is not None]
    if accepted:
        yield from ("", "## Accepted exceptions", "")
        yield from (
            f"- {code(told.code)} {escaped(told.text)}: {escaped(reason)}" for told, reason in accepted
        )
    yield from ("", "## Check it", "")
    yield "`statement.json` is an in-toto statement that names every file by its SHA-256; `statement.dsse.json` is the "
    yield "same, signed, where a key was given. Apart from a signature, the same input and time give the same bytes."
