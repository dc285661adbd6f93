"""What is told of processes and their enclaves. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_launch.boundary.words import some_of
from enclave_launch.diagnostics import Code, Diagnostic
from enclave_launch.source_location import SourceLocation


def container_elsewhere(
    component: str, container: str, alike: tuple[str, ...], place: SourceLocation
) -> Diagnostic:
    """``alike``: containers of this launch whose last name is the same."""
    text = (
        f"container {container!r} of component {component} is not started by this launch file; its permissions are "
        "not part of this plan"
    )
    if (
        alike
    ):  # a target is taken as it is written, without pushed namespaces (launch_ros load_composable_nodes.py)
        text += f" (this launch file starts {' '.join(alike)}: a target needs its full name)"
    return Diagnostic(Code.CONTAINER_ELSEWHERE, component, text, place)


def enclave_attribute_unused(process: str, enclave: str, attribute: str, place: SourceLocation) -> Diagnostic:
    """``--enclave`` among a process's own ROS arguments counts before our attribute."""
    own = f"{process} has --enclave {enclave} in its own ROS arguments"
    text = f"{own}; its enclave attribute {attribute!r} is not used"
    return Diagnostic(Code.ENCLAVE_ATTRIBUTE_UNUSED, process, text, place)


def enclave_of_several_launches(enclave: str, others: Sequence[str], added: Sequence[str]) -> Diagnostic:
    """``others``: the launches; ``added``: what their share lets the processes of this one do."""
    cost = f"; its processes may then also {some_of(added, 4)}" if added else ""
    text = f"enclave {enclave} is shared with {', '.join(others)}{cost}"
    remedy = (
        "--enclave-scope gives enclaves of their own, secure-keystore shares drops what is not used any more"
    )
    return Diagnostic(Code.ENCLAVE_OF_SEVERAL_LAUNCHES, enclave, text, remedy=remedy)


def enclave_shared_with_launcher(enclave: str) -> Diagnostic:
    """Its processes may then do what launch itself does, such as loading components."""
    return Diagnostic(
        Code.ENCLAVE_SHARED_WITH_LAUNCHER, enclave, f"enclave {enclave} is shared with the launcher itself"
    )


def enclave_too_deep(process: str, why: str, place: SourceLocation) -> Diagnostic:
    """``why`` says why no certificate can be made for it."""
    return Diagnostic(Code.ENCLAVE_TOO_DEEP, process, f"{process}: {why}", place, "give it a shorter one")


def enclave_ungranted(enclave: str, processes: tuple[str, ...], place: SourceLocation) -> Diagnostic:
    """An ``executable`` with an enclave of its own has no manifest and is not a node of the plan."""
    text = (
        f"{enclave}, the enclave of {', '.join(processes)}, has no permissions: nothing is known of what an executable "
        "says in ROS, and a node in it could not start"
    )
    return Diagnostic(
        Code.ENCLAVE_UNGRANTED, enclave, text, place, "grant what it needs in a policy file (--policy)"
    )


def executable_without_enclave(process: str, place: SourceLocation) -> Diagnostic:
    """It is started with a keystore in which its enclave cannot be found."""
    text = (
        f"{process} runs without an enclave: an executable gets one only through its enclave attribute or --enclave; "
        "a ROS program in it could not start"
    )
    return Diagnostic(Code.EXECUTABLE_WITHOUT_ENCLAVE, process, text, place)


def machine_elsewhere(process: str, machine: str, place: SourceLocation) -> Diagnostic:
    """``machine`` is a hint for ``secure-plan hosts`` and ``secure-plan export``."""
    text = f"{process} is meant for machine {machine!r}, but a launch starts everything on this host"
    return Diagnostic(
        Code.MACHINE_ELSEWHERE,
        process,
        text,
        place,
        "secure-plan hosts and secure-plan export place it there",
    )
