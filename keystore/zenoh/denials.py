"""What a Zenoh router refused, explained from its log and the keystore: who, what, why, and what allows it.

Reads only. The log is untrusted text, and keeps what clients sent: everything of it is printed as text.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from keystore.disk import layout
from keystore.disk.register_file import read_register
from keystore.disk.view import keystore_at
from keystore.errors import KeystoreError
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Operation, Policy, PolicyError, Profile, Qualifier, Rule
from keystore.formats.policy_xml import policy_xml
from keystore.zenoh.comparison import read_configuration
from keystore.zenoh.configuration import RouterAddress
from keystore.zenoh.files import present_address, router_file
from keystore.zenoh.meaning import Meaning, meaning, operation_of
from keystore.zenoh.trace import Dropped, RouterLog, TurnedAway

_WITHOUT_EFFECT = "/@adv/sub/"
"""A subscription of rmw_zenoh says there that it is one; nobody asks for that, so it is not granted."""


_APPLY = (
    "this allows it, and nothing else; put it into the policy that is applied "
    "(secure-keystore apply-policy, or secure-launch --policy):"
)


class Explanation(NamedTuple):
    """``who`` may not do ``what``; ``why``, and ``remedy`` as commands or steps. ``policy``: a policy file that
    grants just this; empty where granting more would not help."""

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
        self._told: set[tuple[str, ...]] = set()
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
        if key in self._told:
            return None
        self._told.add(key)
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
                content = router_file(self._view, [enclave], address).content
            except KeystoreError:
                return frozenset()  # verify reports it
            admitted = read_configuration(content, layout.ZENOH_ROUTER).admitted
            found = (meaning(*one[:3]) for permissions in admitted.values() for one in permissions)
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
