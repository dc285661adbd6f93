"""API of ``launch.frontend``: markup launch files -> actions."""

from enclave_launch.description.launch.frontend import type_utils
from enclave_launch.description.launch.frontend.entity import Entity
from enclave_launch.description.launch.frontend.expose import expose_action, expose_substitution
from enclave_launch.description.launch.frontend.parser import InvalidFrontendLaunchFileError, Parser

__all__ = [
    "Entity",
    "InvalidFrontendLaunchFileError",
    "Parser",
    "expose_action",
    "expose_substitution",
    "type_utils",
]
