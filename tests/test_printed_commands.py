"""Every command that a message or a page names is taken by our own parsers: a remedy can be typed as it is printed.

A command is read from its name to the first word that is neither an option, the value of one, a verb nor a stand-in
(``KEYSTORE``, a path, something that is filled in). What prose leaves out, such as a file, may be missing.
"""

from __future__ import annotations

import argparse
import ast
import re
import shlex
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, NoReturn

import pytest

from enclave_common.command_line import CommandParser, parsers

ROOT = Path(__file__).resolve().parents[1]
PARSERS = {
    "secure-launch": "enclave_launch.verb.options",
    "secure-plan": "enclave_addons.review.verb",
    "secure-keystore": "keystore.verb",
    "secure-nodl": "nodl.verb",
}
PACKAGES = ("enclave_common", "enclave_launch", "keystore", "nodl")
GENERATED = ROOT / "docs" / "commands.md"  # from the parsers
PAGES = [ROOT / "README.md", *(page for page in sorted((ROOT / "docs").rglob("*.md")) if page != GENERATED)]
FILLED_IN = "/x"
_NAME = re.compile(rf"(?<![\w/-])({'|'.join(PARSERS)})(?= )")
_STAND_IN = re.compile(
    r"(/|\{|\.\.\.|[A-Z][A-Z_]*\b|\w+:=|[\w./-]+\.(xml|ya?ml|json|py|pem|bundle|html|jsonl|crl)\Z)"
)
PROSE = frozenset(
    re.findall(r"\w+", "wrote writes prints printed explains starts and or as by in on only has is does")
)
"""What stands behind the name of a command in a sentence."""
_OF_PROSE = re.compile(
    f"^the following arguments are required|expected (one|at least one) argument|invalid choice: '{FILLED_IN}'"
)
"""What a parser may say of a command in a sentence: something is left out, or filled in."""
OF_OTHERS = {"--ros-args", "--ros-", "--ignore-environment"}


class WrongUsage(Exception):
    """What a parser says of words that it does not take."""


class Printed(NamedTuple):
    where: str
    words: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.where}: {' '.join(self.words)}"


def messages(*folders: str) -> Iterator[tuple[str, str]]:
    """Yield the texts of our sources, with something in place of what is filled in."""
    for file in (file for folder in folders for file in sorted((ROOT / folder).rglob("*.py"))):
        name = file.relative_to(ROOT)
        tree = ast.parse(file.read_text(encoding="utf-8"))
        inner = {
            id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)
        }
        for node in ast.walk(tree):
            place = f"{name}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.JoinedStr):
                parts = (part.value if isinstance(part, ast.Constant) else FILLED_IN for part in node.values)
                yield place, "".join(map(str, parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner:
                yield place, node.value


def pages() -> Iterator[tuple[str, str]]:
    """Yield what pages show as code: blocks by line, and within sentences."""
    for page in PAGES:
        fenced = False
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            fenced ^= line.strip().startswith("```")
            place = f"{page.relative_to(ROOT)}:{number}"
            for text in [line] if fenced or line.startswith("    ") else re.findall(r"`([^`]+)`", line):
                yield place, text


def printed() -> Iterator[Printed]:
    for where, text in (*messages(*PACKAGES), *pages()):
        for line in re.sub(r"\\\n *", " ", text).splitlines():
            for found in _NAME.finditer(line):
                yield from _command(where, found[1], line[found.end() :])


def _command(where: str, name: str, rest: str) -> Iterator[Printed]:
    """Yield the command that begins here; nothing for the name of one in a sentence."""
    parser, words, value_of = parser_of(name), [name], False
    for word in re.split(r" {2,}| \||[`'\"]? &&|[<>#]", rest.strip())[0].split():
        bare = word if word.startswith("...") else word.rstrip(",.;:)`'\"*")
        bare = re.split(r"[|,]", bare.strip("{}"))[0] if re.search(r"\w[|]\w|\{\w+,", bare) else bare
        verbs = parser.verbs
        if bare in verbs:
            parser = verbs[bare]
        elif bare.startswith("-") and bare != "-":
            value_of = _takes_value(parser, bare)
        elif verbs and len(words) == 1 and _STAND_IN.match(bare):
            break  # any verb
        elif not (value_of or _STAND_IN.match(bare)):
            if verbs and len(words) == 1 and bare not in PROSE:
                words.append(bare)  # a verb that is none
            break
        else:
            value_of = False
        words.append(bare)
        if word[-1] in ",.;:)":
            break
    if len(words) > 1:
        yield Printed(where, tuple(word for word in words if word != "..."))


def parser_of(name: str) -> CommandParser:
    if name not in _parsers:
        _parsers[name] = import_module(PARSERS[name]).build_parser()
    return _parsers[name]


_parsers: dict[str, CommandParser] = {}


def _takes_value(parser: CommandParser, option: str) -> bool:
    return any(option in each.option_strings and each.nargs != 0 for each in parser.arguments)


def refused(command: Printed, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return why its parser does not take a command; that something is missing is prose's right."""

    def wrong(self: argparse.ArgumentParser, message: str) -> NoReturn:
        raise WrongUsage(message)

    monkeypatch.setattr(CommandParser, "error", wrong)
    try:
        parser_of(command.words[0]).parse_args([word.replace("{0}", "1") for word in command.words[1:]])
    except (WrongUsage, argparse.ArgumentTypeError) as error:
        return "" if _OF_PROSE.search(str(error)) else f"{command}: {error}"
    except SystemExit:
        return ""  # --help
    return ""


def test_every_command_in_a_message_or_a_page_is_one_that_its_parser_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commands = sorted(set(printed()))
    assert len(commands) > 250, "they were found"
    assert [why for each in commands if (why := refused(each, monkeypatch))] == []


@pytest.mark.parametrize(
    "folder", ["enclave_launch/diagnostics", "enclave_addons/recording", "enclave_addons/review/checks"]
)
def test_every_option_in_a_remedy_is_one_of_our_commands(folder: str) -> None:
    known = {
        option
        for name in PARSERS
        for each in parsers(parser_of(name))
        for argument in each.arguments
        for option in argument.option_strings
    }
    named = {
        (where, option)
        for where, text in messages(folder)
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", text)
    }
    assert named and [each for each in named if each[1] not in known | OF_OTHERS] == []


@pytest.mark.parametrize(
    "text",
    [
        "secure-keystore renw KEYSTORE",
        "secure-keystore renew KEYSTORE --ca begin",
        "secure-launch --lern DIR",
    ],
)
def test_a_wrong_verb_option_or_choice_is_found(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, rest = shlex.split(text)[0], text.partition(" ")[2]
    (command,) = _command("here", name, rest)
    assert refused(command, monkeypatch)
