"""What each code of a finding means, and how a check words one."""

from __future__ import annotations

from collections.abc import Mapping

from enclave_launch.review.document import Told

RULES: Mapping[str, str] = {
    "no-publisher": "A topic is subscribed and nothing in this plan publishes it.",
    "no-subscriber": "A topic is published and nothing in this plan subscribes it.",
    "no-server": "A service or action is called and nothing in this plan serves it.",
    "ends-not-judged": "Names have one end only among what is known of this plan, which has gaps.",
    "nearly-the-same-name": "Two names that never meet differ by one slash, letter or capital only.",
    "types-differ": "Both ends of a topic, service or action have different types: they never match.",
    "qos-differs": "A publisher offers less QoS than a subscription of the topic asks for: they never match.",
    "node-name-twice": "Two nodes have the same full name: rcl warns, tools confuse them.",
    "wildcard": "A permission holds a wildcard: it covers names that nobody may have thought of.",
    "enclave-shared": "Nodes of one enclave may do what only others of it ask for.",
    "permission-unasked": "An enclave has a permission that no node of it asks for.",
    "remap-dead": "A remap rule changes no name of any node that it is given to.",
    "parameter-unknown": "A parameter is set that its node does not declare.",
    "security-variable-set": "The launch file itself sets a ROS_SECURITY_ variable of a process.",
    "secret-in-parameters": "A parameter looks like a secret: parameters are readable over the network and in files.",
    "flow-forbidden": "An influence that the repository's rules forbid is possible.",
    "rule-idle": "A rule of the repository names nothing in this plan.",
    "keystore-enclave-missing": "The keystore lacks an enclave of the plan.",
    "keystore-grants-more": "The keystore permits an enclave more than the plan asks for.",
    "keystore-grants-less": "The keystore permits an enclave less than the plan asks for.",
    "keystore-zenoh": "A file for Zenoh in the keystore is not what follows from what is signed.",
    "keystore-expires": "Something that this plan needs of the keystore ends soon, or has ended.",
}


def finding(
    code: str, subject: str, text: str, remedy: str, place: tuple[str | None, int] = (None, 0)
) -> Told:
    """A warning of a check."""
    return Told("warning", code, subject, *place, text, remedy)
