"""What nobody asks for any more is told, and removed on request."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from keystore import LaunchHold, Policy, create_tool_enclave, list_enclaves, provision
from keystore.formats.policy_xml import policy_xml
from keystore.verb import main
from tests.keystore.kit import filled, options, policy


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = filled(tmp_path / "ks", ["/a", "/gone"])
    create_tool_enclave(root, "observe", options=options())
    (tmp_path / "policy.xml").write_bytes(policy_xml(Policy((policy("/a"),))))
    return root


def test_apply_policy_tells_what_is_left_over_and_removes_it_on_request(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["apply-policy", str(root), str(root.parent / "policy.xml")]
    assert main(words) == 0
    assert "left over, not in the policy: /gone (--prune" in capsys.readouterr().out
    assert "/gone" in list_enclaves(root)
    assert main([*words, "--prune"]) == 0
    assert "/gone: removed" in capsys.readouterr().out
    assert main(words) == 0
    assert "left over" not in capsys.readouterr().out
    tools = [name for name in list_enclaves(root) if name.startswith("/tools/")]
    assert list_enclaves(root) == ["/a", *tools] and tools


def test_a_launch_tells_what_it_no_longer_asks_for(tmp_path: Path) -> None:
    root = filled(tmp_path / "ks", ["/others"])
    for asked, told in ((("/a", "/b"), False), (("/a",), True)):
        hold = LaunchHold(root, "/x.launch.xml")
        report = provision(root, [policy(name) for name in asked], options=options(launch=hold))
        hold.close()
        assert any("left over" in one and "/b" in one for one in report.warnings) is told
        assert not any("/others" in one for one in report.warnings)


def test_of_an_enclave_that_another_launch_uses_only_the_share_may_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "ks"
    for owner, asked in (("/x.launch.xml", "/both"), ("/y.launch.xml", "/both"), ("/x.launch.xml", "/own")):
        hold = LaunchHold(root, owner)
        report = provision(root, [policy(asked)], options=options(launch=hold))
        hold.close()
    (warning,) = report.warnings
    assert "/both: other launches use this too" in warning and "secure-keystore remove" not in warning
    assert main(shlex.split(warning.partition("secure-keystore ")[2])) == 0
    capsys.readouterr()
    assert main(["shares", str(root)]) == 0
    assert capsys.readouterr().out == "'/y.launch.xml': /both\n"
