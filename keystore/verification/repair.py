"""Repairs as lines for a shell, anything to know behind a ``#``; a sentence where no command can help."""

from __future__ import annotations

import shlex
from pathlib import Path

from keystore.disk import layout

BACKUP = "restore it from a backup"


def run(root: Path, verb: str, *arguments: str, note: str = "") -> str:
    """Return ``secure-keystore VERB KEYSTORE ARGUMENTS  # note``."""
    return _line(" ".join(("secure-keystore", verb, _quoted(root), *map(shlex.quote, arguments))), note)


def run_on(root: Path, command: str, relative: str, note: str = "") -> str:
    """Return a command such as ``chmod go-w`` on one entry of the keystore."""
    return _line(f"{command} {_quoted(root / relative)}", note)


def grant_again(root: Path, enclave: str) -> str:
    """Advise to start from nothing: what an enclave may do is unknown without trustworthy permissions."""
    document = layout.enclave_file(enclave, layout.PERMISSIONS)
    note = "grants nothing until secure-keystore apply-policy, or the next launch"
    renew = run(root, "renew", enclave, note=note)
    return f"{run_on(root, 'rm -f', document)} && {renew}"


def sign_governance(root: Path) -> str:
    """Advise to go back to the default: unsigned XML is nothing to sign again."""
    removed = " ".join(_quoted(root / name) for name in (layout.GOVERNANCE, layout.GOVERNANCE_XML))
    note = "SROS2's default governance for domain 0; another: secure-keystore governance"
    return f"rm -f {removed} && {run(root, 'create', note=note)}"


def _line(command: str, note: str) -> str:
    return f"{command}  # {note}" if note else command


def _quoted(path: Path) -> str:
    """Quote for a shell, unless the name holds something that would speak to the terminal instead."""
    text = str(path)
    return shlex.quote(text) if text.isprintable() else ascii(text)
