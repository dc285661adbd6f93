"""Upstream's place of ``perform_substitutions``."""

from enclave_launch.description.launch.utilities.basics import perform_substitutions

__all__ = ["perform_substitutions"]
