"""Folders of library documents as a user writes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

QOS = "{history: SYSTEM_DEFAULT, reliability: SYSTEM_DEFAULT}"
WriteDocument = Callable[..., Path]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "library"
    place.mkdir()
    return place


@pytest.fixture
def write_document(folder: Path) -> WriteDocument:
    """``write_document("pkg/name", "section of codegen", "publishers: a b", ...)``: one word, one name."""

    def write(stem: str, section: str, *lists: str, parameters: str = "") -> Path:
        lines = ["nodl_version: 2", "codegen:", "  enclave_launch:"]
        lines += [f"    {line}" for line in section.strip().splitlines()]
        lines += (
            ["parameters:", *(f"  {line}" for line in parameters.strip().splitlines())] if parameters else []
        )
        for text in lists:
            category, _, names = text.partition(":")
            qos = f", qos: {QOS}" if category in ("publishers", "subscriptions") else ""
            lines.append(f"{category}:")
            lines += [f"  - {{name: {name}, type: p/T{qos}}}" for name in names.split()]
        path = folder / f"{stem}.nodl.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(lines) + "\n")
        return path

    return write
