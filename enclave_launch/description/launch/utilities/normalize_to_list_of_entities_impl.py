"""Upstream's place of ``normalize_to_list_of_entities``."""

from enclave_launch.description.launch.utilities.basics import normalize_to_list_of_entities

__all__ = ["normalize_to_list_of_entities"]
