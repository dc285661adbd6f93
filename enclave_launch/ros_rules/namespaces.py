"""Join namespaces, and find the enclave scope that follows from pushed namespaces and enclaves.

The launch configurations ``ros_namespace`` (upstream's) and ``ros_enclave_scope`` (ours) carry the scope, so
groups and includes scope both alike. ``ros_enclave_scope`` is set by the first explicit push of an enclave;
until then the pushed namespace is the scope (design article "ROS 2 Security Enclaves"). Once set, each later
push of a namespace joins its enclave text, or else its namespace, in the way namespaces join.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from typing import Any, overload

NAMESPACE = "ros_namespace"
ENCLAVE_SCOPE = "ros_enclave_scope"


def prefix_namespace(base_ns: str | None, ns: str | None) -> str | None:
    """Join ``ns`` below ``base_ns``; an absolute ``ns`` drops the base, None stands for "not given".

    Trailing slashes are removed, unless the result is the root itself. An empty base does not count, so
    ``prefix_namespace("", "")`` is empty, which ``make_namespace_absolute`` turns into ``/``."""
    if ns is None:
        joined = base_ns
    elif not base_ns or ns.startswith("/"):
        joined = ns
    else:
        joined = f"{'' if base_ns == '/' else base_ns}/{ns}"
    return joined if joined is None or joined == "/" else joined.rstrip("/")


@overload
def make_namespace_absolute(ns: str) -> str: ...
@overload
def make_namespace_absolute(ns: str | None) -> str | None: ...
def make_namespace_absolute(ns: str | None) -> str | None:
    """Add a leading slash if it is missing; None stays None."""
    return ns if ns is None or ns.startswith("/") else f"/{ns}"


def enclave_scope(launch_configurations: Mapping[str, Any]) -> str | None:
    """Return the absolute scope in force; None if neither an enclave nor a namespace was pushed."""
    scope: str | None = launch_configurations.get(ENCLAVE_SCOPE)
    return make_namespace_absolute(launch_configurations.get(NAMESPACE) if scope is None else scope)


def push_enclave_scope(
    launch_configurations: MutableMapping[str, Any], enclave: str | None, namespace: str | None = None
) -> None:
    """Join one push to the scope. Call it before the pushed ``namespace`` itself is in force."""
    if enclave is None and launch_configurations.get(ENCLAVE_SCOPE) is None:
        return  # the pushed namespace goes on being the scope
    pushed = namespace if enclave is None else enclave
    joined = prefix_namespace(enclave_scope(launch_configurations), pushed)
    launch_configurations[ENCLAVE_SCOPE] = make_namespace_absolute(joined)
