"""docs/commands.md and the man pages say what the parsers say."""

import re
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def written(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    monkeypatch.setenv("COLUMNS", "100")  # the tool sets it, too: undone after the test
    for variable in ("ROS_SECURITY_KEYSTORE", "ROS_DISTRO"):
        monkeypatch.setenv(variable, "")
    loader = SourceFileLoader("command_reference", str(ROOT / "tools" / "command-reference"))
    spec = spec_from_loader("command_reference", loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    files: dict[str, str] = module.files()
    return files


def test_the_reference_is_what_the_parsers_say(monkeypatch: pytest.MonkeyPatch) -> None:
    for path, text in written(monkeypatch).items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, (
            f"{path} is old: run tools/command-reference"
        )


def test_each_verb_has_its_heading() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    verbs = ("secure-plan diff", "secure-keystore verify", "secure-nodl infer")
    for heading in ("## secure-launch", *(f"### {verb}" for verb in verbs), "#### secure-nodl library check"):
        assert f"\n{heading}\n" in text


def test_the_index_by_task_leads_to_headings() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    headings = {line.lstrip("# ").replace(" ", "-") for line in text.splitlines() if line.startswith("#")}
    targets = set(re.findall(r"\(#([a-z-]+)\)", text))
    assert len(targets) > 30 and targets <= headings
