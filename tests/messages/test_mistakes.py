"""Each mistake of the table is answered as it says, in three lines at most, and its repair works there."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from tests.messages.mistakes import VARIABLES, Mistake, answered, entries, make_folder

ENTRIES = list(entries())
OF_PYTHON = re.compile(
    r"Traceback|object has no attribute|\[Errno|is not iterable|Error:|__init__|NoneType|Field required"
)
"""Words of Python or pydantic, which tell a user nothing."""
FILLED_IN = re.compile(r"\b[A-Z][A-Z_]+\b|\.\.\.|--help$")
"""Repairs in which the user must fill something in; and those that only show help."""


@pytest.fixture(scope="session")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mistakes") / "template"
    folder.mkdir()
    make_folder(folder)
    return folder


@pytest.fixture
def here(template: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "200")
    folder = tmp_path / "here"
    shutil.copytree(template, folder, symlinks=True)
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize("entry", ENTRIES, ids=[each.command for each in ENTRIES])
def test_a_mistake_is_answered_as_the_table_says(entry: Mistake, here: Path) -> None:
    found = answered(shlex.split(entry.command))
    assert (found.answer, found.status) == (entry.answer, entry.status)


@pytest.mark.parametrize("entry", ENTRIES, ids=[each.command for each in ENTRIES])
def test_an_answer_has_three_lines_at_most_and_no_python(entry: Mistake) -> None:
    lines = [line for line in entry.answer.splitlines() if not line.startswith("usage: ")]
    assert entry.status != 0 and 1 <= len(lines) <= 3
    assert not OF_PYTHON.search(entry.answer)


WITH_REPAIR = [
    (each, found[1])
    for each in ENTRIES
    if (found := re.search(r"^try: (secure-.*)$", each.answer, re.M)) and not FILLED_IN.search(found[1])
]


@pytest.mark.parametrize(("entry", "repair"), WITH_REPAIR, ids=[repair for _, repair in WITH_REPAIR])
def test_a_repair_works_where_it_was_printed(entry: Mistake, repair: str, here: Path) -> None:
    answered(shlex.split(entry.command))
    words = shlex.split(repair.replace("{here}", str(here)))
    if words[:2] == ["secure-launch", "--secure"]:
        words.insert(1, "--provision-only")  # the nodes of the demo need DDS
    assert answered(words).status in ((0, 1) if words[1] in ("check", "doctor") else (0,))
    if words[1] == "create":  # then the first command finds a keystore
        again = answered(shlex.split(entry.command.replace("stuff", "stuff/keystore")))
        assert "there is no keystore" not in again.answer and "is not a keystore" not in again.answer


def test_the_table_covers_the_four_commands_with_seventy_mistakes() -> None:
    assert len(ENTRIES) >= 70
    assert {shlex.split(each.command)[0] for each in ENTRIES} == {
        "secure-launch", "secure-plan", "secure-keystore", "secure-nodl",
    }  # fmt: skip
    assert len(WITH_REPAIR) >= 15
