"""Denials of a Zenoh router, explained from its log and the keystore: who, what, why, and what allows it.

Reads only. The log is untrusted text, and keeps what clients sent: everything of it is printed as text.

Source: eclipse-zenoh zenoh/src/net/routing/interceptor (access_control.rs, mod.rs; 1.3 to 1.10) and zenoh-link-tls.
Needed is ``RUST_LOG=zenoh::net::routing::interceptor=trace``. When a key is first named, each kind of message on it is
judged for a cache, whether or not anybody sends it: a refusal is only what ``Msg intercepted!`` of the same thread
follows.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_addons.zenoh.configuration import RouterAddress
from enclave_addons.zenoh.files import present_address, router_file
from enclave_addons.zenoh.grants import PLAIN_USES, Use
from enclave_addons.zenoh.rules import GRAPH_KINDS, TABLE
from keystore.disk.register_file import read_register
from keystore.disk.view import keystore_at
from keystore.errors import KeystoreError
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Operation, Policy, PolicyError, Profile, Qualifier, Rule
from keystore.formats.policy_xml import policy_xml

RUST_LOG = "zenoh=info,zenoh::net::routing::interceptor=trace"
"""Environment with which a router must be started."""

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


_WITHOUT_EFFECT = "/@adv/sub/"
"""A subscription of rmw_zenoh announces itself there. No node requests that, so it is not granted."""


_APPLY = (
    "this allows it, and nothing else; put it into the policy that is applied "
    "(secure-keystore apply-policy, or secure-launch --policy):"
)


class Explanation(NamedTuple):
    """A refusal of the router, explained. ``who`` may not do ``what``; ``why``, and ``remedy`` as commands or steps.
    ``policy``: a policy file that grants just this; empty where granting more would not help."""

    who: str
    what: str
    why: str
    remedy: str
    policy: str = ""

    @property
    def lines(self) -> list[str]:
        """Format the explanation for a terminal."""
        found = [f"refused: {self.who} may not {self.what}" if self.what else f"refused: {self.who}"]
        found += [f"  {text}" for text in (self.why, self.remedy) if text]
        return [*found, *(f"    {line}" for line in self.policy.splitlines())]


class RouterLogExplainer:
    """Explains a log line by line, each refusal once. ``keystore``: of the router that writes it."""

    def __init__(self, keystore: Path | str) -> None:
        self._view = keystore_at(keystore)
        self._log = RouterLog()
        self._explained_before: set[tuple[str, ...]] = set()
        self._enclaves = {
            name: one for one in self._view.zenoh_enclaves() if (name := self._view.common_name(one))
        }
        self._granted: dict[str, frozenset[Meaning]] = {}

    def read(self, line: str) -> Explanation | None:
        """Return what this line says for the first time."""
        found = self._log.read(line)
        if isinstance(found, TurnedAway):
            return self._once((found.why,), Explanation(f"a client ({found.said})", "", found.why, ""))
        if found is None or _WITHOUT_EFFECT in found.key:
            return None
        said = self._explained(found, meaning(found.flow, found.message, found.key))
        return self._once((found.name, said.what, said.why), said)

    def _once(self, key: tuple[str, ...], said: Explanation) -> Explanation | None:
        if key in self._explained_before:
            return None
        self._explained_before.add(key)
        return said

    def _explained(self, found: Dropped, about: Meaning | None) -> Explanation:
        enclave = self._enclaves.get(found.name, "")
        what = _what(about, found)
        if not enclave:
            return _stranger(found, what, self._former().get(found.name, ""))
        who = f"enclave {enclave}"
        if about is None:
            return Explanation(who, what, "ROS sends nothing like it: no permission is about it", "")
        if about.enclave not in ("", enclave):
            why = f"it says that it is enclave {about.enclave}, and its certificate is that of {enclave}"
            return Explanation(who, what, why, "give both the same name: --enclave and zenoh.json5")
        if about.use is None or "*" in about.name:
            why = "a message on many names at once is only for who may use all of them"
            return Explanation(who, what, why, "name them one by one")
        return self._ungranted(enclave, about._replace(enclave=""), what)

    def _ungranted(self, enclave: str, about: Meaning, what: str) -> Explanation:
        who = f"node {about.node} of enclave {enclave}" if about.node else f"enclave {enclave}"
        similar = [
            one for one in self._grants(enclave) if one.use is about.use and can_meet(one.name, about.name)
        ]
        if not similar:
            why = "the permissions that are signed for it do not grant that"
            return Explanation(who, what, why, _APPLY, _policy(enclave, about))
        if any(one.type in ("", about.type) and one.domain in ("*", about.domain) for one in similar):
            why = "it is granted now: the router had other rules when it wrote this"
            return Explanation(who, what, why, "restart the router with the keystore's file")
        granted = ", ".join(sorted(map(str, similar)))
        return Explanation(
            who, what, f"granted is another type or domain: {granted}", "use the same on both sides"
        )

    def _grants(self, enclave: str) -> frozenset[Meaning]:
        """Read grants from what is signed, not from the router's file, which may be an earlier one."""
        if enclave not in self._granted:
            try:
                address = present_address(self._view) or RouterAddress()
                subjects = router_file(self._view, [enclave], address).subjects
            except KeystoreError:
                return frozenset()  # verify reports it
            found = (
                meaning(rule.flow, message, key)
                for subject in subjects
                for rule in subject.rules
                for message in rule.messages
                for key in rule.keys
            )
            self._granted[enclave] = frozenset(one for one in found if one is not None)
        return self._granted[enclave]

    def _former(self) -> Mapping[str, str]:
        register = read_register(self._view.root)
        held = register.certificates.values() if register is not None else ()
        present = {self._view.common_name(enclave) for enclave in self._view.enclaves()}
        return {one.subject: one.enclave for one in held if one.subject not in present}


def _what(about: Meaning | None, found: Dropped) -> str:
    if about is None:
        return f"{found.message.replace('_', ' ')} on {found.key}"
    if about.use is None or "*" in about.name:
        return f"{about} ({found.message.replace('_', ' ')} on {found.key})"
    operation, name = operation_of(about.use, about.name)
    action = operation in (Operation.CALL, Operation.EXECUTE)
    return f"{operation.verb} {name}" if action else str(about._replace(node="", enclave=""))


def _stranger(found: Dropped, what: str, former: str) -> Explanation:
    if former:
        why = f"this name was of enclave {former}, whose certificate was revoked, removed or has another name now"
        remedy = "give its process the files that the enclave has now, and start it again"
        return Explanation(f"the certificate name {found.name}", what, why, remedy)
    if found.name:
        why = "no enclave that is on Zenoh here has this name"
        remedy = "secure-keystore zenoh KEYSTORE --enclave PATH puts an enclave on Zenoh"
        return Explanation(f"the certificate name {found.name}", what, why, remedy)
    why = "no rule is for the name of its certificate, or the log begins after it came"
    return Explanation(f"a client (session {found.session})", what, why, "")


def _policy(enclave: str, about: Meaning) -> str:
    assert about.use is not None, "checked by the caller"
    operation, name = operation_of(about.use, about.name)
    namespace, _, node = about.node.rpartition("/")
    profile = Profile(namespace or "/", node or enclave.rpartition("/")[2] or "root", (
        Rule(operation, Qualifier.ALLOW, name),
    ))  # fmt: skip
    try:
        return policy_xml(Policy((EnclavePolicy(enclave, (profile,)),))).decode()
    except PolicyError:
        return ""


_TYPE = re.compile(r"([A-Za-z][A-Za-z0-9_]*)::(msg|srv|action)::dds_::([A-Za-z][A-Za-z0-9_]*)_\Z")
_DOMAIN = re.compile(r"(?:[0-9]{1,10}|\*{1,2})\Z")
_ACTION_SERVICE = re.compile(r"(/.+)/_action/(?:send_goal|get_result|cancel_goal)\Z")
_ACTION_TOPIC = re.compile(r"(/.+)/_action/(?:feedback|status)\Z")
_OPERATIONS = {use: operation for operation, use in PLAIN_USES.items()}
_SENT: dict[tuple[str, str], tuple[Use, ...]] = {}
"""The uses that a message on a key of messages, requests and replies is of, by flow and kind of message."""
_HISTORY: dict[tuple[str, str], Use] = {("egress", "declare_queryable"): Use.SUBSCRIBE}
"""The same on the keys of a topic's history."""
for _row in TABLE:
    for _message in _row.messages:
        if _row.below is str:
            _SENT[_row.flow, _message] = (*_SENT.get((_row.flow, _message), ()), _row.use)
        else:
            _HISTORY[_row.flow, _message] = _row.use


class Meaning(NamedTuple):
    """The ROS meaning of a message on a key. ``use``: None for a node itself and for looking at the graph; ``name``:
    absolute, with ``*`` for what a key leaves open, "" without; ``type``: such as ``std_msgs/msg/String``, "" for
    any; ``domain``: ``*`` for all.

    Of a token also who it says is there: ``node`` (its final name) and ``enclave``.
    """

    use: Use | None
    name: str
    type: str
    domain: str
    node: str = ""
    enclave: str = ""

    def __str__(self) -> str:
        if self.use is None:
            who = f"node {self.node} is" if "*" not in self.node else f"nodes of enclave {self.enclave} are"
            what = f"say that {who} there" if self.node else "look at the graph"
        else:
            what = f"{self.use.value} {self.name}" + (f" ({self.type})" if self.type else " (any type)")
        return what if self.domain == "0" else f"{what} in {_domain_words(self.domain)}"


def meaning(flow: str, message: str, key: str) -> Meaning | None:
    """Return the meaning of a message (``put``, ``declare_subscriber`` ...); None for what ROS has nothing like.

    ``key_expressions`` and ``rules`` the other way round. A key is untrusted text.

    The message arrives at the router (``ingress``) or leaves it (``egress``).
    """
    if key.startswith("@"):
        return _of_graph(key)
    data, _, history = key.partition("/@adv/")
    chunks = data.split("/")
    if len(chunks) < 2 or not _DOMAIN.match(chunks[0]):
        return None
    name, chunk = _name_and_type(chunks)
    ros_type = type_name(chunk)
    if history:
        sent = "sub" if history.startswith("sub") else "pub"
        token = Use.PUBLISH if (sent == "pub") is (flow == "ingress") else Use.SUBSCRIBE
        use = token if message == "liveliness_token" else _HISTORY.get((flow, message))
    else:
        uses = _SENT.get((flow, "put" if message == "delete" else message), ())
        of_service = [one for one in uses if (one in (Use.CALL, Use.SERVE)) is _is_service(ros_type)]
        use = next(iter(of_service if len(uses) > 1 else uses), None)
    return None if use is None else Meaning(use, name, ros_type, chunks[0])


def operation_of(use: Use, name: str) -> tuple[Operation, str]:
    """Return the operation as a policy says it: a part of an action counts for the action."""
    service, topic = _ACTION_SERVICE.match(name), _ACTION_TOPIC.match(name)
    if service is not None and use in (Use.CALL, Use.SERVE):
        return Operation.CALL if use is Use.CALL else Operation.EXECUTE, service[1]
    if topic is not None and use in (Use.PUBLISH, Use.SUBSCRIBE):
        return Operation.EXECUTE if use is Use.PUBLISH else Operation.CALL, topic[1]
    return _OPERATIONS[use], name


def type_name(chunk: str) -> str:
    """Return ``std_msgs::msg::dds_::String_`` as ``std_msgs/msg/String``; "" for a chunk that leaves it open."""
    match = _TYPE.match(chunk)
    return f"{match[1]}/{match[2]}/{match[3]}" if match else ""


def _name_and_type(chunks: list[str]) -> tuple[str, str]:
    """Split into name and type; ``0/**`` has neither: it is about all names."""
    if len(chunks) < 4 or "**" in chunks[-2:]:
        return _ros_name("/".join(chunks[1:])), ""
    return _ros_name("/".join(chunks[1:-2])), chunks[-2]


def _ros_name(expression: str) -> str:
    whole = expression.replace("$*/**/$*", "*")
    return "/" + re.sub(r"(?:\*\*?|\$\*)(?:/(?:\*\*?|\$\*)(?=/|\Z))*", "*", whole)


def _is_service(ros_type: str) -> bool:
    return "/srv/" in ros_type or ros_type.endswith(("_SendGoal", "_GetResult"))


def _of_graph(key: str) -> Meaning | None:
    chunks = key.split("/")
    if chunks[0] != "@ros2_lv" or len(chunks) < 2:
        return None
    domain = chunks[1]
    if len(chunks) < 9:
        return Meaning(None, "", "", domain)
    kind, enclave, namespace, node = chunks[5:9]
    fqn = f"{_unmangled(namespace).rstrip('/')}/{node}"
    if kind == "NN":
        return Meaning(None, "", "", domain, fqn, _unmangled(enclave))
    use = GRAPH_KINDS.get(kind)
    if use is None or len(chunks) < 11:
        return None
    name = _ros_name(_unmangled(chunks[9])[1:])
    return Meaning(use, name, type_name(chunks[10]), domain, fqn, _unmangled(enclave))


def _unmangled(chunk: str) -> str:
    return chunk.replace("%", "/")


def _domain_words(domain: str) -> str:
    return "all domains" if "*" in domain else f"domain {domain}"
