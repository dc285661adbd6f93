"""Names of nodes: which are valid, how often each is used, how a handler matches them; rules that remap names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from enclave_common.source_location import SourceLocation
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.diagnostics.evaluation import node_name_repeated
from enclave_launch.process import RemapRule as ResolvedRule
from enclave_launch.ros_rules.namespaces import make_namespace_absolute as make_namespace_absolute
from enclave_launch.ros_rules.namespaces import prefix_namespace as prefix_namespace
from nodl import names


class NameValidationException(ValueError):
    """A name that rmw would refuse: the reason, the name, and where in it."""

    def __init__(self, error: names.InvalidNameError, what: str):
        position = error.position or 0
        super().__init__(f"Invalid {what}: {error.reason}:\n  '{error.name}'\n   {' ' * position}^")


class InvalidNodeNameException(NameValidationException):
    """A node name that rmw would refuse."""


class InvalidNamespaceException(NameValidationException):
    """A namespace that rmw would refuse."""


def validate_node_name(name: str) -> None:
    """Check a node name; raises ``InvalidNodeNameException``."""
    try:
        names.validate_node_name(name)
    except names.InvalidNameError as error:
        raise InvalidNodeNameException(error, "node name") from None


def validate_namespace(namespace: str) -> None:
    """Check a namespace; raises ``InvalidNamespaceException``."""
    try:
        names.validate_namespace(namespace)
    except names.InvalidNameError as error:
        raise InvalidNamespaceException(error, "namespace") from None


def is_root_namespace(ns: str) -> bool:
    """Return True for ``/``."""
    return ns == "/"


def is_namespace_absolute(ns: str) -> bool:
    """Return True if it begins with ``/``."""
    return ns.startswith("/")


# How often each fully qualified node name was used in this launch, to warn about repeats.

_GLOBAL = "unique_ros_node_names"


def add_node_name(context: LaunchContext, node_name: str) -> None:
    """Count one more node with this fully qualified name."""
    _counts(context)[node_name] += 1


def get_node_name_count(context: LaunchContext, node_name: str) -> int:
    """Return how many nodes with this fully qualified name were counted."""
    return _counts(context)[node_name]


def warn_about_repeats(context: LaunchContext, node_name: str, started_by: str) -> None:
    """Count one more node of this name, started by a process or container, and warn if it is not the first."""
    add_node_name(context, node_name)
    count = get_node_name_count(context, node_name)
    if count > 1:
        context.host.warn(node_name_repeated(node_name, count, started_by))


def _counts(context: LaunchContext) -> Counter[str]:
    """Return the table of counts, from the context's globals, where third-party code may expect it."""
    counts: Counter[str] | None = getattr(context.locals, _GLOBAL, None)
    if counts is None:
        counts = Counter()
        context.extend_globals({_GLOBAL: counts})
    return counts


def matches_node_name(node_name: str) -> Callable[[Any], bool]:
    """Match node actions by their fully qualified name; without a leading slash it is in the root namespace."""
    full_name = node_name if node_name.startswith("/") else f"/{node_name}"
    return lambda action: bool(action.node_name == full_name)


SomeRemapRule = tuple[SomeSubstitutionsType, SomeSubstitutionsType]
SomeRemapRules = Iterable[SomeRemapRule]
RemapRule = tuple[tuple[Substitution, ...], tuple[Substitution, ...]]
RemapRules = Iterable[RemapRule]


# ``(from, to)`` pairs as launch files give them, made pairs of substitutions.


def normalize_remap_rule(remap_rule: SomeRemapRule) -> RemapRule:
    """Normalize a tuple of two; a list of two is a ``TypeError``."""
    ensure_argument_type(remap_rule, tuple, "remap_rule")
    if len(remap_rule) != 2:
        raise TypeError(f"remap_rule must be a tuple of length 2, got length {len(remap_rule)}")
    return PlacedRule.at(
        getattr(remap_rule, "location", None),
        tuple(normalize_to_list_of_substitutions(remap_rule[0])),
        tuple(normalize_to_list_of_substitutions(remap_rule[1])),
    )


def normalize_remap_rules(remap_rules: SomeRemapRules) -> Iterator[RemapRule]:
    """Normalize lazily: whoever keeps the iterator can read the rules once (upstream's composable nodes do)."""
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
    """Return normalized rules as pairs of text."""
    return [
        PlacedRule.at(
            getattr(rule, "location", None),
            perform_substitutions(context, list(rule[0])),
            perform_substitutions(context, list(rule[1])),
        )
        for rule in rules
    ]


def placed(rule: Sequence[str], default: SourceLocation, word: int | None = None) -> ResolvedRule:
    """Return the value that policies are derived from; ``default`` is the place of a plain pair."""
    return ResolvedRule(rule[0], rule[1], getattr(rule, "location", None) or default, word)
