"""The help of all commands has one form, and says first what belongs to the verb."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_addons.review import verb as secure_plan
from enclave_common.command_line import CommandParser, Option, parsers, read_command_line
from enclave_launch.verb import options as secure_launch
from keystore import verb as secure_keystore
from nodl import verb as secure_nodl

COMMANDS = (secure_launch, secure_plan, secure_keystore, secure_nodl)
SHARED: tuple[Option, ...] = (("--prefix DIR", {}, "where packages are"),)


def every_parser() -> Iterator[CommandParser]:
    for command in COMMANDS:
        yield from parsers(command.build_parser())


def help_of(*words: str) -> str:
    (found,) = (each for each in every_parser() if each.prog == " ".join(words))
    return found.format_help()


@pytest.fixture
def verb() -> CommandParser:
    parser = CommandParser(prog="tool check", description="Check it.", epilog="exit status: 0 good")
    parser.add_options((("plan PLAN", {"nargs": "+"}, "what to check"), ("--strict", {}, "more")))
    parser.add_options(SHARED)
    return parser


def test_the_usage_is_one_line_without_the_options(verb: CommandParser) -> None:
    assert verb.format_usage() == "usage: tool check [options] PLAN ...\n"


def test_an_option_that_cannot_be_left_out_is_in_the_usage(verb: CommandParser) -> None:
    verb.add_options((("-o --output DIR", {"required": True}, "where"),))
    assert verb.format_usage() == "usage: tool check -o DIR [options] PLAN ...\n"


def test_folded_options_are_only_named_after_those_of_the_verb(verb: CommandParser) -> None:
    verb.fold(SHARED, "tool --help")
    shown = verb.format_help()
    assert "where packages are" not in shown
    assert "options described by tool --help:\n  --prefix\n" in shown
    assert shown.index("--strict") < shown.index("--prefix") < shown.index("exit status")
    assert verb.parse_args(["a", "--prefix", "b"]).prefix == "b"


def test_options_that_are_not_folded_are_described(verb: CommandParser) -> None:
    assert "where packages are" in verb.format_help()


def test_examples_keep_their_lines_and_paragraphs_are_filled() -> None:
    tool = CommandParser(prog="tool")
    tool.add_verbs()
    text = "Do it.\n\nOne\nparagraph.\n\n  tool a   first\n  tool b   second\n\nexit status: 0 good\n"
    shown = tool.add_verb("do", text).format_help()
    assert "    do        Do it.\n" in tool.format_help()
    assert "\nOne paragraph.\n\n  tool a   first\n  tool b   second\n" in shown
    assert shown.endswith("\n\nexit status: 0 good\n")


def test_the_first_help_has_eight_verbs_and_twelve_options_and_says_where_the_rest_is() -> None:
    shown = [command.build_parser(first=True).format_help() for command in COMMANDS]
    verbs = [name for text in shown for name in re.findall(r"^    ([a-z][a-z-]+) ", text, re.M)]
    assert len(verbs) == 8
    options = set(re.findall(r"^  (?:-\w, )?(--[a-z][a-z-]+)", shown[0], re.M))
    assert len(options - {"--help", "--help-all", "--version", "--quiet", "--verbose"}) == 12
    for command, text in zip(("launch", "plan", "keystore", "nodl"), shown, strict=True):
        assert text.rstrip().endswith(f": secure-{command} --help-all") and "\nexamples:\n" in text


def test_the_whole_help_has_everything(capsys: pytest.CaptureFixture[str]) -> None:
    for command in COMMANDS:
        with pytest.raises(SystemExit) as ended:
            command.build_parser(first=True).parse_args(["--help-all"])
        assert ended.value.code == 0
        assert capsys.readouterr().out == command.build_parser().format_help()


def test_an_option_has_one_name_and_an_earlier_one_is_understood() -> None:
    shown = help_of("secure-keystore", "status")
    assert "--expiring-within TIME" in shown and "--within " not in shown
    for word in ("--expiring-within", "--within"):
        line = read_command_line(secure_keystore.build_parser(), ["status", "ks", word, "5d"])
        assert line.options.expiring_within == "5d"


def test_every_help_has_the_same_headings() -> None:
    for parser in every_parser():
        shown = parser.format_help()
        assert shown.count("usage:") == 1, parser.prog
        headings = re.findall(r"\n\n(\w[^\n]*):\n  ", shown)
        assert all(each[0].islower() or each.startswith("PIN ") for each in headings), (parser.prog, headings)


def test_every_verb_is_a_sentence_in_the_list_of_its_command() -> None:
    for parser in every_parser():
        rows = parser.format_help().partition("\nverbs:\n")[2].split("\n\n")[0]
        for name in parser.verbs:
            assert re.search(rf"^ +{name}\s+[A-Z][^.]*(\.[^.]*)?\.$", rows, re.M), (parser.prog, name, rows)


def test_a_verb_of_secure_plan_names_the_options_of_a_launch_once() -> None:
    shown = help_of("secure-plan", "check")
    assert shown.count("--nodl") == 1
    assert "options described by secure-launch --help-all:" in shown
    assert "--nodl FILE|DIR" in secure_launch.build_parser().format_help()


def test_a_verb_of_secure_keystore_leaves_common_options_to_create() -> None:
    assert "options described by secure-keystore create --help:" in help_of("secure-keystore", "renew")
    assert "--ca-passphrase-fd N" in help_of("secure-keystore", "create")


def test_each_exit_status_of_a_help_is_in_the_table() -> None:
    page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
    table = set(re.findall(r"^\| (\d+) \|", page, re.M))
    assert {"0", "1", "2", "75", "130"} <= table
    for parser in every_parser():
        _, _, status = (parser.epilog or "").partition("exit status")
        assert set(re.findall(r"(?:^|[:,;] )(\d+) ", status.replace("\n", " "))) <= table, parser.prog
