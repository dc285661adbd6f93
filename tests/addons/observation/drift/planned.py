"""A graph that is exactly what a plan says, to be changed by the tests."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from keystore import Operation
from keystore.formats.permissions_names import dds_topics
from tests.addons.observation.graph.made import Made

ROOT = Path(__file__).parents[4]
DEMO_WS = ROOT / "fixtures" / "demo_ws"
_OPERATIONS = {
    "publish": Operation.PUBLISH,
    "subscribe": Operation.SUBSCRIBE,
    "serve_services": Operation.REPLY,
    "call_services": Operation.REQUEST,
    "serve_actions": Operation.EXECUTE,
    "call_actions": Operation.CALL,
}


@lru_cache(maxsize=8)
def _dry_run(words: tuple[str, ...]) -> str:
    command = [
        sys.executable,
        "-m",
        "enclave_launch",
        "--prefix",
        str(DEMO_WS),
        "--dry-run",
        "--format",
        "json",
        *words,
    ]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout


def plan(*words: str) -> dict[str, Any]:
    """The JSON of a dry run in the demo workspace; each call gives one of its own."""
    document: dict[str, Any] = json.loads(_dry_run(words))
    return document


def dds_type(interface_type: str, topic: str) -> str:
    """As rmw mangles it."""
    kind = "srv" if topic[:2] in ("rq", "rr") else "msg"
    package, kind, name = (interface_type or f"demo/{kind}/Any").split("/")
    ending = {"rq": "_Request", "rr": "_Response"}.get(topic.partition("/")[0], "")
    if kind == "action":
        part = topic.rpartition("/_action/")[2]
        if part.startswith("cancel_goal"):
            return f"action_msgs::srv::dds_::CancelGoal{ending}_"
        if part == "status":
            return "action_msgs::msg::dds_::GoalStatusArray_"
        if part == "feedback":
            return f"{package}::action::dds_::{name}_FeedbackMessage_"
        name += "_SendGoal" if part.startswith("send_goal") else "_GetResult"
    return f"{package}::{kind}::dds_::{name}{ending}_"


def commands(interface: Mapping[str, Any]) -> list[str]:
    """The DDS endpoints of one interface of a plan."""
    publish, subscribe = dds_topics(_OPERATIONS[interface["operation"]], interface["name"])
    found = [f"writer {topic} {dds_type(interface['type'], topic)}" for topic in sorted(publish)]
    return found + [f"reader {topic} {dds_type(interface['type'], topic)}" for topic in sorted(subscribe)]


def running(document: Mapping[str, Any], made: Made, *, without: str = "") -> dict[str, str]:
    """Every node of the plan but ``without`` in a participant of its own; the participants by node."""
    participants = {}
    for number, node in enumerate(document["nodes"], 1):
        if node["fqn"] == without:
            continue
        participant = made.participant(number, pid=1000 + number)
        all_commands = [
            line for each in node["interfaces"] if "*" not in each["name"] for line in commands(each)
        ]
        made.listed(participant, made.node(participant, node["fqn"], *all_commands))
        participants[node["fqn"]] = participant
    return participants
