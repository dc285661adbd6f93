"""What is mistyped is answered with what was probably meant, and only with that."""

import pytest

from enclave_common.command_line import FLAG, CommandParser, one_of, read_command_line
from enclave_common.words import did_you_mean


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("takler", ["talker", "listener"], "talker"),
        ("TALKER", ["talker"], "talker"),
        ("demo_node", ["demo_nodes", "demo_nodes_cpp"], "demo_nodes"),
        ("--dryrun", ["--dry-run", "--secure"], "--dry-run"),
        ("/speeker", ["/speaker", "/ear"], "/speaker"),
        ("--form", ["--for", "--format"], "--format"),
        ("--fro", ["--for", "--format"], "--for"),
    ],
)
def test_what_was_probably_meant(word: str, known: list[str], meant: str) -> None:
    assert did_you_mean(word, known) == f"; did you mean {meant!r}?"


@pytest.mark.parametrize(("word", "known"), [("nav2", ["talker"]), ("x", []), ("talker", ["talker"])])
def test_nothing_where_nothing_is_alike(word: str, known: list[str]) -> None:
    assert did_you_mean(word, known) == ""


def parser() -> CommandParser:
    made = CommandParser(prog="tool")
    made.add_verbs()
    verify = made.add_verb("verify", "Verify it.")
    verify.add_options((("--format", one_of("text", "json"), ""),))
    return made


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["verfiy"], "did you mean 'verify'?"),
        (["verify", "--fromat", "json"], "did you mean '--format'?"),
        (["verify", "--format", "jsno"], "did you mean 'json'?"),
        (["verify", "--form", "json"], "did you mean '--format'?"),  # abbreviations are not taken
    ],
)
def test_slips_of_the_command_line(words: list[str], answer: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        read_command_line(parser(), words)
    assert ended.value.code == 2
    assert answer in capsys.readouterr().err


def test_the_neighbour_that_is_right_is_read() -> None:
    assert parser().parse_args(["verify", "--format", "json"]).format == "json"


def test_far_off_words_get_no_suggestion(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(["launch"])
    assert "did you mean" not in capsys.readouterr().err


def test_an_option_of_another_verb_is_not_suggested(capsys: pytest.CaptureFixture[str]) -> None:
    made = parser()
    made.add_verb("list", "List them.").add_options((("--all", FLAG, ""),))
    for words in (["verify", "--all"], ["list", "--formt", "json"]):
        with pytest.raises(SystemExit):
            read_command_line(made, words)
        told = capsys.readouterr().err
        assert "did you mean" not in told and f"tool {words[0]}: error: unrecognized" in told
    with pytest.raises(SystemExit):
        read_command_line(made, ["list", "--al"])
    assert "did you mean '--all'?" in capsys.readouterr().err
