"""The argument scan, summed up per file, agrees with the plain walk over everything."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import (
    evaluation_surroundings,
    top_description,
)
from enclave_launch.host.plan_host import PlanHost


@pytest.fixture
def folder(files: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = files(
        needs__launch__xml='<arg name="req"/>',
        gives__launch__xml='<include file="$(env D)/needs.launch.xml"><arg name="req" value="1"/></include>',
        hidden__launch__xml='<group if="false"><include file="$(env D)/needs.launch.xml"/></group>',
        conditional__launch__xml='<arg name="req" if="false"/>',
        behind_reset__launch__xml='<group forwarding="false"><arg name="req"/></group>',
        sibling__launch__xml='<include file="$(env D)/pair.launch.xml"/>',
        pair__launch__xml="""
            <include file="$(env D)/empty.launch.xml"><arg name="req" value="1"/></include>
            <include file="$(env D)/needs.launch.xml"/>
        """,
        empty__launch__xml="",
    )
    monkeypatch.setenv("D", str(folder))
    return folder


@pytest.mark.parametrize("name", ["needs", "gives", "hidden", "conditional", "behind_reset", "pair"])
def test_the_public_walk_finds_the_same_names(folder: Path, name: str) -> None:
    from enclave_launch.description.argument_scan import _summarize

    host = PlanHost()
    with evaluation_surroundings(host):
        description: Any = top_description(str(folder / f"{name}.launch.xml"), ())
        walked = [argument.name for argument in description.get_launch_arguments()]
        assert list(_summarize(description).declared) == walked
