"""A launch description as text, without launching anything."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from enclave_launch.description.actions.events import EmitEvent, RegisterEventHandler
from enclave_launch.description.actions.log import LogInfo
from enclave_launch.description.actions.processes import ExecuteProcess
from enclave_launch.description.entity import Action, LaunchDescriptionEntity
from enclave_launch.description.substitution import SomeSubstitutionsType, normalize_to_list_of_substitutions

if TYPE_CHECKING:
    from enclave_launch.description.events.handlers import BaseEventHandler
    from enclave_launch.description.launch_description import LaunchDescription


_INDENT = "    "


def indent(lines: Iterable[str], indention: str = _INDENT) -> list[str]:
    """Return each line with ``indention`` before it."""
    return [f"{indention}{line}" for line in lines]


def tree_like_indent(lines: Iterable[str]) -> list[str]:
    """Draw branches in front of indented lines."""
    drawn: list[str] = []
    for line in lines:
        if line.startswith(_INDENT):
            depth = len(line) - len(line.lstrip())
            drawn.append(
                "│" + line[1 : depth - 4] + "└── " + line[depth:] if depth > 4 else "├── " + line[4:]
            )
    if drawn:
        drawn[-1] = drawn[-1].replace("├", "└", 1)
    return drawn


def format_substitutions(substitutions: SomeSubstitutionsType) -> str:
    """Return the descriptions of substitutions, joined."""
    return " + ".join(sub.describe() for sub in normalize_to_list_of_substitutions(substitutions))


def format_entities(entities: Iterable[Any]) -> list[str]:
    """Return the lines of each entity in turn."""
    lines: list[str] = []
    for entity in entities:
        lines += format_action(entity) if isinstance(entity, Action) else [f"Unknown entity('{entity}')"]
    return lines


def format_event_handler(event_handler: BaseEventHandler) -> list[str]:
    """Return one line about the handler, then its entities, indented."""
    text, entities = event_handler.describe()
    items = [entities] if isinstance(entities, LaunchDescriptionEntity) else entities
    return [text, *indent(format_entities(items))]


def format_action(action: Action) -> list[str]:
    """Return the lines of one action."""
    if isinstance(action, LogInfo):
        return [f"LogInfo({format_substitutions(action.msg)})"]
    if isinstance(action, EmitEvent):
        return [f"EmitEvent(event='{action.event.name}')"]
    if isinstance(action, ExecuteProcess):
        return [_format_process(action)]
    if isinstance(action, RegisterEventHandler):
        head = f"RegisterEventHandler('{action.event_handler}'):"
        return [head, *indent(format_event_handler(action.event_handler))]
    return [f"Action('{action}')"]


def _format_process(action: ExecuteProcess) -> str:
    cmd = ", ".join(format_substitutions(word) for word in action.cmd)
    cwd = None if action.cwd is None else f"'{format_substitutions(action.cwd)}'"
    env = None
    if action.env is not None:
        pairs = (f"{format_substitutions(name)}: {format_substitutions(value)}" for name, value in action.env)
        env = f"{{{', '.join(pairs)}}}"
    return f"ExecuteProcess(cmd=[{cmd}], cwd={cwd}, env={env}, shell={action.shell})"


class LaunchIntrospector:
    """Formats descriptions."""

    def format_launch_description(self, launch_description: LaunchDescription) -> str:
        lines = tree_like_indent(indent(format_entities(launch_description.entities)))
        return "\n".join([str(launch_description), *lines])
