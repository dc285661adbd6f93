"""From the names of an SROS2 policy to the DDS topic names of its permissions, and back.

Pure text. Prefixes and suffixes as rmw_cyclonedds and rmw_fastrtps give them (ros2/design articles/
topic_and_service_names), the five topics of an action as rcl_action names them; expansion of policy
expressions as SROS2's ``permissions.xsl``, but only for names that can exist.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from enclave_common.terminal import quoted
from keystore.formats.policy import Operation, PolicyError, Profile, Qualifier, Rule

DISCOVERY_TOPIC = "ros_discovery_info"
MAX_NAME_LENGTH = 247

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NAMESPACE = rf"/\Z|(?:/{_TOKEN})+\Z"
_FULL_NAME = re.compile(rf"(?:/{_TOKEN})+\Z")
# What may stand in an expression with wildcards: names plus * ? [abc] [a-z] [!abc], the subset that
# Cyclone DDS and Fast DDS read alike.
_CLASS = r"\[!?(?:[A-Za-z0-9_](?:-[A-Za-z0-9_])?)+\]"
_PATTERN = re.compile(rf"(?:[A-Za-z0-9_/*?]|{_CLASS})+\Z")
# SROS2's transform writes the name of a node as it stands, so a wildcard in it is one of the expression.
_NODE_PATTERN = re.compile(rf"(?:[A-Za-z_*?]|{_CLASS})(?:[A-Za-z0-9_*?]|{_CLASS})*\Z")

Topics = tuple[str, ...]
Forms = tuple[tuple[str, str], ...]
"""Prefix and suffix of a name."""

_TOPIC: Forms = (("rt", ""),)
_REQUEST: Forms = (("rq", "Request"),)
_REPLY: Forms = (("rr", "Reply"),)
_ACTION_REQUESTS: Forms = tuple(
    ("rq", f"/_action/{part}Request") for part in ("cancel_goal", "get_result", "send_goal")
)
_ACTION_ANSWERS: Forms = (
    *(("rr", f"/_action/{part}Reply") for part in ("cancel_goal", "get_result", "send_goal")),
    *(("rt", f"/_action/{part}") for part in ("feedback", "status")),
)
# What a participant publishes and what it subscribes for an operation.
_FORMS: dict[Operation, tuple[Forms, Forms]] = {
    Operation.PUBLISH: (_TOPIC, ()),
    Operation.SUBSCRIBE: ((), _TOPIC),
    Operation.REQUEST: (_REQUEST, _REPLY),
    Operation.REPLY: (_REPLY, _REQUEST),
    Operation.CALL: (_ACTION_REQUESTS, _ACTION_ANSWERS),
    Operation.EXECUTE: (_ACTION_ANSWERS, _ACTION_REQUESTS),
}


def is_dds_expression(text: str) -> bool:
    """Return whether Cyclone DDS and Fast DDS read this expression for DDS topics alike."""
    return bool(_PATTERN.match(text))


def full_name(expression: str, profile: Profile) -> str:
    """Make ``expression`` absolute; raises ``PolicyError`` for names that no ROS node can have."""
    if _FULL_NAME.match(expression) and len(expression) <= MAX_NAME_LENGTH:
        return expression
    _check_profile(profile)
    if problem := _problem(expression):
        raise PolicyError(f"{quoted(expression)} {problem}")
    ns = "" if profile.ns == "/" else profile.ns
    if expression[0] == "~":
        name = f"{ns}/{profile.node}{expression[1:]}"
    elif expression[0] != "/":
        name = f"{ns}/{expression}"
    else:
        name = expression
    if len(name) > MAX_NAME_LENGTH:
        raise PolicyError(f"name '{name}' is longer than {MAX_NAME_LENGTH} characters")
    return name


def dds_topics(operation: Operation, name: str) -> tuple[set[str], set[str]]:
    """Return the DDS topics that a participant publishes and subscribes for ``operation`` on ``name``."""
    publish: set[str] = set()
    subscribe: set[str] = set()
    add_dds_topics(operation, name, publish, subscribe)
    return publish, subscribe


def add_dds_topics(operation: Operation, name: str, publish: set[str], subscribe: set[str]) -> None:
    """Add what ``dds_topics`` returns to sets that the caller fills for many names: this runs before a start."""
    published, subscribed = _FORMS[operation]
    for before, after in published:
        publish.add(before + name + after)
    for before, after in subscribed:
        subscribe.add(before + name + after)


def ros_rules(
    publish: Iterable[str], subscribe: Iterable[str], qualifier: Qualifier = Qualifier.ALLOW
) -> tuple[tuple[Rule, ...], Topics]:
    """Return the rules that explain the topics of one permissions rule, and what no ROS rule explains.

    Services and actions appear only if both directions of a role are complete; all else stays a topic (``rt/...``) or
    is returned as it is. No rule of a policy is about ``ros_discovery_info``.
    """
    remaining = (set(publish) - {DISCOVERY_TOPIC}, set(subscribe) - {DISCOVERY_TOPIC})
    rules: list[Rule] = []
    for operation in (Operation.EXECUTE, Operation.CALL, Operation.REPLY, Operation.REQUEST):
        for name in sorted(_candidates(operation, remaining)):
            wanted = dds_topics(operation, name)
            if remaining[0] >= wanted[0] and remaining[1] >= wanted[1]:
                rules.append(Rule(operation, qualifier, name))
                remaining[0].difference_update(wanted[0])
                remaining[1].difference_update(wanted[1])
    unknown: list[str] = []
    for operation, topics in ((Operation.PUBLISH, remaining[0]), (Operation.SUBSCRIBE, remaining[1])):
        for topic in sorted(topics):
            if topic.startswith("rt/"):
                rules.append(Rule(operation, qualifier, topic[2:]))
            else:
                unknown.append(topic)
    return tuple(sorted(rules)), tuple(sorted(unknown))


def _candidates(operation: Operation, topics: tuple[set[str], set[str]]) -> set[str]:
    side = 0 if operation in (Operation.CALL, Operation.REQUEST) else 1
    suffix = _ACTION_REQUESTS[2][1] if operation in (Operation.EXECUTE, Operation.CALL) else "Request"
    return {t[2 : -len(suffix)] for t in topics[side] if t.startswith("rq/") and t.endswith(suffix)}


def _check_profile(profile: Profile) -> None:
    if not re.match(_NAMESPACE, profile.ns):
        raise PolicyError(
            f"ns={quoted(profile.ns)} is not an absolute namespace; write for example '/' or '/robot'"
        )
    if not _NODE_PATTERN.match(profile.node) or len(profile.node) > 255:
        raise PolicyError(
            f"node={quoted(profile.node)} is not a node name, nor a pattern of names (* ? [abc] [a-z] [!abc])"
        )


def _problem(expression: str) -> str | None:
    if not expression:
        return "is empty"
    if expression != expression.strip():
        return "has blanks around it; DDS implementations disagree about them"
    body = expression[1:] if expression[0] == "~" else expression
    if expression[0] == "~" and body[:1] not in ("", "/"):
        return "must have '/' after '~'"
    if body and not _PATTERN.match(body):
        return "is not a valid name (letters, digits, '_', '/', and the wildcards * ? [abc] [a-z] [!abc])"
    if "//" in body or expression[-1] == "/":
        return "has an empty part"
    if re.search(r"(?:^|/)[0-9]", expression):
        return "has a part that starts with a digit"
    return None
