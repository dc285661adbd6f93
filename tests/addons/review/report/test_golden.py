"""What is printed for the demo workspace, whole: a change of it is looked at before it is committed.

secure-plan VERB --prefix fixtures/demo_ws ... > tests/addons/review/report/golden/NAME   from the repository
"""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.review.verb import main

ROOT = Path(__file__).parents[4]
GOLDEN = Path(__file__).parent / "golden"
DEMO = ("--prefix", "fixtures/demo_ws", "demo_nodes")
SERVICES = (*DEMO, "services_actions.launch.xml")
BEFORE = "fixtures/demo_ws/share/demo_nodes/launch/talker_listener.launch.xml"
PRINTED: dict[str, tuple[str, ...]] = {
    "report.md": ("report", *SERVICES, "--format", "markdown"),
    "report.dot": ("report", *SERVICES, "--format", "dot"),
    "report.mermaid": ("report", *SERVICES, "--format", "mermaid"),
    "check.txt": ("check", *DEMO, "talker_listener.launch.xml"),
    "diff.md": ("diff", BEFORE, *DEMO, "talker_listener_remap.launch.xml", "--format", "markdown"),
    "flow.txt": ("flow", *SERVICES),
    "suggest.txt": ("suggest", *DEMO, "talker_listener.launch.xml"),
}


@pytest.mark.parametrize("name", sorted(PRINTED))
def test_the_output_is_the_one_that_was_looked_at(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    main([*PRINTED[name]])
    printed = capsys.readouterr().out
    assert str(ROOT) not in printed
    assert printed == (GOLDEN / name).read_text(encoding="utf-8")
