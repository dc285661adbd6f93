"""API of ``ament_index_python.resources``."""

from __future__ import annotations

from typing import Literal

from enclave_launch.description.ament_index_python.search_paths import get_search_paths
from nodl import ament_index
from nodl.ament_index import InvalidResourceNameError as InvalidResourceNameError
from nodl.ament_index import InvalidResourceTypeNameError as InvalidResourceTypeNameError


def get_resource(resource_type: str, resource_name: str) -> tuple[str, str]:
    """Text and prefix. Raises ``LookupError``."""
    resource = ament_index.read_resource(resource_type, resource_name, get_search_paths())
    return resource.text, resource.prefix


def get_resources(resource_type: str) -> dict[str, str]:
    """Name to prefix."""
    return ament_index.list_resources(resource_type, get_search_paths())


def get_resource_types() -> set[str]:
    return ament_index.list_resource_types(get_search_paths())


def has_resource(resource_type: str, resource_name: str) -> str | Literal[False]:
    """The prefix, or ``False``."""
    return ament_index.find_resource(resource_type, resource_name, get_search_paths()) or False
