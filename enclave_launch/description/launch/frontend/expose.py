"""Registries of the actions and substitutions that XML and YAML can name (API of ``launch.frontend.expose``).

``parse`` methods are registered by decorator when their module is imported; ``instantiate_*`` calls them.
The modules that register ours are imported when the first unknown name is met, and only then; entry points of
installed packages (``launch.frontend.launch_extension``) are looked up when the name is still unknown.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from enclave_launch.evaluation import distro

if TYPE_CHECKING:
    from ..action import Action
    from ..some_substitutions_type import SomeSubstitutionsType
    from ..substitution import Substitution
    from .entity import Entity
    from .parser import Parser

ParseMethod = Callable[..., tuple[type, dict[str, Any]]]
Exposed = TypeVar("Exposed")
_OUR_PACKAGE = "enclave_launch."

action_parse_methods: dict[str, ParseMethod] = {}
substitution_parse_methods: dict[str, ParseMethod] = {}

# Names that a distribution older than the value does not have; kept beside the registries, which third
# parties may read and which map to plain callables upstream.
_action_since: dict[str, str] = {}
_substitution_since: dict[str, str] = {}


def instantiate_action(entity: Entity, parser: Parser) -> Action:
    """Build the action that ``entity`` names.

    Raises ``RuntimeError`` for an unknown tag, ``ValueError`` for an attribute or child nobody read, and
    whatever the action's ``parse`` or constructor raises; each carries the place (``error_location``).
    """
    from enclave_launch.frontend.error_location import mark

    try:
        type_name = entity.type_name
        parse = _lookup(type_name, action_parse_methods, _action_since)
        if parse is None:
            raise RuntimeError(f"Unrecognized entity of the type: {type_name}")
        action_type, kwargs = parse(entity, parser)
        action: Action = action_type(**kwargs)
    except Exception as error:
        mark(error, entity)
        raise
    action.source_location = entity.source_location
    return action


def instantiate_substitution(
    type_name: str, args: Iterable[SomeSubstitutionsType] | None = None
) -> Substitution:
    """Build the substitution ``$(type_name args...)``; ``RuntimeError`` when there is none of that name."""
    parse = _lookup(type_name, substitution_parse_methods, _substitution_since)
    if parse is None:
        raise RuntimeError(f"Unknown substitution: {type_name}")
    substitution_type, kwargs = parse([] if args is None else args)
    substitution: Substitution = substitution_type(**kwargs)
    return substitution


def is_ours(name: str) -> bool:
    """Whether substitution ``name`` is one of this package's, or unknown: not foreign code."""
    method = _lookup(name, substitution_parse_methods, _substitution_since)
    return method is None or method.__module__.startswith(_OUR_PACKAGE)


def expose_action(name: str, *, since: str = "humble") -> Callable[[Exposed], Exposed]:
    """Register a class with a ``parse`` class method, or a parse function, as element ``name``.

    ``since`` (ours): the first distribution that has the element.
    """
    return _exposer(name, action_parse_methods, _action_since, "action", since)


def expose_substitution(name: str, *, since: str = "humble") -> Callable[[Exposed], Exposed]:
    """Register a class with a ``parse`` class method, or a parse function, as ``$(name ...)``."""
    return _exposer(name, substitution_parse_methods, _substitution_since, "substitution", since)


def _lookup(name: str, methods: dict[str, ParseMethod], since: dict[str, str]) -> ParseMethod | None:
    method = methods.get(name)
    if method is None:
        from enclave_launch.frontend.extensions import load_next_registrations

        while method is None and load_next_registrations():
            method = methods.get(name)
    if name in since and not distro.at_least(since[name]):
        return None
    return method


def _exposer(
    name: str, methods: dict[str, ParseMethod], since: dict[str, str], kind: str, first_distro: str
) -> Callable[[Exposed], Exposed]:
    def expose(exposed: Exposed) -> Exposed:
        method = _parse_method(exposed, name, kind)
        known = inspect.unwrap(methods[name]) if name in methods else method
        if known != method:
            raise RuntimeError(f"Two {kind} parsing methods exposed with the same name: [{name}].")
        methods[name] = _checking_leftovers(method) if kind == "action" else method
        if first_distro != distro.DISTROS[0]:
            since[name] = first_distro
        return exposed

    return expose


def _parse_method(exposed: object, name: str, kind: str) -> ParseMethod:
    if inspect.isclass(exposed):
        method = getattr(exposed, "parse", None)
        if not inspect.ismethod(method):
            raise RuntimeError("Did not find a class method called 'parse' in the class being decorated.")
        return method
    if inspect.isfunction(exposed):
        return exposed
    raise RuntimeError(
        f"Exposed {kind} parser for {name} is not a callable or a class containing a parse method"
    )


def _checking_leftovers(parse: ParseMethod) -> ParseMethod:
    """``parse``, and afterwards a check that every attribute and child of the entity was read."""

    @functools.wraps(parse)
    def parse_and_check(entity: Entity, parser: Parser) -> tuple[type, dict[str, Any]]:
        result = parse(entity, parser)
        entity.assert_entity_completely_parsed()
        return result

    return parse_and_check
