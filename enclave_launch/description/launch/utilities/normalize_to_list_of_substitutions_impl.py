"""Upstream's place of ``normalize_to_list_of_substitutions``."""

from enclave_launch.description.launch.utilities.basics import normalize_to_list_of_substitutions

__all__ = ["normalize_to_list_of_substitutions"]
