"""The types of what an enclave talks about, for its key expressions on Zenoh. Pure; reads what was derived."""

from __future__ import annotations

from enclave_launch.policy.derivation import DerivedPolicy
from enclave_launch.policy.node_permissions import Reason
from keystore.formats.policy import Qualifier
from keystore.formats.zenoh.grants import Types
from keystore.formats.zenoh.types import types_of_interface, united_types
from nodl.builtin_interfaces import TABLE

_BUILT_IN = {row.name: row.type for row in TABLE}


def enclave_types(derived: DerivedPolicy, enclave: str) -> Types:
    """Return the types of each name, if every node that requests it knows them.

    A policy file gives no types: what it grants may have any."""
    return united_types(
        one
        for rule, reasons in derived.reasons.get(enclave, {}).items()
        if rule.qualifier is Qualifier.ALLOW
        for reason in reasons
        for one in types_of_interface(rule.operation, rule.expression, _type(reason))
    )


def _type(reason: Reason) -> str:
    """Return the type of an interface; one that every node has carries it in the table, except for the topic of
    introspection."""
    if reason.origin == "built-in" and not reason.note:
        return reason.type or _BUILT_IN.get(reason.written, "")
    return reason.type
