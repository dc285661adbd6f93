"""Which commands of ``ros2`` in a launch file make a ROS participant, and what each of them talks to. Pure.

Sources: the verbs of ros2topic, ros2service, ros2action, ros2param and ros2lifecycle (ros2/ros2cli), of ros2controlcli
(ros-controls/ros2_control) and of ros2bag (ros2/rosbag2).
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from nodl.builtin_interfaces import PARAMETER_SERVICES
from nodl.endpoint_kind import EndpointKind

_WITHOUT_PARTICIPANT = frozenset(
    ("interface", "pkg", "security", "test", "extensions", "extension_points", "multicast", "plugin")
)
_OF_BAGS = frozenset(("record", "play", "burst"))
_SHELLS = frozenset(("bash", "sh", "dash", "zsh"))
_OPERATORS = ";&|()"
_LONGEST = 50_000  # characters of a command line; the reader of shlex is quadratic in its words


def participant_commands(words: Sequence[str], *, shell: bool) -> tuple[tuple[str, ...], ...]:
    """Return the commands of ``ros2`` in a command line that make a participant."""
    text = " ".join(words) if shell else _script(words)
    return tuple(
        command
        for command in ([tuple(words)] if text is None else _commands(text))
        if len(command) > 1 and os.path.basename(command[0]) == "ros2" and _participates(command[1:])
    )


def instead_of(command: Sequence[str]) -> str:
    """Return what a launch file writes in place of ``command``, or how that gets an enclave."""
    verb, given = command[1], list(command[2:])
    if verb == "run" and len(given) > 1:
        node = f'<node pkg="{given[0]}" exec="{given[1]}"/>'
        return f"write it as a node, which gets an enclave and its permissions: {node}"
    if verb == "launch" and len(given) > 1:
        return "include that launch file: <include file=.../>, so that its nodes are in this plan"
    cure = "give it an enclave (enclave=), and that enclave in a policy file (--policy) what the command uses"
    if verb == "bag" and {"-a", "--all"} & set(given):
        return f"{cure}; name the topics instead of {'-a' if '-a' in given else '--all'}"
    return cure


def _participates(words: Sequence[str]) -> bool:
    if words[0] == "bag":
        return len(words) > 1 and words[1] in _OF_BAGS
    return words[0] not in _WITHOUT_PARTICIPANT and not words[0].startswith("-")


def _script(words: Sequence[str]) -> str | None:
    """Return the script of ``bash -c SCRIPT``."""
    if not words or os.path.basename(words[0]) not in _SHELLS:
        return None
    options = [
        index for index, word in enumerate(words[1:-1], start=1) if word.startswith("-") and "c" in word
    ]
    return words[options[0] + 1] if options else None


def _commands(text: str) -> list[tuple[str, ...]]:
    """Split a shell's text at its operators; a text that is no shell's has no commands."""
    reader = shlex.shlex(text[:_LONGEST].replace("\n", ";"), posix=True, punctuation_chars=_OPERATORS)
    reader.whitespace_split = True
    commands: list[list[str]] = [[]]
    try:
        for word in reader:
            if set(word) <= set(_OPERATORS):
                commands.append([])
            elif commands[-1] or word != "exec":
                commands[-1].append(word)
    except ValueError:
        return []
    return [tuple(command) for command in commands if command]


# What a command talks to, by its words.


@dataclass(frozen=True)
class CommandEndpoint:
    """An endpoint that a command makes. ``name`` is as written: relative ones are below ``/``."""

    kind: EndpointKind
    name: str
    type: str


@dataclass(frozen=True)
class CommandNode:
    """The node that a command makes. ``asks_daemon``: it looks at the graph through the daemon, which it may start."""

    name: str
    endpoints: tuple[CommandEndpoint, ...]
    asks_daemon: bool = False
    parameter_services: bool = False


@dataclass(frozen=True)
class CommandProgram:
    """The program that a command runs, with its arguments and the parameters that the command's words give it."""

    package: str
    executable: str
    arguments: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()


NODE_NAME = "_ros2cli_*"
"""The end is the number of the process."""

_VALUES = frozenset((
    "-r", "--rate", "-p", "--print", "-t", "--times", "-w", "--wait-matching-subscriptions", "--max-wait-time-secs",
    "--keep-alive", "-n", "--node-name", "--qos-profile", "--qos-depth", "--qos-history", "--qos-reliability",
    "--qos-durability", "--qos-liveliness", "--qos-liveliness-lease-duration-seconds", "--spin-time", "--field",
    "--filter", "-l", "--truncate-length", "--timeout", "--window", "-c", "--controller-manager", "--set-state",
    "--prefix", "-o", "--output", "-s", "--storage", "-f", "--serialization-format", "-b", "--max-bag-size", "-d",
    "--max-bag-duration", "--max-cache-size", "--polling-interval", "--compression-mode", "--compression-format",
    "--compression-queue-size", "--compression-threads", "--qos-profile-overrides-path", "--storage-preset-profile",
    "--storage-config-file", "--log-level",
))  # fmt: skip
"""Options that take the next word."""
_NAME = re.compile(r"[~/A-Za-z_][\w/~]*")
_TYPE = re.compile(r"(\w+)/(?:(?:msg|srv|action)/)?(\w+)")
_WIDE_RECORDING = re.compile(
    r"--?(a|all.*|e|regex|services|actions|topic-types|static-topics-path|x|exclude.*)"
)


def command_node(command: Sequence[str]) -> CommandNode | None:
    """Return the node of a command whose words say all that it talks to; None for any other command."""
    verb, words = command[1], _Words.read(command[2:])
    described = _NODES.get((verb, words.positional[0])) if words.positional else None
    return described(words) if described is not None else None


def started_program(command: Sequence[str]) -> CommandProgram | None:
    """Return the program that ``ros2 run`` or ``ros2 bag record TOPIC ...`` starts; None for any other command."""
    if command[1] == "run" and len(command) > 3 and not command[2].startswith("-"):
        return CommandProgram(command[2], command[3], tuple(command[4:]))
    if tuple(command[1:3]) != ("bag", "record") or any(map(_WIDE_RECORDING.fullmatch, command[3:])):
        return None
    words = _Words.read(command[3:])
    if not words.positional or not all(map(_NAME.fullmatch, words.positional)):
        return None
    name = words.value("--node-name")
    renamed = ("--ros-args", "-r", f"__node:={name}") if name else ()
    return CommandProgram("rosbag2_transport", "recorder", renamed, words.positional)


@dataclass(frozen=True)
class _Words:
    """The words of a command, as argparse sorts them."""

    positional: tuple[str, ...]
    options: Mapping[str, str]

    @classmethod
    def read(cls, words: Sequence[str]) -> _Words:
        positional: list[str] = []
        options: dict[str, str] = {}
        rest = iter(words)
        for word in rest:
            option, given, value = word.partition("=")
            if not word.startswith("-") or word == "-":
                positional.append(word)
            elif given or option not in _VALUES:
                options[option] = value
            else:
                options[option] = next(rest, "")
        return cls(tuple(positional), options)

    def value(self, *options: str) -> str:
        return next((self.options[option] for option in options if option in self.options), "")

    def name(self, number: int) -> str | None:
        """Return a positional word that is a name of ROS."""
        word = self.positional[number] if len(self.positional) > number else ""
        return word if _NAME.fullmatch(word) else None

    def type(self, number: int, folder: str) -> str | None:
        """Return a positional word that is a type, with its folder."""
        word = self.positional[number] if len(self.positional) > number else ""
        found = _TYPE.fullmatch(word)
        return f"{found[1]}/{folder}/{found[2]}" if found else None


def _publication(words: _Words) -> CommandNode | None:
    topic, type_name = words.name(1), words.type(2, "msg")
    if topic is None or type_name is None:
        return None
    endpoint = CommandEndpoint(EndpointKind.PUBLISHER, topic, type_name)
    return CommandNode(words.value("-n", "--node-name") or NODE_NAME, (endpoint,))


def _subscription(words: _Words) -> CommandNode | None:
    topic = words.name(1)
    if topic is None:
        return None
    endpoint = CommandEndpoint(EndpointKind.SUBSCRIPTION, topic, words.type(2, "msg") or "")
    return CommandNode(NODE_NAME, (endpoint,), asks_daemon=words.positional[0] == "echo")


def _service_call(words: _Words) -> CommandNode | None:
    service, type_name = words.name(1), words.type(2, "srv")
    if service is None or type_name is None:
        return None
    package, _, name = type_name.split("/")
    endpoint = CommandEndpoint(EndpointKind.SERVICE_CLIENT, service, type_name)
    return CommandNode(f"_ros2cli_requester_{package}_{name}", (endpoint,), parameter_services=True)


def _goal(words: _Words) -> CommandNode | None:
    action, type_name = words.name(1), words.type(2, "action")
    if action is None or type_name is None:
        return None
    endpoint = CommandEndpoint(EndpointKind.ACTION_CLIENT, action, type_name)
    node = f"_ros2cli_send_goal_{words.positional[2].replace('/', '_')}"
    return CommandNode(node, (endpoint,), parameter_services=True)


def _clients(node: str, services: Mapping[str, str]) -> Iterator[CommandEndpoint]:
    for service, type_name in services.items():
        name = f"/{node.strip('/')}/{service}"
        yield CommandEndpoint(EndpointKind.SERVICE_CLIENT, name, type_name)


def _of_node(services: Mapping[str, str]) -> Callable[[_Words], CommandNode | None]:
    def described(words: _Words) -> CommandNode | None:
        node = words.name(1)
        if node is None:
            return None
        return CommandNode(NODE_NAME, tuple(_clients(node, services)), asks_daemon=True)

    return described


def _of_manager(
    *services: str, when_state_is_set: Sequence[str] = ()
) -> Callable[[_Words], CommandNode | None]:
    def described(words: _Words) -> CommandNode | None:
        manager = words.value("-c", "--controller-manager") or "controller_manager"
        if not _NAME.fullmatch(manager):
            return None
        called = (*services, *(when_state_is_set if words.value("--set-state") else ()))
        types = {name: f"controller_manager_msgs/srv/{_camel(name)}" for name in called}
        return CommandNode(NODE_NAME, tuple(_clients(manager, types)), asks_daemon=True)

    return described


def _camel(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


_LIFECYCLE = {
    "get_available_transitions": "lifecycle_msgs/srv/GetAvailableTransitions",
    "change_state": "lifecycle_msgs/srv/ChangeState",
}
_NODES: dict[tuple[str, str], Callable[[_Words], CommandNode | None]] = {
    ("topic", "pub"): _publication,
    **{("topic", verb): _subscription for verb in ("echo", "hz", "bw", "delay")},
    ("service", "call"): _service_call,
    ("action", "send_goal"): _goal,
    **{("param", verb): _of_node(PARAMETER_SERVICES) for verb in ("set", "load", "get", "dump", "delete")},
    ("lifecycle", "set"): _of_node(_LIFECYCLE),
    ("lifecycle", "get"): _of_node({"get_state": "lifecycle_msgs/srv/GetState"}),
    ("control", "load_controller"): _of_manager(
        "load_controller", when_state_is_set=("configure_controller", "switch_controller")
    ),
    ("control", "unload_controller"): _of_manager("unload_controller"),
    ("control", "set_controller_state"): _of_manager(
        "list_controllers", "configure_controller", "switch_controller"
    ),
    ("control", "switch_controllers"): _of_manager("switch_controller"),
    ("control", "list_controllers"): _of_manager("list_controllers"),
}
