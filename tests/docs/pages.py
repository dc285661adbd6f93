"""Pages of the documentation as scripts: files that a reader writes, commands that a reader types, what they print.

A fenced block below a line that is a path in backquotes and a colon is that file. A path with ``(an empty file)``
has no block. A block of language ``console`` has commands after
``$`` and below each what it prints; a line ``...`` stands for any lines, ``...`` within a line for any text. A command
that ends in ``# exit status N`` ends with that status, others with 0. A comment ``<!-- meanwhile: COMMAND -->`` starts
what the reader has running from there on, and ends what such a comment before it started. Blocks of other languages are
not run.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

_BLOCK = re.compile(
    r"^(?: *`([^`\n]+)`:\n\n)?( *)```(\w+)\n(.*?)^ *```$|^`([^`\n]+)` \(an empty file\)$"
    r"|^<!-- meanwhile: ([^\n]*) -->$",
    re.S | re.M,
)
_STATUS = re.compile(r"  # exit status (\d+)$")


class Command(NamedTuple):
    words: str
    shown: list[str]
    status: int


class Meanwhile(NamedTuple):
    """What runs beside the commands that follow."""

    words: str


def parts(page: Path) -> Iterator[tuple[str, str] | Command | Meanwhile]:
    """Yield the files (path and text) and the commands of a page in their order."""
    for found in _BLOCK.finditer(page.read_text(encoding="utf-8")):
        file, indent, language, text, empty_file, meanwhile = found.groups()
        if meanwhile:
            yield Meanwhile(meanwhile)
            continue
        if empty_file:
            yield empty_file, ""
            continue
        lines = [line.removeprefix(indent) for line in text.splitlines()]
        if file:
            yield file, "".join(f"{line}\n" for line in lines)
        elif language == "console":
            yield from _commands(lines)


def _commands(lines: list[str]) -> Iterator[Command]:
    starts = [number for number, line in enumerate(lines) if line.startswith("$ ")]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        words = lines[start][2:]
        status = _STATUS.search(words)
        yield Command(_STATUS.sub("", words), lines[start + 1 : end], int(status[1]) if status else 0)


def write_files(page: Path, folder: Path) -> None:
    """Write the files of a page, without running anything."""
    for part in parts(page):
        if not isinstance(part, Command | Meanwhile):
            _write(folder, *part)


def read_aloud(page: Path, folder: Path, environment: dict[str, str]) -> None:
    """Do what the page says, in ``folder``; fail at the first command that does otherwise."""
    script = folder.parent / "variables"
    script.write_text("")
    with ExitStack() as running:
        for part in parts(page):
            if isinstance(part, Meanwhile):
                running.close()
                running.enter_context(_running(part.words, folder, environment))
            elif isinstance(part, Command):
                _do(part, page, script, folder, environment)
            else:
                _write(folder, *part)


@contextmanager
def _running(words: str, folder: Path, environment: dict[str, str]) -> Iterator[None]:
    process = subprocess.Popen(shlex.split(words), cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    try:
        yield
        assert process.poll() is None, f"ended while the page was read: {words}"
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


def _do(command: Command, page: Path, script: Path, folder: Path, environment: dict[str, str]) -> None:
    line = f". {script}\n{command.words}\nstatus=$?\nexport -p > {script}\nexit $status\n"
    done = subprocess.run(
        ["bash", "-c", line], cwd=folder, env=environment, text=True, timeout=150, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    place = f"{page.name}: $ {command.words}\n{done.stdout}"
    assert done.returncode == command.status, f"exit status {done.returncode}, not {command.status}: {place}"
    assert _is_shown(done.stdout, command.shown), "\n".join(
        ("the page shows:", *command.shown, "printed:", place)
    )


def reader_environment(home: Path, tools: Path, underlay: str = "") -> dict[str, str]:
    """Return the variables of a reader's shell: our commands, a name for git, nothing of ROS."""
    kept = {
        name: text for name, text in os.environ.items() if not name.startswith(("ROS_", "AMENT_", "GIT_"))
    }
    path = os.pathsep.join((str(tools), str(Path(sys.executable).parent), kept.get("PATH", "")))
    identity = {
        f"GIT_{who}_{what}": "reader@example.org"
        for who in ("AUTHOR", "COMMITTER")
        for what in ("NAME", "EMAIL")
    }
    return {**kept, **identity, "PATH": path, "HOME": str(home), "UNDERLAY": underlay}


def _write(folder: Path, path: str, text: str) -> None:
    (folder / path).parent.mkdir(parents=True, exist_ok=True)
    (folder / path).write_text(text, encoding="utf-8")


def _is_shown(printed: str, shown: list[str]) -> bool:
    patterns = [r"(?:.*\n)*" if line.strip() == "..." else f"{_line(line)}\n" for line in shown]
    return bool(
        re.fullmatch("".join(patterns), printed if not printed or printed.endswith("\n") else f"{printed}\n")
    )


def _line(line: str) -> str:
    return ".*".join(map(re.escape, line.split("...")))
