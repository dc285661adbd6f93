"""``diff`` with a revision of a git repository: the files as they were, and nothing of the repository changed."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from enclave_addons.review.verb import main

PREFIX = str(Path(__file__).parents[3] / "fixtures" / "demo_ws")
NOT_COMPARED = "Not compared, taken as installed now on both sides: demo_nodes"
NODE = '<node pkg="demo_nodes" exec="{}" name="{}"/>'


def git(folder: Path, *words: str) -> str:
    identity = ("-c", "user.name=t", "-c", "user.email=t@example.org", "-c", "init.defaultBranch=main")
    done = subprocess.run(["git", *identity, *words], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The first revision starts a talker; the second a listener, too, by a file that is included."""
    folder = tmp_path / "repo"
    (folder / "launch").mkdir(parents=True)
    git(folder, "init", "-q")
    main_file, more = folder / "launch" / "main.launch.xml", folder / "launch" / "more.launch.xml"
    main_file.write_text('<launch><include file="$(dirname)/more.launch.xml"/></launch>')
    for number, nodes in enumerate((["talker"], ["talker", "listener"])):
        more.write_text(f"<launch>{''.join(NODE.format(each, each) for each in nodes)}</launch>")
        git(folder, "add", "-A")
        git(folder, "commit", "-q", "-m", str(number))
    monkeypatch.chdir(folder)
    return folder


def diff(capsys: pytest.CaptureFixture[str], before: str, *after: str) -> tuple[int, str, str]:
    status = main(["diff", before, "--prefix", PREFIX, *after])
    told = capsys.readouterr()
    return status, told.out, told.err


@pytest.mark.parametrize(
    "before", ["HEAD~1:", "HEAD~1:launch/main.launch.xml", "HEAD~1:./launch/main.launch.xml"]
)
def test_what_a_commit_added(repository: Path, capsys: pytest.CaptureFixture[str], before: str) -> None:
    status, text, _ = diff(capsys, before, "launch/main.launch.xml")
    assert (status, text.splitlines()[0]) == (1, "+ node /listener")
    assert "subscribe /chatter" in text
    status, text, _ = diff(capsys, "HEAD:", "launch/main.launch.xml")
    assert (status, text.splitlines()) == (0, ["no enclave, node, permission or flow differs", NOT_COMPARED])


def test_arguments_are_for_both_launch_files(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = repository / "launch" / "named.launch.xml"
    file.write_text(
        '<launch><arg name="ns"/><node pkg="demo_nodes" exec="talker" namespace="$(var ns)"/></launch>'
    )
    git(repository, "add", "-A")
    git(repository, "commit", "-q", "-m", "named")
    for before in ("HEAD:", "HEAD:launch/named.launch.xml", str(file)):
        assert diff(capsys, before, str(file), "ns:=robot1")[:2] == (
            0,
            "no enclave, node, permission or flow differs\n"
            + f"{NOT_COMPARED}\n" * before.startswith("HEAD"),
        )


def test_what_is_not_committed_yet_counts_to_the_work_tree(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (repository / "launch" / "more.launch.xml").write_text(
        f"<launch>{NODE.format('talker', 'talker')}</launch>"
    )
    status, text, _ = diff(capsys, "HEAD:", "launch/main.launch.xml")
    assert (status, text.splitlines()[0]) == (0, "- node /listener")
    assert git(repository, "status", "--porcelain") == " M launch/more.launch.xml\n"
    assert git(repository, "worktree", "list").count("\n") == 1


def test_a_saved_plan_of_a_revision(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from enclave_launch.verb.secure_launch import main as secure_launch

    assert secure_launch(["--dry-run", "--format", "json", "--prefix", PREFIX, "launch/main.launch.xml"]) == 0
    (repository / "plan.json").write_text(capsys.readouterr().out)
    git(repository, "add", "-A")
    git(repository, "commit", "-q", "-m", "plan")
    (repository / "plan.json").write_text("{}")
    assert diff(capsys, "HEAD:plan.json", "launch/main.launch.xml")[0] == 0
    assert diff(capsys, "HEAD~1:plan.json", "launch/main.launch.xml")[0] == 2


@pytest.mark.parametrize(
    ("before", "why"),
    [
        ("nosuch:", "no such revision: nosuch"),
        ("HEAD:launch/other.launch.xml", "launch/other.launch.xml is not in revision HEAD"),
        ("HEAD:../../etc/passwd", "is not in revision HEAD"),
        ("--output=x:", "unrecognized arguments"),
    ],
)
def test_what_there_is_not_is_wrong_usage(
    repository: Path, capsys: pytest.CaptureFixture[str], before: str, why: str
) -> None:
    try:
        status, _, told = diff(capsys, before, "launch/main.launch.xml")
    except SystemExit as error:
        status, told = int(error.code or 0), capsys.readouterr().err
    assert status == 2 and why in told


def test_a_launch_file_outside_of_any_repository(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outside = repository.parent / "f.launch.xml"
    outside.write_text("<launch/>")
    status, _, told = diff(capsys, "HEAD:", str(outside))
    assert status == 2 and "git" in told
