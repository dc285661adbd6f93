"""Upstream's place of ``is_a``, ``is_a_subclass``, ``isclassinstance``."""

from enclave_launch.description.launch.utilities.basics import is_a, is_a_subclass, isclassinstance

__all__ = ["is_a", "is_a_subclass", "isclassinstance"]
