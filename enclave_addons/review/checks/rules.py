"""What each code of a finding means and what to do about it; how a check words a finding."""

from __future__ import annotations

from collections.abc import Mapping

from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import Diagnostic

_OTHER_END = "look for a typing error in the name, or accept it if the other end runs elsewhere"
_PROVISION = "secure-launch --secure, or secure-keystore apply-policy, brings it to the plan"
_SHOWS_ALL = f"{_PROVISION}; secure-plan diff KEYSTORE ... shows all"
_TABLE: Mapping[str, tuple[str, str]] = {
    "no-publisher": ("A topic is subscribed and nothing in this plan publishes it.", _OTHER_END),
    "no-subscriber": ("A topic is published and nothing in this plan subscribes it.", _OTHER_END),
    "no-server": ("A service or action is called and nothing in this plan serves it.", _OTHER_END),
    "ends-not-judged": ("Names have one end only among what is known of this plan, which has gaps.",
                        "close the gaps, and check again"),
    "nearly-the-same-name": ("Two names that never meet differ by one slash, letter, capital or namespace.",
                             "if they are meant to be one, write or remap both alike"),
    "types-differ": ("Both ends of a topic, service or action have different types: they never match.",
                     "they never match: correct one of them"),
    "qos-differs": ("A publisher offers less QoS than a subscription of the topic requests: they never match.",
                    "let the publisher offer it, or the subscription request less"),
    "node-name-twice": ("Two nodes have the same full name: rcl warns, tools confuse them.",
                        "give each a name of its own"),
    "wildcard": ("A permission has a wildcard: it covers names that may be unintended, and * also matches /.",
                 "name what is meant, or accept it with the reason why that is not possible"),
    "enclave-shared": ("Nodes of one enclave have permissions that only other nodes of it request.",
                       "give them enclaves of their own (enclave=, --enclave-scope node); secure-plan suggest "
                       "shows all"),
    "permission-unasked": ("An enclave has a permission that none of its nodes requests.",
                           "take it out of the policy file, or describe who needs it"),
    "remap-dead": ("A remap rule changes no name of any node that it is given to.",
                   "look for a typing error in the name, or remove the rule"),
    "parameter-unknown": ("A parameter is set that its node does not declare.",
                          "look for a typing error in the name; rcl ignores what is not declared"),
    "security-variable-set": ("The launch file itself sets a ROS_SECURITY_ variable of a process.",
                              "leave it to --secure"),
    "secret-in-parameters": (
        "A parameter looks like a secret: parameters are readable over the network and in files.",
        "let the node read it from a file or variable that only it can read"),
    "flow-forbidden": ("An influence that the repository's rules forbid is possible.",
                       "remove one of these steps, or the rule"),
    "rule-idle": ("A rule of the repository names nothing in this plan.", "correct its names, or remove it"),
    "keystore-enclave-missing": ("The keystore lacks an enclave of the plan.", _PROVISION),
    "keystore-grants-more": ("The keystore permits an enclave more than the plan.", _SHOWS_ALL),
    "keystore-grants-less": ("The keystore permits an enclave less than the plan.", _SHOWS_ALL),
    "keystore-zenoh": ("A file for Zenoh in the keystore is not what follows from what is signed.", ""),
    "keystore-expires": ("A part of the keystore that this plan needs expires soon or has expired.",
                         "secure-keystore renew"),
}  # fmt: skip
RULES: Mapping[str, str] = {code: meaning for code, (meaning, _) in _TABLE.items()}
MEANINGS: Mapping[str, str] = {**{code.value: code.meaning for code in Code}, **RULES}
"""Of every code that planning or a check can give."""


def finding(
    code: str,
    subject: str,
    text: str,
    place: tuple[str | None, int] = (None, 0),
    *,
    fails: bool = False,
    remedy: str = "",
) -> Diagnostic:
    """Return a finding of a check, an error or a warning. ``remedy``: of a code that has none in the table."""
    file, line = place
    return Diagnostic(
        severity="error" if fails else "warning",
        code=code,
        subject=subject,
        file=file,
        line=line,
        text=text,
        remedy=remedy or _TABLE[code][1],
    )
