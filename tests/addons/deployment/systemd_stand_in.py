"""Starts what a generated unit says, as systemd would: its quoting, its environment, its credentials.

Without users, sandbox and restart. What it stands for is written in systemd.syntax(7), systemd.service(5) and
systemd.exec(5); ``systemd-analyze`` judges the units themselves.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

_ESCAPES = {"n": "\n", "t": "\t", "s": " ", "\\": "\\", '"': '"', "'": "'"}


class Unit:
    """A service file, read."""

    def __init__(self, path: Path):
        self.name = path.name
        self.settings: dict[str, list[str]] = {}
        for line in path.read_text().splitlines():
            if "=" in line and not line.startswith(("#", ";", "[")):
                name, _, value = line.partition("=")
                self.settings.setdefault(name, []).append(value)

    def one(self, name: str) -> str:
        (value,) = self.settings[name]
        return value

    def all(self, name: str) -> list[str]:
        return self.settings.get(name, [])


def words(text: str) -> list[str]:
    """systemd.syntax(7), "Quoting"."""
    found: list[str] = []
    word: list[str] | None = None
    quote = ""
    at = 0
    while at < len(text):
        char = text[at]
        if char == "\\":
            char, at = _escaped(text, at + 1)
            word = [*(word or []), char]
            continue
        at += 1
        if quote:
            if char == quote:
                quote = ""
            else:
                word = [*(word or []), char]
        elif char in "'\"":
            quote, word = char, word or []
        elif char.isspace():
            if word is not None:
                found.append("".join(word))
            word = None
        else:
            word = [*(word or []), char]
    assert not quote, f"a quote without its end: {text}"
    return [*found, *(["".join(word)] if word is not None else [])]


def _escaped(text: str, at: int) -> tuple[str, int]:
    if text[at] == "x":
        data = bytearray()
        while text[at : at + 1] == "x":
            data.append(int(text[at + 1 : at + 3], 16))
            at += 3
            if text[at : at + 2] == "\\x":
                at += 1
        return data.decode(), at
    return _ESCAPES[text[at]], at + 1


class StandIn:
    """The directories of one started unit, below ``root``."""

    def __init__(self, unit: Unit, root: Path):
        self._unit = unit
        self._root = root / unit.name
        for name in ("run", "state", "logs", "credentials"):
            (self._root / name).mkdir(parents=True)
        self._specifiers = {"%S": self._root / "state", "%L": self._root / "logs", "%t": self._root / "run"}

    def environment(self) -> dict[str, str]:
        """Nothing is inherited but what systemd sets itself (systemd.exec(5), "Environment variables")."""
        found = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8"}
        for line in self._unit.all("Environment"):
            found |= dict(self._expanded(word).split("=", 1) for word in words(line))
        for line in self._unit.all("UnsetEnvironment"):
            for name in line.split():
                found.pop(name, None)
        if self._unit.all("LoadCredential"):
            found["CREDENTIALS_DIRECTORY"] = str(self._root / "credentials")
            found["RUNTIME_DIRECTORY"] = str(self._root / "run" / self._unit.one("RuntimeDirectory"))
        return found

    def start(self, prefix: Sequence[str] = ()) -> subprocess.Popen[str]:
        """What ExecStartPre= and ExecStart= say, the latter left running; ``prefix`` runs it elsewhere."""
        self._load_credentials()
        for folder, names in (
            ("run", "RuntimeDirectory"),
            ("state", "StateDirectory"),
            ("logs", "LogsDirectory"),
        ):
            for name in self._unit.all(names):
                (self._root / folder / name).mkdir(mode=0o700)
        environment = self.environment()
        for line in self._unit.all("ExecStartPre"):
            subprocess.run(self._command(line), env=environment, check=True)
        command = [*prefix, *self._command(self._unit.one("ExecStart"))]
        pipe = subprocess.PIPE
        return subprocess.Popen(
            command, env=environment, stdout=pipe, stderr=subprocess.STDOUT, text=True, start_new_session=True
        )

    def _load_credentials(self) -> None:
        """A file that is missing has the content of SetCredential=, if that names it (systemd.exec(5))."""
        instead = dict(line.split(":", 1) for line in self._unit.all("SetCredential"))
        for line in self._unit.all("LoadCredential"):
            name, _, source = line.partition(":")
            target = self._root / "credentials" / name
            if name in instead and not os.path.lexists(self._expanded(source)):
                target.write_text(instead[name])
            else:
                shutil.copyfile(self._expanded(source), target)
            os.chmod(target, 0o400)

    def _command(self, line: str) -> list[str]:
        found = [self._expanded(word) for word in words(line.removeprefix("+"))]
        assert "$" not in "".join(found).replace("$$", ""), f"systemd would expand a variable: {line}"
        return [word.replace("$$", "$") for word in found]

    def _expanded(self, word: str) -> str:
        parts = word.split("%%")
        for specifier, place in self._specifiers.items():
            parts = [part.replace(specifier, str(place)) for part in parts]
        assert not any("%" in part for part in parts), f"an unknown specifier: {word}"
        return "%".join(parts)
