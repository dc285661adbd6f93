"""The enclave path of one process, from what its launch file says.

Takes a ``ResolvedProcess`` (with its ``EnclaveRequest``), gives an ``EnclaveAssignment``; next is the policy.
Performs no I/O.

Rules, from the design article "ROS 2 Security Enclaves" (section Runtime):

1. An ``--enclave`` that the user already wrote among the ROS arguments decides: rcl takes the last one given
   (rcl/src/rcl/arguments.c), and launch never rewrites user arguments.
2. An absolute ``enclave`` attribute is the path itself.
3. A relative one goes below the enclave scope in force (``/`` when nothing was pushed).
4. Without attribute the default follows ``--enclave-scope``: ``namespace`` is that article's convention,
   ``node`` the one of the article "Security usage of NoDL" (the node's fully qualified name).
5. An ``executable`` action gets an enclave only when the launch file gives one.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from enclave_launch.errors import LaunchFileError
from enclave_launch.process import (
    UNSPECIFIED_NODE_NAME,
    UNSPECIFIED_NODE_NAMESPACE,
    EnclaveRequest,
    ResolvedProcess,
)
from keystore.errors import EnclaveTooDeep, InvalidEnclaveNameError
from keystore.formats.enclave_name import validate_enclave_name


class EnclaveScope(str, Enum):
    """Values of ``--enclave-scope``: the enclave of a process whose launch file names none."""

    __str__ = str.__str__

    NAMESPACE = "namespace"
    NODE = "node"
    PROCESS = "process"
    LAUNCH = "launch"


class AssignmentReason(str, Enum):
    """The reason why a process has its enclave; the value is the text shown in the tree."""

    __str__ = str.__str__

    ARGUMENT = "--enclave in its own ROS arguments"
    ABSOLUTE = "absolute enclave attribute"
    RELATIVE = "relative enclave attribute"
    SCOPE = "enclave scope"
    ROOT = "no scope pushed"
    NODE_NAME = "one per node"
    PROCESS_NAME = "one per process"
    LAUNCH = "one for the launch"


class EnclaveAssignment(NamedTuple):
    """The enclave of a process, and why. ``path`` is absolute and valid for rcl; ``scope`` is what a relative
    attribute was resolved against; ``too_deep`` says why no certificate can be made for it."""

    path: str
    reason: AssignmentReason
    scope: str = "/"
    too_deep: str = ""


def join_enclave(scope: str, relative: str) -> str:
    """Put ``relative`` below ``scope``; an absolute path replaces it."""
    if relative.startswith("/"):
        return relative
    return f"{scope.rstrip('/')}/{relative}"


def assign_enclave(
    process: ResolvedProcess, scope: EnclaveScope, default_name: str | None = None
) -> EnclaveAssignment | None:
    """Decide the enclave of ``process``; None for an executable to which the launch file gives none.

    ``default_name``: the node's own name, used where launch knows none. Raises ``LaunchFileError``."""
    assignment = _unchecked(process, scope, default_name)
    if assignment is None:
        return None
    try:
        validate_enclave_name(assignment.path)
    except EnclaveTooDeep as error:
        return assignment._replace(too_deep=str(error))
    except InvalidEnclaveNameError as error:
        raise LaunchFileError(
            f"enclave {assignment.path!r} ({assignment.reason.value}): {error}", process.location, error
        ) from error
    return assignment


def _unchecked(
    process: ResolvedProcess, scope: EnclaveScope, default_name: str | None
) -> EnclaveAssignment | None:
    request = process.enclave
    if request.argument is not None:
        return EnclaveAssignment(request.argument, AssignmentReason.ARGUMENT)
    if request.attribute is not None:
        return _from_attribute(request, request.attribute)
    if process.kind == "executable":
        return None
    return _default(process, scope, default_name)


def _from_attribute(request: EnclaveRequest, attribute: str) -> EnclaveAssignment:
    base = request.scope or "/"
    reason = AssignmentReason.ABSOLUTE if attribute.startswith("/") else AssignmentReason.RELATIVE
    return EnclaveAssignment(join_enclave(base, attribute), reason, base)


def _default(process: ResolvedProcess, scope: EnclaveScope, default_name: str | None) -> EnclaveAssignment:
    pushed = process.enclave.scope
    base = pushed or "/"
    if scope is EnclaveScope.LAUNCH:
        return EnclaveAssignment("/", AssignmentReason.LAUNCH)
    if scope is EnclaveScope.PROCESS:
        label = process.process_name.replace("-", "_").replace(".", "_")
        return EnclaveAssignment(join_enclave(base, label), AssignmentReason.PROCESS_NAME, base)
    if scope is EnclaveScope.NODE:
        return EnclaveAssignment(final_fqn(process, default_name), AssignmentReason.NODE_NAME)
    return EnclaveAssignment(base, AssignmentReason.SCOPE if pushed else AssignmentReason.ROOT, base)


def final_fqn(process: ResolvedProcess, default_name: str | None) -> str:
    """Return the node's fully qualified name; an unknown name becomes ``default_name``, a namespace ``/``."""
    fqn = process.fqn or UNSPECIFIED_NODE_NAME
    fqn = fqn.replace(UNSPECIFIED_NODE_NAMESPACE, "")
    if default_name is not None:
        fqn = fqn.replace(UNSPECIFIED_NODE_NAME, default_name)
    return fqn if fqn.startswith("/") else f"/{fqn}"
