"""API of ``ament_index_python.packages``."""

from __future__ import annotations

import os
import pathlib
import warnings

from enclave_launch.description.ament_index_python.resources import get_resources
from enclave_launch.host.current import current_host
from nodl.ament_index import PackageNotFoundError as PackageNotFoundError


def get_packages_with_prefixes() -> dict[str, str]:
    return get_resources("packages")


def get_package_prefix(package_name: str) -> str:
    """Raises ``PackageNotFoundError``; ``ValueError`` for what cannot be a package name."""
    return current_host().find_package_prefix(package_name)


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Raises as ``get_package_prefix``; warns when the directory does not exist."""
    path = os.path.join(get_package_prefix(package_name), "share", package_name)
    if print_warning and not os.path.exists(path) and not current_host().is_missing(path):
        warnings.warn(f"Share directory for {package_name} ({path}) does not exist.", stacklevel=2)
    return path


def get_package_share_path(package_name: str, print_warning: bool = True) -> pathlib.Path:
    return pathlib.Path(get_package_share_directory(package_name, print_warning))
