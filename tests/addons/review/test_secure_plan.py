"""The command: plans from launch files and saved ones, exit statuses, forms."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_addons.review.verb import main
from enclave_launch.verb.secure_launch import main as secure_launch

PREFIX = str(Path(__file__).parents[3] / "fixtures" / "demo_ws")
REMAP = ("--prefix", PREFIX, "demo_nodes", "talker_listener_remap.launch.xml")
PLAIN = ("--prefix", PREFIX, "demo_nodes", "talker_listener.launch.xml")

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def secure_plan(*words: str | Path) -> tuple[int, str, str]:
        try:
            status = main([*map(str, words)])
        except SystemExit as error:
            status = int(error.code or 0)
        told = capsys.readouterr()
        return status, told.out, told.err

    return secure_plan


@pytest.fixture
def saved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    assert secure_launch(["--dry-run", "--format", "json", *REMAP]) == 0
    file = tmp_path / "plan.json"
    file.write_text(capsys.readouterr().out)
    return file


def test_a_saved_plan_and_the_launch_file_show_the_same(run: Run, saved: Path) -> None:
    status, shown, _ = run("show", saved)
    assert (status, shown) == (
        0,
        "enclave /ear\n  node /ear  (demo_nodes/listener)\n  subscribe: /conversation\n"
        "  and 10 that every node has\n"
        "enclave /speaker\n  node /front/speaker  (demo_nodes/talker)\n  publish: /conversation\n"
        "  and 10 that every node has\n",
    )
    assert run("show", *REMAP)[1] == shown


@pytest.mark.parametrize("part", ["processes", "nodes"])
@pytest.mark.parametrize("verb", ["show", "check", "suggest", "report", "hosts"])
def test_a_saved_plan_whose_parts_do_not_fit_is_one_clear_error(
    verb: str, part: str, run: Run, saved: Path
) -> None:
    document = json.loads(saved.read_text())
    document[part][0]["enclave"] = "/other"
    saved.write_text(json.dumps(document))
    status, _, told = run(verb, saved)
    assert status == 2
    assert "does not fit together" in told and "is in enclave /other" in told


def test_diff_tells_by_its_exit_status_whether_rights_grew(run: Run, saved: Path) -> None:
    assert run("diff", saved, saved)[:2] == (0, "no enclave, node, permission or flow differs\n")
    status, text, _ = run("diff", saved, *PLAIN)
    assert status == 1
    assert "+ node /talker\n" in text and "- enclave /ear\n" in text


def test_flow_between_nodes_and_back(run: Run, saved: Path) -> None:
    there = run("flow", saved, "--from", "/front/speaker", "--to", "/ear")
    assert there[:2] == (
        0,
        "/speaker can influence /ear; the shortest way:\n  /speaker -> /ear by topic /conversation\n",
    )
    back = run("flow", saved, "--from", "/ear", "--to", "/speaker")
    assert back[:2] == (0, "nothing flows from /ear to /speaker, over any number of enclaves\n")
    assert run("flow", saved, "--from", "/ear")[0] == 2
    assert run("flow", saved, "--from", "/ear", "--to", "/nobody")[0] == 2


def test_check_in_a_repository_with_rules(
    run: Run, saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("check", saved)[:2] == (0, "0 errors, 0 warnings\n")
    (tmp_path / "enclaves.review.yaml").write_text("never:\n- {from: /speaker, to: /ear, why: a test}\n")
    status, text, _ = run("check", saved)
    assert status == 1
    assert text.startswith(
        "error: enclaves.review.yaml:2: /speaker must never reach /ear (a test): "
        "/speaker -> /ear by topic /conversation"
    )
    (tmp_path / "accepts.yaml").write_text(
        "never:\n- {from: /speaker, to: /ear}\naccept:\n- {code: flow-forbidden, why: they must talk}\n"
    )
    status, text, _ = run("check", saved, "--expect", "accepts.yaml")
    assert (status, text.splitlines()[-1]) == (0, "0 errors, 0 warnings, 1 accepted")


def test_strict_makes_warnings_errors(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "one.launch.xml"
    file.write_text('<launch><node pkg="demo_nodes" exec="talker"/></launch>')
    assert run("check", "--prefix", PREFIX, file)[0] == 0
    assert run("check", "--prefix", PREFIX, file, "--strict")[0] == 1


def test_check_as_sarif_points_at_lines_below_the_working_directory(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my launch.xml").write_text(
        '<launch>\n<node pkg="demo_nodes" exec="talker">\n<env name="ROS_SECURITY_ENABLE" value="x"/></node></launch>'
    )
    (tmp_path / "enclaves.review.yaml").write_text(
        "accept:\n- {code: no-subscriber, why: recorded elsewhere}\n"
    )
    _, text, _ = run("check", "--prefix", PREFIX, "my launch.xml", "--format", "sarif")
    log = json.loads(text)
    assert log["version"] == "2.1.0"
    results = {result["ruleId"]: result for result in log["runs"][0]["results"]}
    place = results["security-variable-set"]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "my%20launch.xml", "uriBaseId": "SRCROOT"}
    assert place["region"] == {"startLine": 2}
    assert results["no-subscriber"]["suppressions"] == [
        {"kind": "external", "justification": "recorded elsewhere"}
    ]
    assert {rule["id"] for rule in log["runs"][0]["tool"]["driver"]["rules"]} == results.keys()


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "is not the JSON of secure-launch --dry-run"),
        ("[]", "is not the JSON of secure-launch --dry-run"),
        ('{"version": 2}', "is not the JSON of secure-launch --dry-run: 'version'"),
    ],
)
def test_what_is_not_a_plan_is_wrong_usage(run: Run, tmp_path: Path, content: str, why: str) -> None:
    (tmp_path / "x.json").write_text(content)
    status, _, told = run("show", tmp_path / "x.json")
    assert status == 2 and why in told
    assert run("show", tmp_path / "absent.json")[0] == 2


def test_a_key_that_stands_twice_in_the_rules_is_wrong_usage_since_only_one_would_count(
    run: Run, tmp_path: Path
) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text("never: [{from: /a, to: /b}]\naccept: []\nnever: []\n")
    status, _, told = run("check", *PLAIN, "--expect", rules)
    assert (status, told) == (2, f"secure-plan: error: {rules}:3: 'never' is written twice\n")
    rules.write_text("never: [\n")
    assert run("check", *PLAIN, "--expect", rules)[2].startswith(f"secure-plan: error: {rules}:2: ")
    rules.write_text("never: [{from: /a, to: /b}]\naccept: []\n")
    assert run("check", *PLAIN, "--expect", rules)[0] == 0


def test_a_launch_file_that_changes_the_working_directory_does_not_move_what_is_written(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "a.launch.py").write_text(
        "import os\nfrom launch import LaunchDescription\n"
        f"os.chdir({str(tmp_path / 'elsewhere')!r})\n"
        "def generate_launch_description():\n    return LaunchDescription([])\n"
    )
    monkeypatch.chdir(tmp_path)
    assert run("report", "-o", "report.html", "a.launch.py")[0] == 0
    assert (tmp_path / "report.html").is_file() and not [*(tmp_path / "elsewhere").iterdir()]


def test_a_working_directory_that_was_removed_is_wrong_usage(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.launch.xml").write_text("<launch/>")
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    assert run("check", tmp_path / "a.launch.xml")[0] == 0
    (tmp_path / "gone").rmdir()
    status, _, told = run("check", tmp_path / "a.launch.xml")
    assert (status, told) == (
        2,
        "secure-plan: error: the working directory: No such file or directory\n",
    )


def test_what_has_no_effect_on_a_saved_plan_is_wrong_usage(run: Run, saved: Path) -> None:
    for words in (
        ("--enclave-scope", "node"),
        ("--policy", "absent.xml"),
        ("count:=3",),
        ("--accept-patterns",),
    ):
        status, _, told = run("check", saved, *words)
        assert (status, told) == (
            2,
            f"secure-plan: error: {words[0]} has no effect: {saved} is a saved plan; "
            "plan the launch file again with it\n",
        )
    assert run("diff", saved, *PLAIN, "--enclave-scope", "node")[0] in (0, 1)


def test_suggest_on_a_shared_enclave(run: Run) -> None:
    status, text, _ = run("suggest", *PLAIN)
    assert (status, text) == (
        0,
        "split /: saves 2 permissions\n  /listener would lose: publish /chatter\n"
        "  /talker would lose: subscribe /chatter\n",
    )
