"""A launch file as it is written: its arguments, or its description. Nothing of it is executed, but a Python file
is code and runs to give its description. Texts as ``ros2 launch --show-args`` and ``--print`` have them
(ros2launch/ros2launch/api/api.py).
"""

from __future__ import annotations

from collections.abc import Iterator

from enclave_common.terminal import printable
from enclave_launch.description.actions.arguments import DeclareLaunchArgument
from enclave_launch.description.introspection import LaunchIntrospector
from enclave_launch.description.launch_description import LaunchDescription


def arguments_text(description: LaunchDescription) -> str:
    """Return what ``-s`` prints: name, description, default and choices of each argument, in order of declaration."""
    arguments = description.get_launch_arguments()
    blocks = ["Arguments (pass arguments as '<name>:=<value>'):"]
    blocks += ["\n".join(_argument(argument)) for argument in arguments] or ["  No arguments."]
    if any(argument._conditionally_included for argument in arguments):
        blocks.append("* argument(s) which are only used if specific conditions occur")
    return "\n\n".join(blocks) + "\n"


def _argument(argument: DeclareLaunchArgument) -> Iterator[str]:
    yield f"    '{printable(argument.name)}':{'*' if argument._conditionally_included else ''}"
    yield f"        {argument.description}"
    if argument.choices:
        yield f"        one of: {', '.join(repr(choice) for choice in argument.choices)}"
    if argument.default_value is not None:
        default = " + ".join(part.describe() for part in argument.default_value)
        yield f"        (default: {printable(default)})"


def description_text(description: LaunchDescription) -> str:
    """Return what ``-p`` prints: the description as a tree."""
    return LaunchIntrospector().format_launch_description(description) + "\n"
