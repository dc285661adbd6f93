"""Text that others chose (names, arguments, file names, foreign sources) -> text that is safe on a terminal.

Control characters move the cursor, set the title or answer on the person's behalf; bidirectional marks show a name in
another order than it is compared in. Both are written as escapes. What Unicode does not count as printable is such a
character (``str.isprintable``); a blank is printable, other spaces are not.

Machine formats use escapes of their own: ``json_text`` here, quoted scalars in YAML.
"""

from __future__ import annotations

import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, redirect_stderr, redirect_stdout
from os import PathLike
from typing import Any, TextIO, cast

from enclave_common.colour import coloured, wants_colour

_PERHAPS_UNSAFE = re.compile(r"[^ -~\n\t]")


def printable(text: str) -> str:
    """Escape everything in ``text`` that is not printable, line ends too."""
    return text if text.isprintable() else "".join(map(_escaped, text))


def printable_lines(text: str) -> str:
    """Escape everything in ``text`` that is not printable, except line ends and tabs."""
    return _PERHAPS_UNSAFE.sub(lambda match: _escaped(match[0]), text)


def message(text: object) -> str:
    """Escape a message and indent its later lines, so that no name in it can begin a line that looks like ours."""
    return printable_lines(str(text)).replace("\n", "\n    ")


def warn(*texts: object) -> None:
    """Print each on stderr as a warning of ``secure-launch``."""
    for text in texts:
        print(f"secure-launch: warning: {message(text)}", file=sys.stderr)


def print_notes(lines: Iterable[str]) -> None:
    """Print each on stderr, for a person who wants to know more (``--verbose``)."""
    for line in lines:
        print(printable(line), file=sys.stderr)


def quoted(text: str | PathLike[str]) -> str:
    """Quote ``text``, as a Python literal if it has a quote or is not printable."""
    plain = str(text)
    return f"'{plain}'" if plain.isprintable() and "'" not in plain else repr(plain)


def json_text(content: object, **options: Any) -> str:
    """Return ``json.dumps`` with readable characters as they are and all others (DEL and C1 too) as JSON's escapes."""
    return _PERHAPS_UNSAFE.sub(_escaped_in_json, json.dumps(content, ensure_ascii=False, **options))


class OutputError(Exception):
    """Standard output cannot be written: the disk is full."""


@contextmanager
def safe_output() -> Iterator[None]:
    """Make text that Python code writes to standard output and error safe as ``printable_lines`` does, within the
    block.

    This covers what argparse and warnings write; what goes to the file descriptors is not touched. A stream that was
    closed before we started is replaced by one that drops what it is given.
    """
    with ExitStack() as stack:
        if sys.stdout is None:
            stack.enter_context(redirect_stdout(stack.enter_context(open(os.devnull, "w"))))
        if sys.stderr is None:
            stack.enter_context(redirect_stderr(stack.enter_context(open(os.devnull, "w"))))
        stack.enter_context(redirect_stdout(_safe(sys.stdout)))
        stack.enter_context(redirect_stderr(_safe(sys.stderr)))
        yield


def stdout_is_for_the_plan() -> AbstractContextManager[Any]:
    """Send what launch files print to stderr within the block."""
    return redirect_stdout(sys.stderr)


def choose_colour(mode: str) -> None:
    """Set for the rest of ``safe_output`` whether its streams have colours: ``auto``, ``always`` or ``never``."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, _SafeText):
            stream.colour = wants_colour(mode, cast("TextIO", stream))


class _SafeText:
    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.colour = wants_colour("auto", stream)

    def write(self, text: str) -> int:
        safe = printable_lines(text)
        _write(self._stream, coloured(safe) if self.colour else safe)
        return len(text)

    def flush(self) -> None:
        with _output_errors():
            self._stream.flush()

    def writelines(self, lines: Iterator[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def _output_errors() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(f"the output cannot be written: {error.strerror}") from error


def _write(stream: TextIO, text: str) -> None:
    encoding = getattr(stream, "encoding", None) or "utf-8"
    with _output_errors():
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


def _safe(stream: TextIO) -> TextIO:
    return stream if isinstance(stream, _SafeText) else cast("TextIO", _SafeText(stream))


def _escaped(character: str) -> str:
    return character if character.isprintable() else repr(character)[1:-1]


def _escaped_in_json(match: re.Match[str]) -> str:
    character = match[0]
    if character.isprintable():
        return character
    units = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at : at + 2].hex()}" for at in range(0, len(units), 2))


_REST = r"/([^\s:,;'\"()<>]+)"


def short_paths(text: str, folder: str) -> str:
    """Strip ``folder`` from the paths of existing files: ROS names (``/robot/cmd_vel``) must stay whole."""
    root = folder.rstrip("/")
    if not root or root not in text:
        return text
    pattern = re.compile(rf"(?<![\w./-]){re.escape(root)}{_REST}")
    return pattern.sub(lambda found: found[1] if os.path.isfile(found[0]) else found[0], text)


_INTERVAL = 2.0  # seconds


class Progress:
    """Called with what is done now; prints it on stderr once in a few seconds."""

    def __init__(self, doing: str) -> None:
        self._doing = doing
        self._due = time.monotonic() + _INTERVAL

    def __call__(self, subject: str) -> None:
        if time.monotonic() >= self._due:
            print(f"{self._doing} {printable(subject)} ...", file=sys.stderr, flush=True)
            self._due = time.monotonic() + _INTERVAL


def progress(doing: str, *, quiet: bool) -> Progress | None:
    """Return the progress to show if a person may be looking at stderr."""
    return Progress(doing) if sys.stderr.isatty() and not quiet else None


def counted_progress(doing: str, *, quiet: bool) -> Callable[[int, int], None] | None:
    """Return a progress display as ``progress`` does, called with how many of how many are done."""
    shown = progress(doing, quiet=quiet)
    return None if shown is None else lambda done, total: shown(f"{done} of {total}")
