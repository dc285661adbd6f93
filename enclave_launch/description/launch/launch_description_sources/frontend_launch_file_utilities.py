"""XML or YAML launch file -> launch description."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.frontend.parser import InvalidFrontendLaunchFileError, Parser

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_description import LaunchDescription

__all__ = ["InvalidFrontendLaunchFileError", "get_launch_description_from_frontend_launch_file"]


def get_launch_description_from_frontend_launch_file(
    frontend_launch_file_path: str, *, parser: type[Parser] = Parser
) -> LaunchDescription:
    """Raises ``InvalidFrontendLaunchFileError`` when no front end can read the text, ``OSError``, and the
    errors of elements and substitutions."""
    root, implementation = parser.load(frontend_launch_file_path)
    return implementation.parse_description(root)
