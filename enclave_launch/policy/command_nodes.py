"""The nodes of a ``ros2`` command that a launch file runs as a process.

Takes the process and its command; gives the program that the command starts (``ros2 run``, ``ros2 bag record``), or the
interfaces of the nodes that the command makes itself. Performs no I/O.
"""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.source_location import SourceLocation
from enclave_launch.process import UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE, ResolvedProcess
from enclave_launch.ros_rules.ros2_command import (
    CommandNode,
    command_node,
    participant_commands,
    started_program,
)
from nodl.name_template import NameTemplate
from nodl.node_interface import ClientLibrary, Endpoint, NodeInterface

DAEMON_NAME = "_ros2cli_daemon_*"
"""The end is the domain and a random number."""


def only_command(process: ResolvedProcess) -> tuple[str, ...] | None:
    """Return the command of ``ros2`` that ``process`` runs, None without one or with several."""
    commands = commands_of(process)
    return commands[0] if len(commands) == 1 else None


def commands_of(process: ResolvedProcess) -> tuple[tuple[str, ...], ...]:
    """Return the commands of ``ros2`` with a participant that an ``executable`` runs; none of any other process."""
    if process.kind != "executable":
        return ()
    return participant_commands(process.cmd[len(process.prefix) :], shell=process.shell)


def program_of_command(process: ResolvedProcess, command: Sequence[str]) -> ResolvedProcess | None:
    """Return ``process`` as the node that ``command`` runs; None if the command is one itself."""
    program = started_program(command)
    if program is None:
        return None
    started = _as_node(process, program.executable)._replace(
        package=program.package, cmd=(program.executable, *program.arguments)
    )
    return started._replace(parameters={"record.topics": program.topics}) if program.topics else started


def interfaces_of_command(
    process: ResolvedProcess, command: Sequence[str]
) -> tuple[ResolvedProcess, tuple[NodeInterface, ...]] | None:
    """Return ``process`` as the node that ``command`` is, with its interfaces; None if its words do not say them.

    The daemon of ros2cli, which it may start, is a second node.
    """
    node = command_node(command)
    if node is None:
        return None
    source = SourceLocation(process.location.file, process.location.line)
    interfaces = [_interface(node, source)]
    if node.asks_daemon:
        interfaces.append(_interface(CommandNode(DAEMON_NAME, ()), source))
    return _as_node(process, " ".join(("ros2", *command[1:3]))), tuple(interfaces)


def _as_node(process: ResolvedProcess, executable: str) -> ResolvedProcess:
    return process._replace(
        kind="node",
        executable=executable,
        cmd=(executable,),
        prefix=(),
        shell=False,
        name=UNSPECIFIED_NODE_NAME,
        fqn=f"{UNSPECIFIED_NODE_NAMESPACE}/{UNSPECIFIED_NODE_NAME}",
    )


def _interface(node: CommandNode, source: SourceLocation) -> NodeInterface:
    return NodeInterface(
        package=None,
        executable="ros2",
        plugin=None,
        name=node.name,
        namespace="/",
        endpoints=tuple(
            Endpoint(each.kind, NameTemplate.literal(each.name), each.type, source) for each in node.endpoints
        ),
        source=source,
        library=ClientLibrary.RCLPY,
        parameter_services=node.parameter_services,
    )
