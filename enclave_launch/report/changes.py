"""Render the differences of two plans, as text for a terminal, as Markdown for a pull request and as plain values."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_launch.review.changes import Changes, EnclaveChange

_NONE = "no enclave, node, permission or flow differs"


def changes_text(changed: Changes) -> str:
    """Format changes as the lines of a diff, ``+`` and ``-``; ends with a newline."""
    return "\n".join([*([*_lines(changed)] or [_NONE]), *_not_compared(changed)]) + "\n"


def changes_markdown(changed: Changes) -> str:
    """Format changes for the description or a comment of a pull request."""
    verdict = "**Rights grew.**" if changed.rights_grew else "No enclave may do more than before."
    note = "".join(f"\n{line}.\n" for line in _not_compared(changed))
    if changed.is_empty:
        return f"### Security review\n\n{_NONE.capitalize()}.\n{note}"
    body = "\n".join(_lines(changed))
    return f"### Security review\n\n{verdict}\n\n```diff\n{body}\n```\n{note}"


def changes_document(changed: Changes) -> dict[str, object]:
    """Return changes as plain values for programs; every list is sorted."""
    return {
        "version": 1,
        "rights_grew": changed.rights_grew,
        "enclaves": [
            {
                "enclave": change.enclave,
                "new": change.is_new,
                "gone": change.is_gone,
                "added": [grant._asdict() for grant in change.added],
                "removed": [grant._asdict() for grant in change.removed],
            }
            for change in changed.enclaves
        ],
        "nodes_added": list(changed.nodes_added),
        "nodes_removed": list(changed.nodes_removed),
        "moved": [move._asdict() for move in changed.moved],
        "flows_added": [list(flow) for flow in changed.flows_added],
        "flows_removed": [list(flow) for flow in changed.flows_removed],
        "middlewares": [
            {"enclave": move.node, "before": move.before, "after": move.after} for move in changed.middlewares
        ],
        "files": [each._asdict() for each in changed.files],
        "as_installed": list(changed.as_installed),
        "unknown": list(changed.unknown),
    }


def _not_compared(changed: Changes) -> Iterator[str]:
    if changed.as_installed:
        yield f"Not compared, taken as installed now on both sides: {', '.join(changed.as_installed)}"
    if changed.unknown:
        yield f"Not compared, interfaces not completely known: {', '.join(changed.unknown)}"


def _lines(changed: Changes) -> Iterator[str]:
    yield from (f"+ node {node}" for node in changed.nodes_added)
    yield from (f"- node {node}" for node in changed.nodes_removed)
    yield from (
        f"! node {move.node} moves from enclave {move.before} to {move.after}" for move in changed.moved
    )
    yield from (
        f"! enclave {move.node} moves from {move.before} to {move.after}" for move in changed.middlewares
    )
    for change in changed.enclaves:
        yield from _enclave(change)
    yield from (f"+ flow {source} -> {target}" for source, target in changed.flows_added)
    yield from (f"- flow {source} -> {target}" for source, target in changed.flows_removed)
    yield from (f"{'+' if each.more else '-'} {each.file}: {each.text}" for each in changed.files)


def _enclave(change: EnclaveChange) -> Iterator[str]:
    sign = "+" if change.is_new else "-" if change.is_gone else " "
    yield f"{sign} enclave {change.enclave}"
    for mark, grants in (("+", change.added), ("-", change.removed)):
        yield from (f"{mark}   {grant}" for grant in grants if grant not in change.built_in)
        hidden = sum(grant in change.built_in for grant in grants)
        if hidden:
            yield f"{mark}   and {hidden} that every node has"
