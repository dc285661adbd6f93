"""Remap rules that remember where they were written, so that a permission can name its rule."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.description.launch.utilities import perform_substitutions
from enclave_launch.process import RemapRule
from enclave_launch.source_location import SourceLocation


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


def placed(rule: Sequence[str], default: SourceLocation) -> RemapRule:
    """The value that policies are derived from; ``default`` is where a plain pair counts as written."""
    return RemapRule(rule[0], rule[1], getattr(rule, "location", None) or default)
