"""What a person is told about a launch: typed values, each worded here and nowhere else.

A ``Diagnostic`` is a value like any other: reports print it, programs ask for its ``code`` and ``location`` (JSON,
SARIF), tests compare it. Whether it stops ``--secure`` is said by the list it stands in (``LaunchPlan.problems`` or
``warnings``). Pure.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from enclave_launch.boundary.suggestion import did_you_mean
from enclave_launch.boundary.terminal import quoted
from enclave_launch.source_location import SourceLocation


class Code(str, Enum):
    """Stable names, for programs; ``meaning`` says what all diagnostics of a code have in common."""

    meaning: str

    # of the evaluation
    ARGUMENT_UNKNOWN = "argument-unknown", "A launch argument was given that no launch file looks at"
    COMMAND_STDERR = "command-stderr", "A command of the launch file wrote to stderr"
    EXECUTABLE_NOT_BUILT = (
        "executable-not-built",
        "A placeholder stands for an executable that a package lacks",
    )
    INCLUDE_LEFT_OUT = "include-left-out", "An included file belongs to a package that is not installed"
    LAUNCH_FILE_DEPRECATED = "launch-file-deprecated", "A launch description calls itself deprecated"
    LOG_LEVEL_MISSING = "log-level-missing", "The action log needs a level since this distribution"
    NODE_NAME_REPEATED = "node-name-repeated", "Several nodes have the same fully qualified name"
    NOT_FORESEEABLE = "not-foreseeable", "An action only exists once a callback has run"
    PACKAGE_NOT_INSTALLED = "package-not-installed", "A placeholder stands for a package"
    PARAMETERS_UNKNOWN = (
        "parameters-unknown",
        "A parameter file cannot be read, so names made from it are not known",
    )
    PARAMETER_FILE_MISSING = "parameter-file-missing", "A parameter file is not there"
    ROS_DISTRO_UNKNOWN = "ros-distro-unknown", "ROS_DISTRO names no distribution that is known here"
    PROGRAM_NOT_INSTALLED = "program-not-installed", "A placeholder stands for what a program would write"
    PROGRAM_NOT_EXECUTABLE = "program-not-executable", "A program that launch would start is not there"
    # of interfaces and permissions
    ACTION_REMAP_IDLE = "action-remap-idle", "A remap rule for an action has no effect in this distribution"
    INTERFACE_UNKNOWN = "interface-unknown", "The name of an interface is not (wholly) known"
    LIBRARY_VERSION = "library-version", "A document of the library was written for another version"
    RECORDING_INCOMPLETE = "recording-incomplete", "What was learnt of a node may not be all of it"
    NAME_UNREMAPPABLE = "name-unremappable", "A name with two underscores, which no remap rule can name"
    NO_MANIFEST = "no-manifest", "Nothing says what a node or component does"
    NODE_NAME_IMPOSSIBLE = "node-name-impossible", "No node can run under the name it is given"
    NODE_NAME_UNKNOWN = "node-name-unknown", "A node names itself in a way that nobody can foresee"
    PATTERN_ACCEPTED = "pattern-accepted", "A partly known name became a wildcard"
    PERMISSIONS_LARGE = "permissions-large", "The permissions of an enclave come near what DDS can carry"
    POLICY_ANSWERS = "policy-answers", "The policy file says what the manifest leaves open"
    POLICY_DENIES_NEED = "policy-denies-need", "The policy file takes away what a node needs"
    POLICY_ENCLAVE_UNUSED = "policy-enclave-unused", "The policy file has an enclave that this launch has not"
    POLICY_FILE = "policy-file", "A remark about the policy file itself"
    # of processes and enclaves
    CONTAINER_ELSEWHERE = (
        "container-elsewhere",
        "A component goes into a container that is not of this launch",
    )
    ENCLAVE_ATTRIBUTE_UNUSED = "enclave-attribute-unused", "The process names another enclave itself"
    ENCLAVE_OF_SEVERAL_LAUNCHES = (
        "enclave-of-several-launches",
        "Another launch on the keystore uses the enclave too",
    )
    ENCLAVE_SHARED_WITH_LAUNCHER = "enclave-shared-with-launcher", "A process has the launcher's enclave"
    ENCLAVE_TOO_DEEP = "enclave-too-deep", "No certificate can be made for an enclave"
    ENCLAVE_UNGRANTED = "enclave-ungranted", "An enclave of an executable may do nothing"
    MACHINE_ELSEWHERE = "machine-elsewhere", "The launch file means a process for another host"
    EXECUTABLE_WITHOUT_ENCLAVE = "executable-without-enclave", "An executable gets no enclave"
    # of what could take an enclave away
    CONNEXT_UNTRIED = "connext-untried", "A process runs on RTI Connext, on which nothing here was tried"
    HANDSHAKE_FAILS = "handshake-fails", "Processes on two DDS implementations cannot authenticate each other"
    DOMAIN_INVALID = "domain-invalid", "A process has an impossible ROS_DOMAIN_ID"
    DOMAIN_NOT_SERVED = "domain-not-served", "A process is in a domain that the permissions leave out"
    DOMAINS_SHARED = "domains-shared", "An enclave may join the domains of several processes"
    MIDDLEWARES_APART = "middlewares-apart", "Nodes on DDS and nodes on Zenoh cannot talk to each other"
    ZENOH_CANNOT_GRANT = "zenoh-cannot-grant", "A permission that DDS can express and Zenoh cannot"
    ZENOH_ROUTER_TRUSTED = "zenoh-router-trusted", "On Zenoh the router is trusted with every message"
    LIBRARY_PRELOADED = "library-preloaded", "The launch file loads a library into a process"
    MIDDLEWARE_REFUSED = "middleware-refused", "The middleware of a process is not known to read enclaves"
    PREFIX_REFUSED = "prefix-refused", "Something between launch and a program may change its environment"
    SECURITY_CONFIGURED = "security-configured", "A DDS configuration has security properties of its own"
    VARIABLE_OVERRIDDEN = "variable-overridden", "A security variable of the launch file has no effect"

    def __new__(cls, value: str, meaning: str = "") -> Code:
        code = str.__new__(cls, value)
        code._value_ = value
        code.meaning = meaning
        return code

    def __str__(self) -> str:
        return str.__str__(self)


class Diagnostic(NamedTuple):
    """``subject``: the node, program, enclave or file it is about; ``remedy``: what to do next, empty when nothing
    is wrong. ``str`` is the whole as one message for a person."""

    code: Code
    subject: str
    text: str
    location: SourceLocation | None = None
    remedy: str = ""

    def __str__(self) -> str:
        place = f"{self.location}: " if self.location else ""
        if self.location and self.location.element:
            place += f"<{self.location.element}> "
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{place}{self.text}{remedy}"


# -- of the evaluation ------------------------------------------------------------------------------------------------


def argument_unknown(name: str, alike: str) -> Diagnostic:
    """``alike``: the question after the name that was probably meant, or empty."""
    text = f"no launch file declares or reads the argument {name!r}{alike}"
    return Diagnostic(Code.ARGUMENT_UNKNOWN, name, text, None, "secure-launch --show-args lists them")


def command_stderr(message: str, command: str) -> Diagnostic:
    return Diagnostic(Code.COMMAND_STDERR, command, message)


def include_left_out(path: str) -> Diagnostic:
    return Diagnostic(
        Code.INCLUDE_LEFT_OUT, path, f"not included, because its package is not installed or lacks it: {path}"
    )


def launch_file_deprecated(file: str | None, reason: str) -> Diagnostic:
    what = "deprecated launch description" if file is None else f"launch file [{file}] is deprecated"
    return Diagnostic(Code.LAUNCH_FILE_DEPRECATED, file or "", f"{what}: {reason}")


def log_level_missing() -> Diagnostic:
    return Diagnostic(
        Code.LOG_LEVEL_MISSING, "log", "the action log now expects a level; log_info is the one without"
    )


def node_name_repeated(node: str, count: int, started_by: str) -> Diagnostic:
    text = (
        f"{started_by}: there are now at least {count} nodes with the name {node} "
        "created within this launch context"
    )
    return Diagnostic(Code.NODE_NAME_REPEATED, node, text)


def not_foreseeable(what: str, location: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.NOT_FORESEEABLE, what, f"not foreseeable: {what}", location)


def executable_not_built(package: str, executable: str, placeholder: str) -> Diagnostic:
    text = f"package '{package}' has no executable '{executable}' yet; using {placeholder} in its place"
    return Diagnostic(Code.EXECUTABLE_NOT_BUILT, f"{package}/{executable}", text)


def package_not_installed(package: str, placeholder: str) -> Diagnostic:
    text = f"package '{package}' is not installed; using {placeholder} in its place"
    return Diagnostic(Code.PACKAGE_NOT_INSTALLED, package, text)


def parameter_file_missing(path: str) -> Diagnostic:
    return Diagnostic(Code.PARAMETER_FILE_MISSING, path, f"Parameter file path is not a file: {path}")


def parameters_unknown(process: str, path: str, why: str, place: SourceLocation) -> Diagnostic:
    text = f"the parameters that {process} would read from {path} are not known: {why}"
    return Diagnostic(
        Code.PARAMETERS_UNKNOWN, process, text, place, "rcl would not start the node with it: mend the file"
    )


def program_not_installed(program: str) -> Diagnostic:
    text = f"program '{program}' is not installed; a placeholder stands for what it would write"
    return Diagnostic(Code.PROGRAM_NOT_INSTALLED, program, text)


def program_not_executable(program: str, text: str, location: SourceLocation | None) -> Diagnostic:
    return Diagnostic(Code.PROGRAM_NOT_EXECUTABLE, program, text, location)


def ros_distro_unknown(name: str, known: Sequence[str], taken: str) -> Diagnostic:
    text = f"ROS_DISTRO={quoted(name)} is not a distribution that is known here: the rules of {taken} are followed"
    remedy = f"set it, or give --distro{did_you_mean(name, known)}"
    return Diagnostic(Code.ROS_DISTRO_UNKNOWN, name, text, None, remedy)


# -- of interfaces and permissions ------------------------------------------------------------------------------------

_OTHER_NAME = "it could not start: give it another name or namespace"
IN_MANIFEST = (
    "describe it in a manifest (secure-nodl infer makes a first one from the source), installed with the package or "
    "named with --nodl"
)


def library_version(program: str, doubt: str, location: SourceLocation) -> Diagnostic:
    remedy = "compare them (secure-nodl library show), and keep a corrected copy in a folder for --library"
    return Diagnostic(Code.LIBRARY_VERSION, program, f"library document {doubt}", location, remedy)


def recording_incomplete(node: str, why: str, manifest: str, place: SourceLocation) -> Diagnostic:
    remedy = "record it once more where it gets so far (--learn); runs are united"
    return Diagnostic(
        Code.RECORDING_INCOMPLETE,
        node,
        f"node {node} is learnt incompletely ({manifest}): {why}",
        place,
        remedy,
    )


def action_remap_idle(node: str, rule: str, action: str, distro: str, place: SourceLocation) -> Diagnostic:
    text = (
        f"remap rule {rule} has no effect on action {action} of node {node}: {distro} remaps only the five names "
        f"below {action}/_action/, one by one"
    )
    return Diagnostic(Code.ACTION_REMAP_IDLE, node, text, place)


def interface_unknown(node: str, why: str, program: str, place: SourceLocation) -> Diagnostic:
    remedy = f"describe {program} in a NoDL manifest (--nodl), or the node in a policy file (--policy)"
    return Diagnostic(Code.INTERFACE_UNKNOWN, node, f"node {node}: {why}", place, remedy)


def policy_answers(unknown: Diagnostic) -> Diagnostic:
    text = f"{unknown.text}; the policy file says what it may do"
    return Diagnostic(Code.POLICY_ANSWERS, unknown.subject, text, unknown.location)


def name_unremappable(node: str, name: str, place: SourceLocation) -> Diagnostic:
    text = f"node {node}: '{name}' contains '__', which no remap rule can name"
    return Diagnostic(Code.NAME_UNREMAPPABLE, node, text, place)


def no_manifest(subject: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.NO_MANIFEST, subject, f"no NoDL manifest for {subject}: {why}", place, IN_MANIFEST)


def node_name_unknown(subject: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(
        Code.NODE_NAME_UNKNOWN, subject, f"{subject}: {why}", place, "give it a name: set name="
    )


def node_name_impossible(node: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.NODE_NAME_IMPOSSIBLE, node, f"node {node}: {why}", place, _OTHER_NAME)


def pattern_accepted(node: str, operation: str, name: str, note: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.PATTERN_ACCEPTED, node, f"node {node} may {operation} {name}: {note}", place)


def permissions_large(enclave: str, text: str) -> Diagnostic:
    return Diagnostic(Code.PERMISSIONS_LARGE, enclave, text)


def policy_enclave_unused(path: str) -> Diagnostic:
    text = f"enclave {path} of the policy file is not used by this launch and was left out"
    return Diagnostic(Code.POLICY_ENCLAVE_UNUSED, path, text)


def policy_denies_need(
    denied: str, enclave: str, node: str, need: str, why: str, place: SourceLocation
) -> Diagnostic:
    text = f"{denied} is denied in enclave {enclave}, but node {node} needs {need} ({why})"
    return Diagnostic(Code.POLICY_DENIES_NEED, node, text, place)


def policy_file(subject: str, text: str) -> Diagnostic:
    """In the words of the keystore's own reader, which knows the place."""
    return Diagnostic(Code.POLICY_FILE, subject, text)


# -- of processes and enclaves ----------------------------------------------------------------------------------------


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
    own = f"{process} has --enclave {enclave} in its own ROS arguments"
    text = f"{own}; its enclave attribute {attribute!r} is not used"
    return Diagnostic(Code.ENCLAVE_ATTRIBUTE_UNUSED, process, text, place)


def enclave_of_several_launches(enclave: str, others: Sequence[str], added: Sequence[str]) -> Diagnostic:
    some = f"{', '.join(added[:4])}{f' and {len(added) - 4} more' if len(added) > 4 else ''}"
    cost = f"; its processes may then also {some}" if added else ""
    text = f"enclave {enclave} is shared with {', '.join(others)}{cost}"
    remedy = (
        "--enclave-scope gives enclaves of their own, secure-keystore shares drops what is not used any more"
    )
    return Diagnostic(Code.ENCLAVE_OF_SEVERAL_LAUNCHES, enclave, text, remedy=remedy)


def enclave_shared_with_launcher(enclave: str) -> Diagnostic:
    return Diagnostic(
        Code.ENCLAVE_SHARED_WITH_LAUNCHER, enclave, f"enclave {enclave} is shared with the launcher itself"
    )


def enclave_too_deep(process: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.ENCLAVE_TOO_DEEP, process, f"{process}: {why}", place, "give it a shorter one")


def enclave_ungranted(enclave: str, processes: tuple[str, ...], place: SourceLocation) -> Diagnostic:
    text = (
        f"{enclave}, the enclave of {', '.join(processes)}, has no permissions: nothing is known of what an executable "
        "says in ROS, and a node in it could not start"
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


def machine_elsewhere(process: str, machine: str, place: SourceLocation) -> Diagnostic:
    text = f"{process} is meant for machine {machine!r}, but a launch starts everything on this host"
    return Diagnostic(
        Code.MACHINE_ELSEWHERE,
        process,
        text,
        place,
        "secure-plan hosts and secure-plan export place it there",
    )


# -- of what could take an enclave away -------------------------------------------------------------------------------


def connext(process: str, place: SourceLocation) -> Diagnostic:
    text = (
        f"{process} runs on RTI Connext: rmw_connextdds reads enclaves (its source says so), but nothing here was "
        "tried on it; permissions name topics as ROS does (rt/chatter), topic aliases of plain Connext need both names"
    )
    return Diagnostic(Code.CONNEXT_UNTRIED, process, text, place)


def handshake_fails(fast: str, cyclone: str, *, planned: bool) -> Diagnostic:
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
    return Diagnostic(Code.DOMAIN_INVALID, process, f"{process}: {why}", place, "it could not start")


def domain_not_served(process: str, domain: int, served: str, place: SourceLocation) -> Diagnostic:
    asked = "--domain-id (ProvisionOptions.domains)"
    text = f"{process} is in domain {domain}, but {asked} asks for permissions for {served} only"
    return Diagnostic(
        Code.DOMAIN_NOT_SERVED, process, text, place, "add the domain there, or leave it out here"
    )


def domains_shared(enclave: str, domains: str, processes: tuple[str, ...]) -> Diagnostic:
    text = (
        f"enclave {enclave} may join domains {domains}, each of its processes all of them ({', '.join(processes)}); "
        "give those of each domain an enclave of their own"
    )
    return Diagnostic(Code.DOMAINS_SHARED, enclave, text)


def library_preloaded(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    text = f"{variable} puts {value!r} into {process} before its own libraries: it can do all that the enclave may"
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


def security_configured(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
    shown = value if len(value) <= 60 else f"{value[:57]}..."
    text = f"{variable} of {process} has security settings of its own, beside those of its enclave: {shown}"
    return Diagnostic(
        Code.SECURITY_CONFIGURED, process, text, place, "take them out: which of them win is not known"
    )


def variable_overridden(process: str, variable: str, value: str, place: SourceLocation) -> Diagnostic:
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
    text = (
        f"launch itself runs on {launcher} and must call {service} of {process}, which runs on {middleware}"
    )
    remedy = (
        f"they never meet: start launch with RMW_IMPLEMENTATION={middleware}, or give {process} the other"
    )
    return Diagnostic(Code.MIDDLEWARES_APART, service, text, place, remedy)


def enclave_on_both(enclave: str) -> Diagnostic:
    text = (
        f"enclave {enclave} has processes on DDS and on Zenoh: whoever holds its key may do the same on both, and what "
        "only one of them checks (types and node tokens on Zenoh, permissions by each peer on DDS) the other does not"
    )
    return Diagnostic(Code.MIDDLEWARES_APART, enclave, text, None, "give them enclaves of their own")


def zenoh_cannot_grant(enclave: str, gap: str) -> Diagnostic:
    text = f"enclave {enclave} is on Zenoh, where this cannot be granted and is denied: {gap}"
    return Diagnostic(Code.ZENOH_CANNOT_GRANT, enclave, text, None, "name what is meant, one by one")


def zenoh_router_trusted(processes: Sequence[str]) -> Diagnostic:
    shown = ", ".join(processes[:3]) + (f" and {len(processes) - 3} more" if len(processes) > 3 else "")
    text = (
        f"{shown} on Zenoh: encryption ends at the router, which reads every message and alone enforces (on DDS every "
        "participant does, end to end); who of several publishers of a topic sent a message is not proved; "
        "ROS_SECURITY_STRATEGY has no effect. In return types are enforced, and what is taken away ends at once, "
        "without a restart of processes"
    )
    return Diagnostic(Code.ZENOH_ROUTER_TRUSTED, "rmw_zenoh_cpp", text)
