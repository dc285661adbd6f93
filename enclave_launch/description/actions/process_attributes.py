"""The attributes of ``executable`` and ``node`` elements: how each is read, and since which release."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from enclave_launch.description.actions.events import Shutdown
from enclave_launch.description.markup.entity import Entity
from enclave_launch.ros_rules.distro import Feature, Release

if TYPE_CHECKING:
    from enclave_launch.description.markup.entity import Parser


def _text(entity: Entity, parser: Parser, name: str) -> Any:
    value = entity.get_attr(name, optional=True)
    return None if value is None else parser.parse_substitution(value)


def _flag(entity: Entity, parser: Parser, name: str) -> Any:
    return entity.get_attr(name, data_type=bool, optional=True)


def _count(entity: Entity, parser: Parser, name: str) -> Any:
    return entity.get_attr(name, data_type=int, optional=True)


def _seconds(entity: Entity, parser: Parser, name: str) -> Any:
    value: Any = entity.get_attr(name, data_type=float, optional=True)
    if value is not None and value < 0.0:
        raise ValueError(
            f"Attribute {name} of Entity node expected to be a non-negative value but got `{value}`"
        )
    return value


def _seconds_as_text(entity: Entity, parser: Parser, name: str) -> Any:
    value = _seconds(entity, parser, name)
    return None if value is None else str(value)


def _on_exit(entity: Entity, parser: Parser, name: str) -> Any:
    value = entity.get_attr(name, optional=True)
    if value is None:
        return None
    if value != "shutdown":
        raise ValueError(
            f"Attribute on_exit of Entity node expected to be shutdown but got `{value}`"
            "Other on_exit actions not yet supported"
        )
    return [Shutdown()]


def _environment(entity: Entity, parser: Parser, name: str) -> Any:
    variables = entity.get_attr(name, data_type=list[Entity], optional=True)
    if variables is None:
        return None
    parse = parser.parse_substitution
    environment = {
        tuple(parse(variable.get_attr("name"))): parse(variable.get_attr("value")) for variable in variables
    }
    for variable in variables:
        variable.assert_entity_completely_parsed()
    return environment


# The attribute, the argument of the constructor, what reads it.
_Attribute = tuple[str, str, Callable[[Entity, "Parser", str], Any]]


_ATTRIBUTES: tuple[_Attribute, ...] = (
    ("cwd", "cwd", _text),
    ("name", "name", _text),
    ("launch-prefix", "prefix", _text),
    ("output", "output", _text),
    ("respawn", "respawn", _text),
    ("enclave", "enclave", _text),
    ("machine", "machine", _text),
    ("respawn_delay", "respawn_delay", _seconds),
    ("shell", "shell", _flag),
)


_EXIT_AND_TTY: tuple[_Attribute, ...] = (
    ("on_exit", "on_exit", _on_exit),
    ("emulate_tty", "emulate_tty", _flag),
)


_TIMEOUTS: tuple[_Attribute, ...] = (
    ("respawn_max_retries", "respawn_max_retries", _count),
    ("sigkill_timeout", "sigkill_timeout", _seconds_as_text),
    ("sigterm_timeout", "sigterm_timeout", _seconds_as_text),
)


_ENVIRONMENT: _Attribute = ("env", "additional_env", _environment)


@lru_cache(maxsize=8)
def attributes_of(release: Release) -> tuple[_Attribute, ...]:
    """Parse the optional attributes of a process element, in the order in which upstream reads them."""
    return (
        *_ATTRIBUTES,
        *(_EXIT_AND_TTY if Feature.EXIT_AND_TTY_ATTRIBUTES in release.features else ()),
        *(_TIMEOUTS if Feature.TIMEOUT_ATTRIBUTES in release.features else ()),
        _ENVIRONMENT,
    )
