"""``Entity``: one element of a launch file in any syntax, and the types its attributes are read as."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, List, Protocol, TypeVar, overload  # noqa: UP035  (upstream names typing.List)

if TYPE_CHECKING:
    from collections.abc import Container

    from enclave_common.source_location import SourceLocation


T = TypeVar("T")


class _Everything:
    def __contains__(self, name: object) -> bool:
        return True


_EVERYTHING = _Everything()


class Entity:
    """Element with a type name, attributes and children. XML and YAML bring the implementations."""

    @property
    def type_name(self) -> str:
        """Return the name of the element: ``node``, ``arg``, ..."""
        raise NotImplementedError()

    @property
    def parent(self) -> Entity | None:
        """Raise ``NotImplementedError``, since upstream's front ends never know the parent either."""
        raise NotImplementedError()

    @property
    def children(self) -> list[Entity]:
        """Return all child elements, in order; asking for them counts as having read them."""
        raise NotImplementedError()

    @property
    def source_location(self) -> SourceLocation | None:
        """Return file, line and element name (ours; upstream has no positions)."""
        return None

    @property
    def given(self) -> Container[str]:
        """Return the names for which ``get_attr`` may find something; by default any name.

        Not in upstream: most optional attributes are absent, and requesting each takes time."""
        return _EVERYTHING

    @overload
    def get_attr(
        self, name: str, *, data_type: type[T], optional: bool, can_be_str: bool = True
    ) -> T | None: ...

    @overload
    def get_attr(self, name: str, *, data_type: type[T], can_be_str: bool = True) -> T: ...

    @overload
    def get_attr(self, name: str, *, optional: bool, can_be_str: bool = True) -> str | None: ...

    @overload
    def get_attr(self, name: str, *, can_be_str: bool = True) -> str: ...

    @overload
    def get_attr(
        self, name: str, *, data_type: None, optional: bool = False, can_be_str: bool = True
    ) -> Any: ...

    def get_attr(
        self, name: str, *, data_type: Any = str, optional: bool = False, can_be_str: bool = True
    ) -> Any:
        """Read attribute ``name`` as ``data_type``.

        ``data_type``: ``str``, ``int``, ``float``, ``bool``, a ``List`` of one of them, ``None`` for YAML
        typing, or ``List[Entity]`` for the child elements called ``name``. With ``can_be_str`` text without
        the type stays text, because it may hold substitutions.

        Raises ``AttributeError`` when absent and not ``optional`` (else returns ``None``), ``TypeError`` for
        a value of the wrong type.
        """
        raise NotImplementedError()

    def assert_entity_completely_parsed(self) -> None:
        """Raise ``ValueError`` with the names of attributes and children that were not read."""
        raise NotImplementedError()


class Parser(Protocol):
    """The interface that elements need of the front end that reads them; ``markup.parser.Parser`` is one."""

    def parse_action(self, entity: Entity) -> Any: ...
    def parse_substitution(self, value: str) -> Any: ...
    def parse_if_substitutions(self, value: Any) -> Any: ...
    def escape_characters(self, value: str) -> str: ...


# Types that can be requested of front ends (API of ``launch.frontend.type_utils``).

_SCALARS = {"str": str, "bool": bool, "float": float, "int": int}


def check_is_list_entity(data_type: Any) -> bool:
    """Return True if ``data_type`` is a list type whose items are entities."""
    items = getattr(data_type, "__args__", None)
    if not items or getattr(data_type, "__origin__", None) is not list:
        return False
    return isinstance(items[0], type) and issubclass(items[0], Entity)


def get_data_type_from_identifier(type_identifier: str) -> Any:
    """Return ``List[int]`` for ``'list_of_int'``, None for ``'yaml'``; raises ValueError."""
    if type_identifier == "yaml":
        return None
    scalar = _SCALARS.get(type_identifier.removeprefix("list_of_"))
    if scalar is None:
        raise ValueError(f"Got invalid type identifier '{type_identifier}'")
    if type_identifier.startswith("list_of_"):
        return List[scalar]  # type: ignore[valid-type]  # noqa: UP006
    return scalar
