"""Plans for reports: a small robot, one with names that try to break out of a page, one of 500 nodes."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence

import pytest

from enclave_addons.review.checks import check_plan
from enclave_addons.review.contents import ReportContents, report_contents
from enclave_launch import DryRun
from tests.addons.review.conftest import ROBOT, Asked, document, interface, process
from tests.addons.review.report.browser import Page, browser, chromium

HOSTILE = (
    "</script><script>window.broken=1</script>",
    "<img src=x onerror=window.broken=1>",
    "--><svg/onload=window.broken=1>",
    "\" onmouseover=\"window.broken=1' x='",
    "`\\u2028]]>;alert(1)//${window.broken=1}",
    "[x](javascript:window.broken=1)|a`b",
    'quote" \\" end\\',
    "\x1b[31mred\u202edesrever",
)
"""What a launch file may write in the place of a name."""


def robot() -> DryRun:
    """The camera, the planner and the base; the planner has a wildcard and a name from a remap rule."""
    plan = document(ROBOT)
    node = next(node for node in plan["nodes"] if node["fqn"] == "/planner")
    node["interfaces"][2]["remapped_by"] = ["plan:=path at bringup.launch.xml:9"]
    node["interfaces"].append({**interface("subscribe", "/map/*"), "note": "--accept-patterns"})
    plan["enclaves"]["/planner"]["subscribe"].append("/map/*")
    plan["enclaves"]["/logger"]["publish"].append("/of_policy")
    plan["processes"] = [
        process(fqn="/camera/driver", enclave="/camera", launch_file="bringup.launch.xml"),
        process(fqn="/tool", launch_file="bringup.launch.xml", line=12),
    ]
    plan["enclaves"]["/camera"]["permissions_unknown"] = ["/camera/helper"]
    return DryRun(**plan)


def hostile(places: Sequence[str] = (HOSTILE[1],)) -> DryRun:
    """Every kind of name is each of ``HOSTILE``; each node is alone in its enclave.

    ``places``: those of its interfaces, in turn."""
    enclaves: dict[str, dict[str, Asked]] = {}
    for number, name in enumerate(HOSTILE):
        asked = {"publish": [name], "subscribe": [name], "call_services": [name], "serve_actions": [name]}
        enclaves[f"/{number}{name}"] = {f"/node{name}": asked}
    plan = document(enclaves)
    for node in plan["nodes"]:
        node["program"] = HOSTILE[0]
        for item, place in zip(node["interfaces"], itertools.cycle(places)):
            item.update(place=place, written=HOSTILE[2], note=HOSTILE[3], type=HOSTILE[0])
    return DryRun(**plan)


def large(nodes: int = 500) -> DryRun:
    """Nodes in chains, three to an enclave, with a service for every fifth."""
    enclaves: dict[str, dict[str, Asked]] = {}
    for number in range(nodes):
        area = f"/area_{number // 50}"
        asked: Asked = {
            "publish": [f"{area}/out_{number}", f"{area}/state_{number}"],
            "subscribe": [
                f"{area}/out_{number - 1}",
                f"{area}/state_{number - 7}",
                f"/area_0/state_{number % 50}",
            ],
        }
        if number % 5 == 0:
            asked["serve_services"] = [f"{area}/reset_{number}"]
        enclaves.setdefault(f"{area}/e{number // 3}", {})[f"{area}/node_{number}"] = asked
    return DryRun(**document(enclaves))


def contents(plan: DryRun, title: str = "robot.launch.xml") -> ReportContents:
    return report_contents(plan, [(told, None) for told in check_plan(plan)], title=title)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    if chromium() is None and os.environ.get("CI") != "true":
        pytest.skip("Chromium is not installed (apt install chromium)")
    with browser() as opened:
        yield opened
