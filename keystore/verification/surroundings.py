"""Who else could replace the keystore or a part of it: owners, hard links, and the folders above up to the root."""

from __future__ import annotations

import os
import shlex
import stat
from collections.abc import Iterator
from pathlib import Path

from keystore.disk import safe_files
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity


def check_parents(root: Path) -> Iterator[Finding]:
    """Whoever can rename a folder above the keystore can put another one in its place."""
    for parent in root.parents:
        try:
            info = os.stat(parent)
        except OSError:
            continue
        if not _is_trusted(info):
            yield Finding(
                Severity.ERROR, "replaceable", str(parent),
                f"belongs to user {info.st_uid}, who can put another keystore in this place",
                f"put the keystore elsewhere, or: chown root {shlex.quote(str(parent))}",
            )  # fmt: skip
        elif info.st_mode & 0o022 and not info.st_mode & stat.S_ISVTX:
            everybody = bool(info.st_mode & stat.S_IWOTH)
            yield Finding(
                Severity.ERROR if everybody else Severity.WARNING, "replaceable", str(parent),
                f"{'everybody' if everybody else f'group {info.st_gid}'} can write in it (mode "
                f"{safe_files.mode_text(info)}) and put another keystore in this place",
                f"chmod go-w {shlex.quote(str(parent))}",
            )  # fmt: skip


def check_owner(root: Path, relative: str, info: os.stat_result) -> Iterator[Finding]:
    """A file or folder that is not secret: it must be ours or the administrator's all the same."""
    if not _is_trusted(info):
        yield Finding(
            Severity.ERROR, "foreign-owner", relative,
            f"belongs to user {info.st_uid}, who can change it at any time",
            repair.run_on(root, f"chown {os.geteuid()}", relative),
        )  # fmt: skip


def check_hard_links(root: Path, relative: str, info: os.stat_result) -> Iterator[Finding]:
    """A secret file with a second name: deleting or closing this one leaves the other."""
    if info.st_nlink > 1:
        yield Finding(
            Severity.ERROR, "hard-link", relative,
            f"the same file has {info.st_nlink} names; whoever reads one of the others has the key",
            repair.run_on(root, "find / -xdev -samefile", relative, "then renew --new-keys --revoke-old"),
        )  # fmt: skip


def _is_trusted(info: os.stat_result) -> bool:
    return info.st_uid in (0, os.geteuid())
