"""Diagnostics of a launch: typed values, each worded in this room and nowhere else. Performs no I/O.

Whether one stops ``--secure`` is said by the list it stands in (``LaunchPlan.problems`` or ``warnings``)."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from itertools import groupby
from typing import NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_common.words import some_of


class Code(str, Enum):
    """Stable names, for programs; ``meaning`` says what all diagnostics of a code have in common."""

    __str__ = str.__str__

    meaning: str

    # of the evaluation
    ARGUMENT_UNKNOWN = "argument-unknown", "A launch argument was given that no launch file reads"
    COMMAND_STDERR = "command-stderr", "A command of the launch file wrote to stderr"
    EXECUTABLE_NOT_BUILT = (
        "executable-not-built",
        "A placeholder stands for an executable that a package lacks",
    )
    FUNCTION_CALLED_AGAIN = (
        "function-called-again",
        "A function that planning called is called again by an event",
    )
    INCLUDE_LEFT_OUT = "include-left-out", "An included file belongs to a package that is not installed"
    LAUNCH_FILE_DEPRECATED = "launch-file-deprecated", "A launch description is marked as deprecated"
    ROS_TIMER_ON_WALL_TIME = "ros-timer-on-wall-time", "A timer on simulated time fires on wall time"
    LOG_LEVEL_MISSING = "log-level-missing", "The action log requires a level since this distribution"
    SCOPE_ENDED = "scope-ended", "What an event starts is not in the group that its handler is written in"
    NODE_NAME_REPEATED = "node-name-repeated", "Several nodes have the same fully qualified name"
    NOT_FORESEEABLE = "not-foreseeable", "An action only exists once a callback has run"
    PACKAGE_NOT_INSTALLED = "package-not-installed", "A placeholder stands for a package"
    PARAMETERS_UNKNOWN = (
        "parameters-unknown",
        "A parameter file cannot be read, so names made from it are not known",
    )
    PARAMETER_TYPE = (
        "parameter-type",
        "A parameter is given a value of another type than its node declares",
    )
    PARAMETER_FILE_MISSING = "parameter-file-missing", "A parameter file does not exist"
    INCLUDE_ARGUMENT_UNKNOWN = (
        "include-argument-unknown",
        "An include gives an argument that the file does not declare, and that resembles one it does",
    )
    ROS_DISTRO_UNKNOWN = "ros-distro-unknown", "ROS_DISTRO names an unknown distribution"
    PROGRAM_NOT_INSTALLED = "program-not-installed", "A placeholder stands for the output of a program"
    PROGRAM_NOT_EXECUTABLE = "program-not-executable", "A program that launch would start does not exist"
    # of interfaces and permissions
    ACTION_REMAP_IDLE = "action-remap-idle", "A remap rule for an action has no effect in this distribution"
    CONFIGURATION_UNUSED = "configuration-unused", "A program ignores a configuration file, or a part of it"
    DESCRIPTIONS_DIFFER = (
        "descriptions-differ",
        "The source of a program and the library differ",
    )
    INTERFACE_UNKNOWN = "interface-unknown", "The name of an interface is not or only partly known"
    LIBRARY_VERSION = "library-version", "A document of the library was written for another version"
    MANIFEST_LACKS = (
        "manifest-lacks",
        "The source of a program makes interfaces that its manifest does not have",
    )
    MANIFEST_OUTDATED = "manifest-outdated", "The source has changed since a manifest was inferred from it"
    RECORD_UNDECIDED = "record-undecided", "A recorded name may be fixed, or the value of a parameter"
    RECORD_LACKS = "record-lacks", "Other descriptions of a node have names that were never recorded"
    RECORDING_INCOMPLETE = "recording-incomplete", "The record of a node may be incomplete"
    NAME_UNREMAPPABLE = "name-unremappable", "A name with two underscores, which no remap rule can name"
    NO_MANIFEST = "no-manifest", "The interfaces of a node or component are unknown"
    NODE_NAME_IMPOSSIBLE = "node-name-impossible", "A node has a name that rcl refuses"
    NODE_NAME_UNKNOWN = "node-name-unknown", "A node chooses its name at run time"
    PATTERN_ACCEPTED = "pattern-accepted", "A partly known name became a wildcard"
    PERMISSIONS_LARGE = "permissions-large", "The permissions of an enclave come near what DDS can carry"
    POLICY_ANSWERS = "policy-answers", "The policy file closes a gap of the manifest"
    POLICY_DENIES_NEED = "policy-denies-need", "The policy file denies what a node needs"
    POLICY_ENCLAVE_UNUSED = (
        "policy-enclave-unused",
        "The policy file has an enclave that this launch does not use",
    )
    POLICY_FILE = "policy-file", "A warning about the policy file itself"
    # of processes and enclaves
    CONTAINER_ELSEWHERE = (
        "container-elsewhere",
        "A component is loaded into a container of another launch",
    )
    ENCLAVE_ATTRIBUTE_UNUSED = "enclave-attribute-unused", "The process names another enclave itself"
    ENCLAVE_OF_SEVERAL_LAUNCHES = (
        "enclave-of-several-launches",
        "Another launch on the keystore uses the enclave too",
    )
    ENCLAVE_SHARED_WITH_LAUNCHER = "enclave-shared-with-launcher", "A process has the launcher's enclave"
    ENCLAVE_TOO_DEEP = "enclave-too-deep", "No certificate can be made for an enclave"
    ENCLAVE_UNGRANTED = "enclave-ungranted", "The enclave of an executable has no permissions"
    MACHINE_ELSEWHERE = "machine-elsewhere", "The launch file assigns a process to another host"
    COMMAND_NEEDS_ENCLAVE = "command-needs-enclave", "A ros2 command would start without an enclave"
    EXECUTABLE_WITHOUT_ENCLAVE = "executable-without-enclave", "An executable gets no enclave"
    # of what could take an enclave away
    CONNEXT_UNTRIED = "connext-untried", "A process runs on RTI Connext, which was not tested"
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
    DISCOVERY_SERVER = (
        "discovery-server",
        "A discovery server, or no discovery, keeps secured processes apart",
    )
    DISCOVERY_OFF = "discovery-off", "A process is set to discover nobody"
    VARIABLE_OVERRIDDEN = "variable-overridden", "A security variable of the launch file has no effect"

    def __new__(cls, value: str, meaning: str = "") -> Code:
        code = str.__new__(cls, value)
        code._value_ = value
        code.meaning = meaning
        return code


class Diagnostic(NamedTuple):
    """One thing that a person should know of a launch. ``subject``: the node, program, enclave or file it is about;
    ``remedy``: what to do next, empty when nothing is wrong. ``str`` is the whole as one message for a person."""

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


def refusal(problems: Iterable[Diagnostic]) -> str:
    """Return what a secured start is refused for, as one message.

    Neighbours with the same remedy share it. Those that differ in their subject alone are one line.
    """
    lines: list[str] = []
    for remedy, group in groupby(problems, lambda problem: problem.remedy):
        kinds: dict[str, list[Diagnostic]] = {}
        for problem in group:
            kinds.setdefault(problem.text.replace(problem.subject, ""), []).append(problem)
        for first, *others in kinds.values():
            also = some_of((_other_than(first, other) for other in others), _NAMED)
            lines.append(f"{first._replace(remedy='')}{f' (the same for {also})' if also else ''}")
        lines += [f"try: {remedy}"] if remedy else []
    return "\n".join((*lines, "nothing was started or written"))


def _other_than(first: Diagnostic, other: Diagnostic) -> str:
    """Return what ``other`` is about: its subject, or its place if both have one subject."""
    return str(other.location) if other.subject == first.subject and other.location else other.subject


_NAMED = 5  # subjects of one cause, by name
