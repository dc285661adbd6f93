"""What is told of a process that its enclave might not protect: domains, middlewares, prefixes, variables. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_launch.boundary.words import some_of
from enclave_launch.diagnostics import Code, Diagnostic
from enclave_launch.source_location import SourceLocation


def connext(process: str, place: SourceLocation) -> Diagnostic:
    """No refusal: the source of rmw_connextdds was read, the middleware was not run."""
    text = (
        f"{process} runs on RTI Connext: rmw_connextdds reads enclaves (its source says so), but nothing here was "
        "tried on it; permissions name topics as ROS does (rt/chatter), topic aliases of plain Connext need both names"
    )
    return Diagnostic(Code.CONNEXT_UNTRIED, process, text, place)


def handshake_fails(fast: str, cyclone: str, *, planned: bool) -> Diagnostic:
    """The two DDS choose by certificate subject who begins a handshake; ``planned``: told
    of a plan, before certificates are looked at."""
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
        new or "run both on one DDS, or remove one of the enclaves from the keystore so that it is made anew"
    )
    return Diagnostic(Code.HANDSHAKE_FAILS, fast, text, None, remedy)


def domain_invalid(process: str, why: str, place: SourceLocation) -> Diagnostic:
    """rcl does not start with such a ``ROS_DOMAIN_ID``."""
    return Diagnostic(Code.DOMAIN_INVALID, process, f"{process}: {why}", place, "it could not start")


def domain_not_served(process: str, domain: int, served: str, place: SourceLocation) -> Diagnostic:
    """``served`` is what ``--domain-id`` asks for."""
    asked = "--domain-id (ProvisionOptions.domains)"
    text = f"{process} is in domain {domain}, but {asked} asks for permissions for {served} only"
    return Diagnostic(
        Code.DOMAIN_NOT_SERVED, process, text, place, "add the domain there, or leave it out here"
    )


def domains_shared(enclave: str, domains: str, processes: tuple[str, ...]) -> Diagnostic:
    """Permissions name domains for the enclave as a whole, so its processes may join each other's."""
    text = (
        f"enclave {enclave} may join domains {domains}, each of its processes all of them ({', '.join(processes)}); "
        "give those of each domain an enclave of their own"
    )
    return Diagnostic(Code.DOMAINS_SHARED, enclave, text)


def library_preloaded(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    """``variable``: such as ``LD_PRELOAD``."""
    text = f"{variable} puts {value!r} into {process} before its own libraries: it can do all that the enclave may"
    return Diagnostic(Code.LIBRARY_PRELOADED, process, text, place)


def middleware_refused(
    process: str, middleware: str, why: str, place: SourceLocation, *, by_launch_file: bool
) -> Diagnostic:
    """``by_launch_file``: it sets the variable itself."""
    origin = "the launch file" if by_launch_file else "the environment"
    text = f"{process} would run on {middleware} (RMW_IMPLEMENTATION of {origin}) and not be secured: {why}"
    known = (
        "rmw_cyclonedds_cpp, rmw_fastrtps_cpp, rmw_fastrtps_dynamic_cpp and rmw_connextdds read enclaves, "
        "rmw_zenoh_cpp is secured by its router"
    )
    accept = f"; vouch for it with --accept-middleware {middleware}" if "not known" in why else ""
    return Diagnostic(Code.MIDDLEWARE_REFUSED, process, text, place, known + accept)


def prefix_refused(process: str, wrapper: str, why: str, place: SourceLocation) -> Diagnostic:
    """``wrapper`` is the program of the launch prefix that stands between."""
    text = f"{process} would be started through {wrapper!r} and might not be secured: {why}"
    return Diagnostic(
        Code.PREFIX_REFUSED, process, text, place, f"if it keeps ROS_SECURITY_*, --accept-prefix {wrapper}"
    )


def security_configured(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    """``variable`` holds a DDS configuration, such as ``CYCLONEDDS_URI``."""
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    text = f"{variable} of {process} has security settings of its own, beside those of its enclave: {shown}"
    return Diagnostic(
        Code.SECURITY_CONFIGURED, process, text, place, "take them out: which of them win is not known"
    )


def variable_overridden(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    """``--secure`` sets the variable for every process."""
    text = f"{variable}={value} of the launch file has no effect on {process} under --secure"
    return Diagnostic(Code.VARIABLE_OVERRIDDEN, process, text, place)


def names_apart(what: str, name: str, on_dds: str, on_zenoh: str) -> Diagnostic:
    """``on_dds``, ``on_zenoh``: nodes with one end each."""
    text = f"{what} {name}: {on_dds} is on DDS and {on_zenoh} on Zenoh (RMW_IMPLEMENTATION); they never meet"
    remedy = "give both the same middleware, or put a bridge between them and give it an enclave on each"
    return Diagnostic(Code.MIDDLEWARES_APART, name, text, None, remedy)


def launcher_apart(
    service: str, launcher: str, process: str, middleware: str, place: SourceLocation
) -> Diagnostic:
    """Launch loads components and changes states by service calls of its own."""
    text = (
        f"launch itself runs on {launcher} and must call {service} of {process}, which runs on {middleware}"
    )
    remedy = (
        f"they never meet: start launch with RMW_IMPLEMENTATION={middleware}, or give {process} the other"
    )
    return Diagnostic(Code.MIDDLEWARES_APART, service, text, place, remedy)


def enclave_on_both(enclave: str) -> Diagnostic:
    """One enclave, two middlewares: one key may do the same on both."""
    text = (
        f"enclave {enclave} has processes on DDS and on Zenoh: whoever holds its key may do the same on both, and what "
        "only one of them checks (types and node tokens on Zenoh, permissions by each peer on DDS) the other does not"
    )
    return Diagnostic(Code.MIDDLEWARES_APART, enclave, text, None, "give them enclaves of their own")


def zenoh_cannot_grant(enclave: str, gap: str) -> Diagnostic:
    """``gap``: such as a wildcard that Zenoh's key expressions do not have."""
    text = f"enclave {enclave} is on Zenoh, where this cannot be granted and is denied: {gap}"
    return Diagnostic(Code.ZENOH_CANNOT_GRANT, enclave, text, None, "name what is meant, one by one")


def zenoh_router_trusted(processes: Sequence[str]) -> Diagnostic:
    """What enforcement by a router means for who must be trusted, told once per plan."""
    text = (
        f"{some_of(processes, 3)} on Zenoh: encryption ends at the router, which reads every message and alone "
        "enforces (on DDS every participant does, end to end); who of several publishers of a topic sent a message is "
        "not proved; ROS_SECURITY_STRATEGY has no effect. In return types are enforced, and what is taken away ends "
        "at once, without a restart of processes"
    )
    return Diagnostic(Code.ZENOH_ROUTER_TRUSTED, "rmw_zenoh_cpp", text)
