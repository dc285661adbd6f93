"""Remap rules ``(from, to)`` that remember where they were written, so that a permission can name its rule."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from enclave_launch.boundary.light import Any
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.process import RemapRule as ResolvedRule
from enclave_launch.source_location import SourceLocation

SomeRemapRule = tuple[SomeSubstitutionsType, SomeSubstitutionsType]
SomeRemapRules = Iterable[SomeRemapRule]
RemapRule = tuple[tuple[Substitution, ...], tuple[Substitution, ...]]
RemapRules = Iterable[RemapRule]


# ``(from, to)`` pairs as launch files give them, made pairs of substitutions.


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


class PlacedRule(tuple[Any, Any]):
    """A ``(from, to)`` pair as upstream has it, with its place. Equal to the plain pair."""

    location: SourceLocation | None = None

    @classmethod
    def at(cls, location: SourceLocation | None, source: Any, target: Any) -> PlacedRule:
        rule = cls((source, target))
        rule.location = location
        return rule


def performed_remaps(rules: Iterable[Sequence[Any]], context: LaunchContext) -> list[PlacedRule]:
    """Normalized rules as pairs of text."""
    return [
        PlacedRule.at(
            getattr(rule, "location", None),
            perform_substitutions(context, list(rule[0])),
            perform_substitutions(context, list(rule[1])),
        )
        for rule in rules
    ]


def placed(rule: Sequence[str], default: SourceLocation, word: int | None = None) -> ResolvedRule:
    """The value that policies are derived from; ``default`` is where a plain pair counts as written."""
    return ResolvedRule(rule[0], rule[1], getattr(rule, "location", None) or default, word)
