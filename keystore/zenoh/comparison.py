"""Two configurations of a router, or of a session, compared, in ROS words: who may do what else, what protects less."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from enclave_common.words import counted
from keystore.errors import InvalidInputError
from keystore.zenoh.meaning import Meaning, meaning

EVERYBODY = ""
"""Whom a subject without names matches: every client, whatever its certificate."""
_NAMED = 3  # messages, beyond which it is said that there are some
_LARGEST = 64 << 20  # bytes; a router of 1,000 nodes with 20 interfaces each has 12


class MessagePermission(NamedTuple):
    """One message on one key, in one direction; ``allowed`` is False for a rule that denies."""

    flow: str
    message: str
    key: str
    allowed: bool = True


class ZenohConfiguration(NamedTuple):
    """``settings``: path -> value of everything but rules; ``admitted``: common name of a certificate -> permissions;
    ``enclaves``: whose name it is, as the file says."""

    settings: Mapping[str, object]
    admitted: Mapping[str, frozenset[MessagePermission]]
    enclaves: Mapping[str, str]


class ZenohDifference(NamedTuple):
    """``code``: ``setting``, ``subject`` or ``rights``. ``more``: whether somebody may do more than the first one lets
    them; ``who``: an enclave or the name of a certificate, in words, "" for a setting."""

    code: str
    more: bool
    who: str
    text: str


def read_configuration(text: bytes, place: str) -> ZenohConfiguration:
    """Parse a configuration as this program writes it; raises ``InvalidInputError`` for anything else."""
    content: Any = None
    try:
        content = json.loads(text if len(text) <= _LARGEST else b"")
        control = content.pop("access_control", {})
        content.pop("metadata", None)
        named = _named(control)
        admitted = _admitted(control, named)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InvalidInputError(f"{place} is not a configuration of Zenoh in JSON") from None
    own = {name: control[name] for name in ("enabled", "default_permission") if name in control}
    settings = dict(_flat({**content, "access_control": own} if own else content, ""))
    return ZenohConfiguration(
        settings, admitted, {name: one for one, names in named.items() for name in names}
    )


def differences(before: ZenohConfiguration, after: ZenohConfiguration) -> Iterator[ZenohDifference]:
    """Return what ``after`` has otherwise: settings, who is admitted, and what each of them may do."""
    yield from _settings(before.settings, after.settings)
    for name in sorted(before.admitted.keys() | after.admitted.keys()):
        old, new = before.admitted.get(name), after.admitted.get(name)
        if old is None or new is None:
            who = _who(name, before.enclaves.get(name) or after.enclaves.get(name, ""))
            yield ZenohDifference(
                "subject", old is None, who, f"{counted(len(_grouped(old or new or ())), 'permission')}"
            )
        else:
            yield from _rights(_enclave(name, before), old, new)


def _who(name: str, enclave: str) -> str:
    if name == EVERYBODY:
        return "every client, whatever its certificate"
    return f"the certificate name {name} (enclave {enclave})" if enclave else f"the certificate name {name}"


def _enclave(name: str, configuration: ZenohConfiguration) -> str:
    return f"enclave {configuration.enclaves[name]}" if name != EVERYBODY else "every client"


def _rights(
    who: str, old: frozenset[MessagePermission], new: frozenset[MessagePermission]
) -> Iterator[ZenohDifference]:
    for more, found, all_of in ((True, new - old, new), (False, old - new, old)):
        whole = _grouped(all_of)
        for what, permissions in sorted(_grouped(found).items()):
            parts = "" if permissions == whole[what] else f" ({_messages(permissions)})"
            yield ZenohDifference("rights", more, who, f"{what}{parts}")


def _grouped(permissions: Iterable[MessagePermission]) -> dict[str, set[MessagePermission]]:
    found: dict[str, set[MessagePermission]] = defaultdict(set)
    for one in permissions:
        about = meaning(one.flow, one.message, one.key)
        text = _words(about) if about else f"{one.message} on {one.key}"
        found[text if one.allowed else f"a denial: {text}"].add(one)
    return found


def _words(about: Meaning) -> str:
    return str(about._replace(node="", enclave="") if about.use else about)


def _messages(permissions: Iterable[MessagePermission]) -> str:
    named = sorted({f"{one.message} {one.flow}" for one in permissions})
    return f"of that {', '.join(named)}" if len(named) <= _NAMED else "in part"


def _named(control: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    return {
        str(subject["id"]): tuple(map(str, subject.get("cert_common_names") or (EVERYBODY,)))
        for subject in control.get("subjects") or ()
    }


def _admitted(
    control: Mapping[str, Any], names: Mapping[str, tuple[str, ...]]
) -> dict[str, frozenset[MessagePermission]]:
    rules = {rule["id"]: frozenset(_permissions(rule)) for rule in control.get("rules") or ()}
    found: dict[str, set[MessagePermission]] = defaultdict(set)
    for policy in control.get("policies") or ():
        for subject in policy["subjects"]:
            for name in names[subject]:
                for rule in policy["rules"]:
                    found[name] |= rules[rule]
    return {name: frozenset(permissions) for name, permissions in found.items()}


def _permissions(rule: Mapping[str, Any]) -> Iterator[MessagePermission]:
    allowed = rule["permission"] == "allow"
    for flow in rule.get("flows") or ("ingress", "egress"):
        for message in rule["messages"]:
            for key in rule["key_exprs"]:
                yield MessagePermission(str(flow), str(message), str(key), allowed)


def _flat(value: Any, path: str) -> Iterator[tuple[str, object]]:
    if isinstance(value, dict) and value:
        for name, one in value.items():
            yield from _flat(one, f"{path}/{name}" if path else str(name))
    else:
        yield path, value


def _settings(before: Mapping[str, object], after: Mapping[str, object]) -> Iterator[ZenohDifference]:
    for path in sorted(before.keys() | after.keys()):
        old, new = before.get(path), after.get(path)
        if old != new:
            text = f"{path} is {_value(after, path)} instead of {_value(before, path)}"
            why = next((why for start, why in _WHY.items() if path.startswith(start)), "")
            yield ZenohDifference("setting", True, "", f"{text}: {why}" if why else text)


def _value(settings: Mapping[str, object], path: str) -> str:
    return json.dumps(settings[path]) if path in settings else "not set"


_WHY = {
    "mode": "its traffic may go past the router",
    "access_control/enabled": "the router enforces nothing without it",
    "access_control/default_permission": "what no rule names would be allowed",
    "scouting/": "processes find ways past the router",
    "adminspace/": "clients may see and change the router itself",
    "listen/": "who listens can be reached without the router, or without TLS",
    "connect/": "it is led to another router",
    "transport/link/protocols": "connections without TLS carry no identity",
    "transport/link/tls/enable_mtls": "clients without a certificate are let in",
    "transport/link/tls/verify_name_on_connect": "any enclave could play the router",
    "transport/link/tls/close_link_on_expiration": "links outlive their certificate",
    "transport/link/tls/": "another identity is used or believed",
    "transport/shared_memory/": "messages may go past access control",
}
"""What is at stake, by the beginning of the path; the first one counts."""
