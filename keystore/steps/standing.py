"""What was seen to stand, remembered between launches: then a look at the files' inodes and times is enough.

    recall    before a provisioning: None, or that everything is as when it was last compared in full
    remember  after a full comparison that found nothing to do

The note is a cache of the user's, outside the keystore: ``$XDG_CACHE_HOME/enclave-launch``. It decides nothing but
whether a comparison is repeated: DDS checks every signature when a process starts, and nothing is ever signed
because of it. It holds for one policy text, one set of options, this code and these files; with any other, when
it is not the user's alone, or when it is gone, everything is compared. Touches the cache directory only.
"""

from __future__ import annotations

import binascii
import os
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout
from keystore.disk.stamps import Stamp, enclave_stamp, file_stamp
from keystore.formats.domains import Domains
from keystore.formats.policy import EnclavePolicy
from keystore.formats.role import Role
from keystore.formats.validity import Validity

_SHARED = (*(layout.ca_cert(role) for role in Role), layout.GOVERNANCE, layout.CRL)
# What decides how an enclave should look: a newer version compares everything once more.
_CODE = (
    "../formats/permissions.py",
    "../formats/permissions_names.py",
    "../formats/permissions_patterns.py",
    "enclave_state.py",
)

_KEPT = 90 * 24 * 3600.0
"""Seconds."""


class Question(NamedTuple):
    """What is asked of a keystore, apart from the policies."""

    root: Path
    domains: Domains
    rmw: str | None

    def head(self) -> str:
        """The note's first line: all that holds for every enclave."""
        shared = [file_stamp(f"{self.root}/{name}") for name in _SHARED]
        code = [file_stamp(os.path.join(os.path.dirname(__file__), name)) for name in _CODE]
        return f"{self.root}\t{self.domains}\t{self.rmw}\t{shared}\t{code}"


class Standing(NamedTuple):
    """``stamps`` of the enclaves asked for, as they are; ``ends``: when the first certificate, CA or CRL ends."""

    stamps: Mapping[str, Stamp]
    ends: datetime


def recall(
    question: Question, policies: Iterable[EnclavePolicy], now: datetime, due: datetime
) -> Standing | None:
    """Whether all was seen to stand with these policies and nothing was touched since. ``due``: certificates that
    end before it do not stand."""
    try:
        return _recall(question, policies, now, due)
    except ValueError:  # somebody wrote in the note
        return None


def _recall(
    question: Question, policies: Iterable[EnclavePolicy], now: datetime, due: datetime
) -> Standing | None:
    head, span, lines = _read(question.root)
    if not lines or head != question.head():
        return None
    begin, end = map(int, span.split("\t"))
    last = end
    stamps = {}
    for policy in policies:
        stamp = stamps[policy.path] = enclave_stamp(str(question.root), policy.path)
        own_begin, own_end, seen = lines.get(policy.path, "0\t0\t").split("\t", 2)
        if seen != _seen(stamp, policy):
            return None
        begin, last = max(begin, int(own_begin)), min(last, int(own_end))
    if not begin <= now.timestamp() <= end or last < due.timestamp():
        return None
    return Standing(stamps, datetime.fromtimestamp(last, timezone.utc))


def remember(
    root: Path,
    head: str,
    shared: tuple[datetime, datetime],
    found: Iterable[tuple[EnclavePolicy, Stamp, Validity]],
) -> None:
    """``found``: what a full comparison saw to stand. ``head`` (of the question) and the stamps are from before it,
    so that what changed meanwhile is not taken for seen. ``shared``: begin and end of what CAs and CRL have in common.

    Best effort: without a cache directory of the user's own nothing is remembered.
    """
    known, _, lines = _read(root)
    kept = lines if known == head else {}
    new = {policy.path: f"{_span(*validity)}\t{_seen(stamp, policy)}" for policy, stamp, validity in found}
    text = "\n".join([head, _span(*shared), *(f"{path}\t{line}" for path, line in {**kept, **new}.items())])
    note = _note(root)
    if note is not None:
        with suppress(OSError, ValueError):  # no such directory, no room, a name that is no text
            _write(note, text)


def _seen(stamp: Stamp, policy: EnclavePolicy) -> str:
    return f"{stamp}\t{list(_words(policy))}"


def _words(policy: EnclavePolicy) -> Iterator[str]:
    for ns, node, rules in policy.profiles:
        yield f"{ns!r} {node!r}"
        yield from map(" ".join, rules)  # of a rule only the last word is free text


def _span(begin: datetime, end: datetime) -> str:
    return f"{int(begin.timestamp())}\t{int(end.timestamp())}"


def _read(root: Path) -> tuple[str, str, dict[str, str]]:
    """Head, span of what is shared, and the line of each enclave; empty unless the note is ours alone."""
    note = _note(root)
    if note is None:
        return "", "", {}
    try:
        if not _is_ours(os.lstat(note.parent)):
            return "", "", {}
        descriptor = os.open(note, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        with open(descriptor, encoding="utf-8", newline="\n") as file:
            if not _is_ours(os.fstat(descriptor)):
                return "", "", {}
            head, span, *lines = file.read().split("\n")
    except (OSError, ValueError):
        return "", "", {}
    parts = (line.partition("\t") for line in lines)
    return head, span, {path: line for path, _, line in parts}


def _is_ours(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and not status.st_mode & 0o022 and not stat.S_ISLNK(status.st_mode)


def _note(root: Path) -> Path | None:
    """One file for each keystore; two that share a name only make each other forget. None for a user without home."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    if not os.path.isabs(base):  # the XDG base directory specification: anything else is to be ignored
        base = os.path.join(os.path.expanduser("~"), ".cache")
    if not os.path.isabs(base):
        return None
    return Path(base, "enclave-launch", f"standing-{binascii.crc32(os.fsencode(root)):08x}")


def _forget_old(directory: Path) -> None:
    """Notes of keystores that are gone; one that is still asked for is simply written again."""
    limit = time.time() - _KEPT
    for entry in os.scandir(directory):
        if entry.stat(follow_symlinks=False).st_mtime < limit:
            os.unlink(entry.path)


def _write(note: Path, text: str) -> None:
    import tempfile  # much to import, and only when there is something new to remember

    note.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=note.parent)
    try:
        with open(descriptor, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        os.replace(name, note)
        _forget_old(note.parent)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(name)
        raise
