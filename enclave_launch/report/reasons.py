"""The evidence for a permission in words."""

from __future__ import annotations

from enclave_launch.report.graph import UseReason


def evidence_text(reason: UseReason) -> str:
    """``talker.nodl.xml:4; written chatter; remapped by chatter:=conversation at f.launch.xml:7``."""
    parts = [reason.place]
    if reason.written:
        parts.append(f"written {reason.written}")
    parts += [f"remapped by {rule}" for rule in reason.remapped_by]
    if reason.note:
        parts.append(reason.note)
    return "; ".join(parts)
