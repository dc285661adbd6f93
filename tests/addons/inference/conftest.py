"""Programs as text in, what inference finds out."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_paths

Infer = Callable[..., InferredSystem]


@pytest.fixture(autouse=True)
def kept_answers(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of kept answers, one for all tests; not that of whoever runs them."""
    folder = tmp_path_factory.getbasetemp() / "cached-answers"
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    return folder


@pytest.fixture
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have every program analysed, also one that was analysed by another engine or under other limits before."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")


@pytest.fixture
def infer(tmp_path: Path) -> Infer:
    """``infer(main, **{"helper.py": ...})``: writes the files into one folder and infers from it."""

    def run(main: str, files: dict[str, str] | None = None) -> InferredSystem:
        for name, text in {"main.py": main, **(files or {})}.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(textwrap.dedent(text), encoding="utf-8")
        return infer_paths([tmp_path])

    return run


@pytest.fixture
def names(infer: Infer) -> Callable[..., list[str]]:
    """The names of all endpoints of a program, sorted, parameters as ``param:x``, unknown as ``?``."""

    def run(main: str, files: dict[str, str] | None = None) -> list[str]:
        system = infer(main, files)
        return sorted({str(endpoint.name) for node in system.nodes for endpoint in node.endpoints})

    return run


@pytest.fixture
def node_body(names: Callable[..., list[str]]) -> Callable[..., list[str]]:
    """The names made by statements inside ``__init__`` of a node (``P`` publishes a text)."""

    def run(body: str, before: str = "", after: str = "") -> list[str]:
        program = "\n".join(
            (
                "import sys",
                "import rclpy",
                "from rclpy.node import Node",
                "from std_msgs.msg import String",
                textwrap.dedent(before),
                "class N(Node):",
                "    def __init__(self):",
                "        super().__init__('n')",
                textwrap.indent(textwrap.dedent(body), " " * 8),
                textwrap.indent(textwrap.dedent(after), " " * 4),
                "    def P(self, name):",
                "        self.create_publisher(String, name, 10)",
                "def main():",
                "    rclpy.init()",
                "    rclpy.spin(N())",
                "main()",
            )
        )
        return names(program)

    return run
