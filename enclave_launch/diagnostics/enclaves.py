"""Diagnostics of processes and their enclaves. Performs no I/O."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.source_location import SourceLocation
from enclave_common.words import some_of
from enclave_launch.diagnostics import Code, Diagnostic


def container_elsewhere(
    component: str, container: str, alike: tuple[str, ...], place: SourceLocation
) -> Diagnostic:
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
    own = f"{process} has --enclave {enclave} in its own ROS arguments"
    text = f"{own}; its enclave attribute {attribute!r} is not used"
    return Diagnostic(Code.ENCLAVE_ATTRIBUTE_UNUSED, process, text, place)


def enclave_of_several_launches(enclave: str, others: Sequence[str], added: Sequence[str]) -> Diagnostic:
    """Report an enclave that ``others`` share, and what their share permits the processes of this launch."""
    cost = f"; its processes may then also {some_of(added, 4)}" if added else ""
    text = f"enclave {enclave} is shared with {some_of(others, 4)}{cost}"
    remedy = (
        "--enclave-scope gives enclaves of their own, secure-keystore shares drops what is not used any more"
    )
    return Diagnostic(Code.ENCLAVE_OF_SEVERAL_LAUNCHES, enclave, text, remedy=remedy)


def enclave_shared_with_launcher(enclave: str) -> Diagnostic:
    """Report that the processes of an enclave may do what launch itself does, such as load components."""
    return Diagnostic(
        Code.ENCLAVE_SHARED_WITH_LAUNCHER, enclave, f"enclave {enclave} is shared with the launcher itself"
    )


def enclave_too_deep(process: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.ENCLAVE_TOO_DEEP, process, f"{process}: {why}", place, "give it a shorter one")


def enclave_ungranted(enclave: str, processes: tuple[str, ...], place: SourceLocation) -> Diagnostic:
    """Report an ``executable`` with an enclave of its own: it has no manifest and is not a node of the plan."""
    text = (
        f"{enclave}, the enclave of {', '.join(processes)}, has no permissions: the interfaces of an executable are "
        "unknown, and a node in it could not start"
    )
    return Diagnostic(
        Code.ENCLAVE_UNGRANTED, enclave, text, place, "grant what it needs in a policy file (--policy)"
    )


def executable_without_enclave(process: str, place: SourceLocation) -> Diagnostic:
    text = (
        f"{process} runs without an enclave: an executable gets one only through its enclave attribute or --enclave; "
        "a ROS program in it could not start"
    )
    return Diagnostic(Code.EXECUTABLE_WITHOUT_ENCLAVE, process, text, place)


def command_needs_enclave(process: str, command: str, remedy: str, place: SourceLocation) -> Diagnostic:
    """Refuse a command that makes a ROS participant and could not start without an enclave."""
    text = f"{process} would run '{command}' without an enclave, and with security on it could not start"
    return Diagnostic(Code.COMMAND_NEEDS_ENCLAVE, process, text, place, remedy)


def machine_elsewhere(process: str, machine: str, place: SourceLocation) -> Diagnostic:
    text = f"{process} is assigned to machine {machine!r}, but a launch starts everything on this host"
    return Diagnostic(
        Code.MACHINE_ELSEWHERE,
        process,
        text,
        place,
        "secure-plan hosts and secure-plan export place it there",
    )


def connext(process: str, place: SourceLocation) -> Diagnostic:
    """Report a process on RTI Connext; not refused: its rmw was read, and not run."""
    text = (
        f"{process} runs on RTI Connext: rmw_connextdds reads enclaves (its source says so), but it was not "
        "tested; permissions name topics as ROS does (rt/chatter), topic aliases of plain Connext need both names"
    )
    return Diagnostic(Code.CONNEXT_UNTRIED, process, text, place)


def handshake_fails(fast: str, cyclone: str, *, planned: bool) -> Diagnostic:
    """Report enclaves that cannot authenticate each other; ``planned``: before certificates exist."""
    if fast == cyclone:
        text = (
            f"enclave {fast} has processes on Fast DDS and on Cyclone DDS: chance decides at each start which of them "
            "authenticate each other"
        )
        return Diagnostic(
            Code.HANDSHAKE_FAILS, fast, text, None, "give those of each DDS an enclave of their own"
        )
    text = (
        f"enclave {fast} (Fast DDS) and enclave {cyclone} (Cyclone DDS) never authenticate each other with these "
        "subjects: Fast DDS would begin the handshake, which Cyclone DDS refuses (measured on 0.10.2 and 2.9.1)"
    )
    new = "certificates that are made now get subjects that avoid it" if planned else ""
    remedy = (
        new
        or "run both on one DDS, or remove one of the enclaves from the keystore so that it is created again"
    )
    return Diagnostic(Code.HANDSHAKE_FAILS, fast, text, None, remedy)


def domain_invalid(process: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.DOMAIN_INVALID, process, f"{process}: {why}", place, "it could not start")


def domain_not_served(process: str, domain: int, served: str, place: SourceLocation) -> Diagnostic:
    option = "--domain-id (ProvisionOptions.domains)"
    text = f"{process} is in domain {domain}, but {option} permits {served} only"
    return Diagnostic(
        Code.DOMAIN_NOT_SERVED, process, text, place, "add the domain there, or leave it out here"
    )


def domains_shared(enclave: str, domains: str, processes: tuple[str, ...]) -> Diagnostic:
    """Warn that processes may join each other's domains: permissions name domains for the enclave as a whole."""
    text = (
        f"enclave {enclave} may join domains {domains}, each of its processes all of them ({', '.join(processes)}); "
        "give those of each domain an enclave of their own"
    )
    return Diagnostic(Code.DOMAINS_SHARED, enclave, text)


def library_preloaded(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    text = (
        f"{variable} puts {value!r} into {process} before its own libraries: that code has all permissions of the "
        "enclave"
    )
    return Diagnostic(Code.LIBRARY_PRELOADED, process, text, place)


def middleware_refused(
    process: str, middleware: str, why: str, place: SourceLocation, *, by_launch_file: bool
) -> Diagnostic:
    origin = "the launch file" if by_launch_file else "the environment"
    text = f"{process} would run on {middleware} (RMW_IMPLEMENTATION of {origin}) and not be secured: {why}"
    known = (
        "rmw_cyclonedds_cpp, rmw_fastrtps_cpp, rmw_fastrtps_dynamic_cpp and rmw_connextdds read enclaves, "
        "rmw_zenoh_cpp is secured by its router"
    )
    accept = f"; vouch for it with --accept-middleware {middleware}" if "not known" in why else ""
    return Diagnostic(Code.MIDDLEWARE_REFUSED, process, text, place, known + accept)


def prefix_refused(process: str, wrapper: str, why: str, place: SourceLocation) -> Diagnostic:
    text = f"{process} would be started through {wrapper!r} and might not be secured: {why}"
    return Diagnostic(
        Code.PREFIX_REFUSED, process, text, place, f"if it keeps ROS_SECURITY_*, --accept-prefix {wrapper}"
    )


def security_configured(
    process: str, variable: str, value: str, why: str, place: SourceLocation
) -> Diagnostic:
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    text = f"{variable} of {process} {why}: {shown}"
    return Diagnostic(Code.SECURITY_CONFIGURED, process, text, place, "take it out, or write it out in full")


def discovery_server(process: str, variable: str, value: str, why: str, place: SourceLocation) -> Diagnostic:
    """Report what keeps a secured process from meeting others, or lets it meet others without a handshake."""
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    text = f"{variable} of {process} {why}: {shown}"
    remedy = (
        f"remove it for secured processes (unset {variable} in the shell too). Hosts that multicast does not reach are "
        "named in ROS_STATIC_PEERS from iron on, before it in initialPeersList of a Fast DDS profile"
    )
    return Diagnostic(Code.DISCOVERY_SERVER, process, text, place, remedy)


def discovery_off(process: str, place: SourceLocation) -> Diagnostic:
    text = f"ROS_AUTOMATIC_DISCOVERY_RANGE=OFF of {process}: it meets no other process"
    return Diagnostic(Code.DISCOVERY_OFF, process, text, place, "set it to LOCALHOST or SUBNET")


def variable_overridden(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    text = f"{variable}={value} of the launch file has no effect on {process} under --secure"
    return Diagnostic(Code.VARIABLE_OVERRIDDEN, process, text, place)


def names_apart(what: str, name: str, on_dds: str, on_zenoh: str) -> Diagnostic:
    text = f"{what} {name}: {on_dds} is on DDS and {on_zenoh} on Zenoh (RMW_IMPLEMENTATION); they cannot communicate"
    remedy = "give both the same middleware, or put a bridge between them and give it an enclave on each"
    return Diagnostic(Code.MIDDLEWARES_APART, name, text, None, remedy)


def launcher_apart(
    service: str, launcher: str, process: str, middleware: str, place: SourceLocation
) -> Diagnostic:
    text = (
        f"launch itself runs on {launcher} and must call {service} of {process}, which runs on {middleware}"
    )
    remedy = f"they cannot communicate: start launch with RMW_IMPLEMENTATION={middleware}, or give {process} the other"
    return Diagnostic(Code.MIDDLEWARES_APART, service, text, place, remedy)


def enclave_on_both(enclave: str) -> Diagnostic:
    """Report an enclave with processes on both middlewares: one key may do the same on both."""
    text = (
        f"enclave {enclave} has processes on DDS and on Zenoh: its key permits the same on both, and what "
        "only one of them checks (types and node tokens on Zenoh, permissions by each peer on DDS) the other does not"
    )
    return Diagnostic(Code.MIDDLEWARES_APART, enclave, text, None, "give them enclaves of their own")


def zenoh_cannot_grant(enclave: str, gap: str) -> Diagnostic:
    text = f"enclave {enclave} is on Zenoh, where this cannot be granted and is denied: {gap}"
    return Diagnostic(Code.ZENOH_CANNOT_GRANT, enclave, text, None, "name what is meant, one by one")


def zenoh_router_trusted(processes: Sequence[str]) -> Diagnostic:
    """Report, once per plan, what must be trusted when a router enforces permissions."""
    text = (
        f"{some_of(processes, 3)} on Zenoh: encryption ends at the router, which reads every message and alone "
        "enforces (on DDS every participant does, end to end); who of several publishers of a topic sent a message is "
        "not proved; ROS_SECURITY_STRATEGY has no effect. In return types are enforced, and what is taken away ends "
        "at once, without a restart of processes"
    )
    return Diagnostic(Code.ZENOH_ROUTER_TRUSTED, "rmw_zenoh_cpp", text)
