"""The argument scan: which arguments a description declares, found without executing anything.

Rules of launch's scan, oddities included: a nested include is loaded with an empty context, its failures are
swallowed; only the first declaration of a name counts; a list ends at a ``reset``. Upstream repeats the scan of
everything below at each include; here each file is summed up once (``LoadCache``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from enclave_common.words import did_you_mean
from enclave_launch.description.entity import ScanRole
from enclave_launch.host.current import current_host

MISSING_ARGUMENT = "Included launch description missing required argument"
REQUIRED_ARGUMENT = "Required launch argument"
"""Beginnings of upstream's two texts about an argument without a value."""


class Declared(NamedTuple):
    """One declaration. ``given``: argument names of the includes on the way to it, ``None`` without include;
    the text is only wanted when it is missing."""

    required: bool
    description: str
    given: list[str | None] | None = None


class DeclaredArguments(NamedTuple):
    """The arguments that a description declares, and the argument names of all includes (None: needs a context)."""

    declared: dict[str, Declared]
    given: list[str | None]


def check_is_description(description: Any) -> None:
    """Raise as upstream for a Python file that returned no description: ``None`` or a list."""
    description.get_launch_arguments_with_include_launch_description_actions  # noqa: B018


def check_required_arguments(description: Any, given: list[str]) -> None:
    """Raise ``RuntimeError`` unless each required argument is given by the include, or on the way to it."""
    check_is_description(description)
    required = {name: d for name, d in _summarize(description).declared.items() if d.required}
    offers = {id(d.given): d.given for d in required.values() if d.given is not None}
    names = set(given).union(*offers.values())
    if None not in names and required.keys() <= names:
        return
    _complain(required, given)


def misspelt(description: Any, given: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield each given argument that is not declared and resembles one that is, with a question for the person.

    Launch takes any argument: a file may read one that it does not declare.
    """
    declared = _summarize(description).declared
    missed = declared.keys() - set(given)
    for name in given:
        if name not in declared and (question := did_you_mean(name, missed)):
            yield name, question


def _complain(required: dict[str, Declared], given: list[str]) -> None:
    """Raise what upstream raises, in its words: the list of names grows with each argument checked."""
    for name, declared in required.items():
        if declared.given is not None:
            given.extend(_known(declared.given))
        if name not in given:
            raise RuntimeError(
                f"{MISSING_ARGUMENT} '{name}' "
                f"(description: '{declared.description}'), given: [{', '.join(given)}]"
            )


def _known(names: list[str | None]) -> list[str]:
    if None in names:
        raise TypeError("'NoneType' object is not iterable")  # upstream's own stumble, and its error
    return [name for name in names if name is not None]


def _summarize(description: Any) -> DeclaredArguments:
    known: DeclaredArguments | None = getattr(description, "argument_summary", None)
    if known is not None:
        return known
    summary = DeclaredArguments({}, [])
    for entity, conditional in _walk(description.describe_sub_entities(), False):
        if _role(entity) is ScanRole.ARGUMENT:
            conditional = conditional or entity.condition is not None
            entity._conditionally_included = conditional
            required = entity.default_value is None and not conditional
            summary.declared.setdefault(entity.name, Declared(required, entity.description))
        elif _role(entity) is ScanRole.INCLUDE:
            _add_include(summary, entity)
    return summary


def _add_include(summary: DeclaredArguments, include: Any) -> None:
    names = include.argument_names_without_context()
    given: list[str | None] = [None] if names is None else list(names)
    nested = current_host().loads.summary(include.launch_description_source, _summarize)
    if nested is not None:
        given = given + nested.given
        for name, declared in nested.declared.items():
            if name not in summary.declared:
                summary.declared[name] = Declared(declared.required, declared.description, given)
    summary.given.extend(given)


def _role(entity: object) -> ScanRole | None:
    role: ScanRole | None = getattr(entity, "scan_role", None)
    return role


def _walk(entities: Iterable[Any], conditional: bool) -> Iterator[tuple[Any, bool]]:
    """Yield every entity that the scan meets, with True if it stands in a conditional offer."""
    for entity in entities:
        if _role(entity) is ScanRole.RESET:
            return
        yield entity, conditional
        if _role(entity) is ScanRole.INCLUDE:
            continue
        yield from _walk(entity.describe_sub_entities(), False)
        for _, offered in entity.describe_conditional_sub_entities():
            yield from _walk(offered, True)


def collect_arguments(description: Any, conditional: bool) -> list[tuple[Any, list[Any] | None]]:
    """Return the declarations, each with the list of includes that all below one include share."""
    found: dict[str, tuple[Any, list[Any] | None]] = {}

    def collect(entities: Iterable[Any], conditional: bool, includes: list[Any] | None) -> None:
        for entity in entities:
            if _role(entity) is ScanRole.RESET:
                return
            if _role(entity) is ScanRole.ARGUMENT and entity.name not in found:
                entity._conditionally_included = conditional or entity.condition is not None
                found[entity.name] = (entity, includes)
            below = includes
            if _role(entity) is ScanRole.INCLUDE:
                below = [] if includes is None else includes
                below.append(entity)
            collect(entity.describe_sub_entities(), False, below)
            for _, offered in entity.describe_conditional_sub_entities():
                collect(offered, True, below)

    collect(description.entities, conditional, None)
    return list(found.values())
