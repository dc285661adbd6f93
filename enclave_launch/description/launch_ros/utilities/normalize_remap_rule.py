"""``(from, to)`` pairs as launch files give them, made pairs of substitutions."""

from __future__ import annotations

from collections.abc import Iterator

from enclave_launch.description.launch.utilities import (
    ensure_argument_type,
    normalize_to_list_of_substitutions,
)
from enclave_launch.description.launch_ros.remap_rule_type import RemapRule, SomeRemapRule, SomeRemapRules
from enclave_launch.description.launch_ros.utilities.remap_rules import PlacedRule


def normalize_remap_rule(remap_rule: SomeRemapRule) -> RemapRule:
    """Only a tuple of two will do; a list of two is a ``TypeError``."""
    ensure_argument_type(remap_rule, tuple, "remap_rule")
    if len(remap_rule) != 2:
        raise TypeError(f"remap_rule must be a tuple of length 2, got length {len(remap_rule)}")
    return PlacedRule.at(
        getattr(remap_rule, "location", None),
        tuple(normalize_to_list_of_substitutions(remap_rule[0])),
        tuple(normalize_to_list_of_substitutions(remap_rule[1])),
    )


def normalize_remap_rules(remap_rules: SomeRemapRules) -> Iterator[RemapRule]:
    """Lazily: whoever keeps the iterator can read the rules once (upstream's composable nodes do)."""
    return map(normalize_remap_rule, remap_rules)
