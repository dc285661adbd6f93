"""Registries of the actions and substitutions that XML and YAML can name (API of ``launch.frontend.expose``).

``parse`` methods are registered by decorator when their module is imported; ``instantiate_*`` calls them.
A name that is not registered yet is searched in our own modules, then in other installed packages
(``tags``).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from types import FunctionType, MethodType
from typing import TYPE_CHECKING, Any, TypeVar

from enclave_launch.description.markup.tags import registrations_of
from enclave_launch.frontend import error_location
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Since

if TYPE_CHECKING:
    from enclave_launch.description.entity import Action
    from enclave_launch.description.markup.entity import Entity, Parser
    from enclave_launch.description.substitution import SomeSubstitutionsType, Substitution


ParseMethod = Callable[..., tuple[type, dict[str, Any]]]
Exposed = TypeVar("Exposed")
_OUR_PACKAGE = "enclave_launch."

action_parse_methods: dict[str, ParseMethod] = {}
substitution_parse_methods: dict[str, ParseMethod] = {}

# Names that not every release has; kept beside the registries, which third parties may read and which map to
# plain callables upstream.
_METHODS = {"action": action_parse_methods, "substitution": substitution_parse_methods}
_GATES: dict[str, dict[str, Since]] = {"action": {}, "substitution": {}}


def instantiate_action(entity: Entity, parser: Parser) -> Action:
    """Build the action that ``entity`` names.

    Raises ``RuntimeError`` for an unknown tag, ``ValueError`` for an attribute or child that was not read, and
    whatever the action's ``parse`` or constructor raises; each carries the place (``error_location``).
    """
    try:
        type_name = entity.type_name
        parse = _lookup("action", type_name)
        if parse is None:
            raise RuntimeError(f"Unrecognized entity of the type: {type_name}")
        action_type, kwargs = parse(entity, parser)
        action: Action = action_type(**kwargs)
    except Exception as error:  # foreign parse methods too; the error goes on with its place noted
        error_location.mark(error, entity)
        raise
    action.source_location = entity.source_location
    action.built_by_front_end = True
    return action


def instantiate_substitution(
    type_name: str, args: Iterable[SomeSubstitutionsType] | None = None
) -> Substitution:
    """Build the substitution ``$(type_name args...)``; ``RuntimeError`` when there is none of that name."""
    parse = _lookup("substitution", type_name)
    if parse is None:
        raise RuntimeError(f"Unknown substitution: {type_name}")
    substitution_type, kwargs = parse([] if args is None else args)
    substitution: Substitution = substitution_type(**kwargs)
    return substitution


def is_ours(name: str) -> bool:
    """Return True if substitution ``name`` is one of this package's, or unknown: not foreign code."""
    method = _lookup("substitution", name)
    return method is None or method.__module__.startswith(_OUR_PACKAGE)


def expose_action(name: str, *, feature: Since | None = None) -> Callable[[Exposed], Exposed]:
    """Register a class with ``parse``, or a parse function, as element ``name``, of releases with ``feature``."""
    return _exposer("action", name, feature)


def expose_substitution(name: str, *, feature: Since | None = None) -> Callable[[Exposed], Exposed]:
    """Register a class with ``parse``, or a parse function, as ``$(name ...)``, of releases with ``feature``."""
    return _exposer("substitution", name, feature)


def gate_of(kind: str, name: str) -> Since | None:
    """Return the feature that brought the element or substitution ``name``, if not every release has it."""
    _lookup(kind, name)
    return _GATES[kind].get(name)


def _lookup(kind: str, name: str) -> ParseMethod | None:
    gate = _GATES[kind].get(name)
    if gate is not None and not current_release().has(gate):
        return None
    method = _METHODS[kind].get(name)
    return _import_and_lookup(kind, name) if method is None else method


def _import_and_lookup(kind: str, name: str) -> ParseMethod | None:
    for register in registrations_of(kind, name):
        register()
        if name in _METHODS[kind]:
            return _lookup(kind, name)
    return None


def _exposer(kind: str, name: str, gate: Since | None) -> Callable[[Exposed], Exposed]:
    methods = _METHODS[kind]

    def expose(exposed: Exposed) -> Exposed:
        method = _parse_method(exposed, name, kind)
        known = _registered(methods[name]) if name in methods else method
        if known != method:
            raise RuntimeError(f"Two {kind} parsing methods exposed with the same name: [{name}].")
        methods[name] = _checking_leftovers(method) if kind == "action" else method
        if gate is not None:
            _GATES[kind][name] = gate
        return exposed

    return expose


def forget(module: str) -> None:
    """Drop what ``module`` registered: a launch file may register elements, each time it is evaluated."""
    for methods in _METHODS.values():
        for name, method in list(methods.items()):
            registered = _registered(method)
            if getattr(registered, "__self__", registered).__module__ == module:
                del methods[name]


def _registered(method: Any) -> Any:
    while hasattr(method, "__wrapped__"):
        method = method.__wrapped__
    return method


def _parse_method(exposed: object, name: str, kind: str) -> ParseMethod:
    if isinstance(exposed, type):
        method = getattr(exposed, "parse", None)
        if not isinstance(method, MethodType):
            raise RuntimeError("Did not find a class method called 'parse' in the class being decorated.")
        return method
    if isinstance(exposed, FunctionType):
        return exposed
    raise RuntimeError(
        f"Exposed {kind} parser for {name} is not a callable or a class containing a parse method"
    )


def _checking_leftovers(parse: ParseMethod) -> ParseMethod:
    """Wrap ``parse`` with a check that it read every attribute and child of the entity."""

    @functools.wraps(parse)
    def parse_and_check(entity: Entity, parser: Parser) -> tuple[type, dict[str, Any]]:
        result = parse(entity, parser)
        entity.assert_entity_completely_parsed()
        return result

    return parse_and_check
