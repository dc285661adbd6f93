"""API of ``ament_index_python`` for Python launch files, on top of ``nodl.ament_index``."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Literal

from enclave_launch.host.current import current_host
from nodl import ament_index
from nodl.ament_index import INDEX_FOLDER as RESOURCE_INDEX_SUBFOLDER
from nodl.ament_index import PREFIX_VARIABLE
from nodl.ament_index import PREFIX_VARIABLE as AMENT_PREFIX_PATH_ENV_VAR
from nodl.ament_index import InvalidResourceNameError as InvalidResourceNameError
from nodl.ament_index import InvalidResourceTypeNameError as InvalidResourceTypeNameError
from nodl.ament_index import PackageNotFoundError as PackageNotFoundError

__all__ = ["AMENT_PREFIX_PATH_ENV_VAR", "RESOURCE_INDEX_SUBFOLDER"]


def get_search_paths() -> list[str]:
    """Return existing prefixes, the first has precedence; raises ``OSError`` if nothing says where to search."""
    prefixes = current_host().prefixes()
    if not prefixes:
        raise OSError(f"Environment variable '{PREFIX_VARIABLE}' is not set or empty")
    return list(prefixes)


def get_resource(resource_type: str, resource_name: str) -> tuple[str, str]:
    """Return the text and the prefix of a resource; raises LookupError."""
    resource = ament_index.read_resource(resource_type, resource_name, get_search_paths())
    return resource.text, resource.prefix


def get_resources(resource_type: str) -> dict[str, str]:
    """Return the resources of a type: name -> prefix."""
    return ament_index.list_resources(resource_type, get_search_paths())


def get_resource_types() -> set[str]:
    return ament_index.list_resource_types(get_search_paths())


def has_resource(resource_type: str, resource_name: str) -> str | Literal[False]:
    """Return the prefix, or False."""
    return ament_index.find_resource(resource_type, resource_name, get_search_paths()) or False


def get_packages_with_prefixes() -> dict[str, str]:
    return get_resources("packages")


def get_package_prefix(package_name: str) -> str:
    """Return the install prefix of a package; raises ``PackageNotFoundError``, ``ValueError`` for an invalid name."""
    return current_host().find_package_prefix(package_name)


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Return the share directory of a package; raises as ``get_package_prefix``, warns if it does not exist."""
    path = os.path.join(get_package_prefix(package_name), "share", package_name)
    if print_warning and not os.path.exists(path) and not current_host().is_missing(path):
        warnings.warn(f"Share directory for {package_name} ({path}) does not exist.", stacklevel=2)
    return path


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    return Path(get_package_share_directory(package_name, print_warning))
