"""Upstream's place of ``ensure_argument_type``."""

from enclave_launch.description.launch.utilities.basics import ensure_argument_type

__all__ = ["ensure_argument_type"]
