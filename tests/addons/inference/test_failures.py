"""A mistake of the analyser in one program is a gap of that program, and nothing worse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.inference import analysis, infer_executable, infer_paths, system
from enclave_addons.inference.models import ros

PROGRAM = """\
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Talker(Node):
    def __init__(self, names):
        super().__init__('talker')
        self.made = [self.create_publisher(String, f'{name}/out', 10) for name in names]
        for name in names:
            if name != 'b' and self.made:
                self.topic = {'a': 'x'}[name]
        self.create_subscription(String, self.topic, lambda message: None, 10)

def main():
    try:
        rclpy.init()
        rclpy.spin(Talker(['a', 'b']))
    finally:
        rclpy.shutdown()

main()
"""
ERRORS = [RecursionError, MemoryError, ValueError, KeyError, AssertionError]
TABLES = ["expressions", "statements", "callables", "attributes"]
PLACES = [(name, kind) for name in TABLES for kind in getattr(analysis.TABLES, name)]


def _failing(error: type[Exception]) -> Callable[..., Any]:
    def fail(*_: object, **__: object) -> Any:
        raise error("injected")

    return fail


def _installed(prefix: Path) -> Path:
    (prefix / "share/ament_index/resource_index/packages").mkdir(parents=True)
    (prefix / "share/ament_index/resource_index/packages/demo").touch()
    file = prefix / "lib/demo/talker"
    file.parent.mkdir(parents=True)
    file.write_text("#!/usr/bin/python3\n" + PROGRAM, encoding="utf-8")
    file.chmod(0o755)
    return file


@pytest.mark.parametrize("place", PLACES, ids=lambda place: f"{place[0]} {place[1].__name__}")
def test_a_failing_handler_is_a_gap_and_a_sound_one_is_not(
    place: tuple[str, type], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = _installed(tmp_path)
    whole = infer_executable("demo", "talker", prefixes=[str(tmp_path)])
    assert [str(e.name) for n in whole.interfaces for e in n.endpoints][:2] == ["a/out", "b/out"]
    assert not any(node.gaps for node in whole.interfaces)
    handlers = getattr(analysis.TABLES, place[0])
    for error in ERRORS:
        called: list[object] = []

        def fail(*_: object, error: type[Exception] = error, called: list[object] = called) -> Any:
            called.append(error)
            raise error("injected")

        with monkeypatch.context() as patch:
            patch.setitem(handlers, place[1], fail)
            patch.setenv("XDG_CACHE_HOME", str(tmp_path / f"cache {error.__name__}"))
            found = infer_executable("demo", "talker", prefixes=[str(tmp_path)])
            listed = infer_paths([file])
        if called:
            assert found.why or any(node.gaps for node in found.interfaces)
            assert listed.gaps


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("name", ["interfaces_of", "unsettled_places"])
def test_what_comes_after_the_run_may_fail_too(
    name: str, error: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = _installed(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(analysis, name, _failing(error))
    monkeypatch.setattr(system, name, _failing(error))
    found = infer_executable("demo", "talker", prefixes=[str(tmp_path)])
    assert "the analysis failed" in found.why
    assert any("the analysis failed" in gap.why for gap in infer_paths([file]).gaps)


def test_a_model_that_fails_leaves_the_other_program_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(ros.NODE_METHODS, "create_client", _failing(ZeroDivisionError))
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text(PROGRAM)
    bad.write_text(PROGRAM.replace("self.made = ", "self.create_client(String, 's')\n        self.made = "))
    found = infer_paths([tmp_path])
    assert {gap.source.file for gap in found.gaps} == {str(bad)}
    assert "/a/out" in {f"/{e.name}" for n in found.nodes if n.source.file == str(good) for e in n.endpoints}
