"""What a Zenoh router says in its log of messages and clients that it refused. Pure: lines in, values out.

Source: eclipse-zenoh zenoh/src/net/routing/interceptor (access_control.rs, mod.rs; 1.3 to 1.10) and zenoh-link-tls.
Wanted is ``RUST_LOG=zenoh::net::routing::interceptor=trace``. When a key is first named, each kind of message on it is
judged for a cache, whether or not anybody sends it: a refusal is only what ``Msg intercepted!`` of the same thread
follows.
"""

from __future__ import annotations

import re
from typing import NamedTuple

RUST_LOG = "zenoh=info,zenoh::net::routing::interceptor=trace"
"""What a router has to be started with."""

_COLOUR = re.compile(r"(?:\x1b|\\x1b)\[[0-9;]*m")
_DENIED = re.compile(
    r"(?:access_control|ACL): (?P<cached>Using cached result: )?(?P<session>[0-9a-f]{1,32})"
    r"(?: on (?P<subject>[^ ]+))? is (?P<un>un)?authorized to (?P<message>[A-Za-z /]+) \((?P<flow>ingress|egress)\) on "
    r"(?P<key>.+)\Z"
)
_NAME = re.compile(r"CertCommonName\(([^()]*)\)")
_THREAD = re.compile(r"\b(?:[a-z]+-[0-9]+ )?ThreadId\([0-9]+\)|\b(?:rx|tx|acc|net|app)-[0-9]+\b")
_DROPPED = re.compile(r"interceptor: Msg intercepted!\Z")
_NOBODY = re.compile(r": ([0-9a-f]{1,32}) did not match any configured ACL subject")
_REFUSED = re.compile(r"zenoh_link_tls::unicast: (?:Can not accept TLS connection: )?(.+?)(?:\. Hint: .*)?\Z")
_MESSAGES = {
    "Put": "put", "Delete": "delete", "Query": "query", "Reply": "reply",
    "Declare Subscriber": "declare_subscriber", "Declare Queryable": "declare_queryable",
    "Liveliness Token": "liveliness_token", "Liveliness Query": "liveliness_query",
    "Declare Liveliness Subscriber": "declare_liveliness_subscriber",
}  # fmt: skip
_HANDSHAKE = (
    ("CertificateExpired", "it does not accept the router's certificate, which has expired: secure-keystore zenoh"),
    ("certificate expired", "its certificate has expired: secure-keystore renew"),
    ("UnknownCA", "one side does not know the CA of the other: their files are of different keystores"),
    ("UnknownIssuer", "its certificate is of another CA: its files are of another keystore"),
    ("extended key usage", "its certificate is that of a server, such as the router's: it is for no client"),
    ("invalid peer certificate", "the router does not accept its certificate"),
    ("no certificates", "it has no certificate: it was started without its zenoh.json5, or only looked who is there"),
    ("InvalidContentType", "it does not use TLS: it was started without its zenoh.json5"),
)  # fmt: skip
"""By what the TLS of Zenoh 1.8 and 1.10 says; the first counts."""


class Dropped(NamedTuple):
    """A message that was not let through. ``name``: common name of the client's certificate, "" where the log does not
    say it or no rules are for it; ``session``: Zenoh's id of it; the rest as in ``access_control.rules``."""

    session: str
    name: str
    flow: str
    message: str
    key: str


class TurnedAway(NamedTuple):
    """A client that was refused as a whole. ``said``: by the router; ``why``: what it means."""

    said: str
    why: str


class RouterLog:
    """Follows one log; lines may carry colours, and what a launcher writes before them."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._judged: dict[str, Dropped | None] = {}

    def read(self, line: str) -> Dropped | TurnedAway | None:
        """Return what this line says; mostly nothing."""
        if "interceptor" not in line and "zenoh_link_tls" not in line:
            return None
        text = _COLOUR.sub("", line).rstrip()
        thread = found[0] if (found := _THREAD.search(text)) else ""
        if match := _DENIED.search(text):  # first: a key may end like any other line
            self._judged[thread] = self._denied(match)
            return None
        if _DROPPED.search(text):
            return self._judged.pop(thread, None)
        if match := _NOBODY.search(text):
            return TurnedAway(
                f"session {match[1]} did not match any subject",
                "the name of its certificate has no rules: its enclave was removed, revoked or never put on Zenoh",
            )
        return _turned_away(text)

    def _denied(self, match: re.Match[str]) -> Dropped | None:
        session, subject = match["session"], match["subject"] or ""
        if name := _NAME.search(subject):
            self._names[session] = name[1]
        message = _MESSAGES.get(match["message"])
        if message is None or match["un"] is None:
            return None
        return Dropped(session, self._names.get(session, ""), match["flow"], message, match["key"])


def _turned_away(text: str) -> TurnedAway | None:
    match = _REFUSED.search(text)
    if match is None:
        return None
    why = next((why for word, why in _HANDSHAKE if word in match[1]), None)
    return TurnedAway(match[1], why) if why else None
