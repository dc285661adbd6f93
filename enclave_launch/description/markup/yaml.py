"""YAML launch files: ``Entity`` and ``Parser`` of ``launch_yaml``."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any, TextIO

from enclave_common.source_location import SourceLocation
from enclave_common.yaml_reader import load_yaml_with_lines
from enclave_launch.description.markup.entity import Entity as BaseEntity
from enclave_launch.description.markup.entity import check_is_list_entity
from enclave_launch.description.markup.parser import FilePath
from enclave_launch.description.markup.parser import Parser as BaseParser
from enclave_launch.description.typed_values import is_instance_of
from enclave_launch.frontend import launch_file
from enclave_launch.frontend.error_location import mark_at

_NO_LINES: Mapping[int, int] = {}


class Entity(BaseEntity):
    """One YAML value under the key that names it; attributes must already have their type."""

    def __init__(
        self,
        element: Any,
        type_name: str | None = None,
        *,
        parent: Entity | None = None,
        file: str = "",
        lines: Mapping[int, int] = _NO_LINES,
        line: int = 0,
    ) -> None:
        self._element = element
        self._type_name = type_name
        self._parent = parent
        self._file = file
        self._lines = lines
        self._line = line
        self._read_keys: set[str] = set()
        self._children_called = False

    @property
    def type_name(self) -> str:
        return self._type_name  # type: ignore[return-value]  # None only where a caller gave none

    @property
    def parent(self) -> Entity | None:
        return self._parent

    @property
    def source_location(self) -> SourceLocation:
        return SourceLocation(self._file, self._line, str(self._type_name or ""))

    @property
    def children(self) -> list[BaseEntity]:
        self._children_called = True
        if not isinstance(self._element, dict | list):
            raise TypeError(f"Expected a dict or list, got {type(self._element)}:\n---\n{self._element}\n---")
        if isinstance(self._element, list):
            return self._entities(self._element)
        if "children" not in self._element:
            raise ValueError(
                f"Expected entity `{self._type_name}` to have children entities."
                "That can be a list of subentities or a dictionary with a `children` list element"
            )
        self._read_keys.add("children")
        return self._entities(self._element["children"])

    def _entities(self, items: Any) -> list[BaseEntity]:
        entities: list[BaseEntity] = []
        for item in items:
            if len(item) != 1:
                raise RuntimeError(
                    "Subentities must be a dictionary with only one key, which is the entity type"
                )
            type_name = next(iter(item.keys()))
            entities.append(self._entity(item[type_name], type_name, item))
        return entities

    def _entity(self, element: Any, type_name: str, begins_at: Any) -> Entity:
        line = self._lines.get(id(begins_at), self._line)
        return Entity(element, type_name, file=self._file, lines=self._lines, line=line)

    @property
    def given(self) -> Container[str]:
        return self._element if isinstance(self._element, dict) else super().given

    def find_text(self, text: str) -> SourceLocation | None:
        """Return the place of the innermost mapping or list that holds exactly this text."""
        line = _line_of_text(self._element, text, self._lines, self._line)
        return None if line is None else SourceLocation(self._file, line, str(self._type_name or ""))

    def assert_entity_completely_parsed(self) -> None:
        if isinstance(self._element, list):
            if not self._children_called:
                raise ValueError(
                    f"Unexpected nested entity(ies) found in `{self._type_name}`: {self._element}"
                )
            return
        unread = set(self._element.keys()) - self._read_keys
        if unread:
            raise ValueError(f"Unexpected key(s) found in `{self._type_name}`: {unread}")

    def get_attr(
        self, name: str, *, data_type: Any = str, optional: bool = False, can_be_str: bool = True
    ) -> Any:
        if name not in self._element:
            if optional:
                return None
            raise AttributeError(f"Can not find attribute '{name}' in Entity '{self.type_name}'")
        self._read_keys.add(name)
        data = self._element[name]
        if data_type is str:
            if isinstance(data, str):
                return data
        elif check_is_list_entity(data_type):
            return self._children_named(name, data)
        if not is_instance_of(data, data_type, can_be_str=can_be_str):
            raise TypeError(
                f"Attribute '{name}' of Entity '{self.type_name}' expected to be of type '{data_type}', "
                f"got '{type(data)}'"
            )
        return data

    def _children_named(self, name: str, data: Any) -> list[Entity]:
        if isinstance(data, list) and isinstance(data[0], dict):
            return [self._entity(child, name, child) for child in data]
        raise TypeError(
            f"Attribute '{name}' of Entity '{self.type_name}' expected to be a list of dictionaries."
        )


def _line_of_text(element: Any, text: str, lines: Mapping[int, int], line: int) -> int | None:
    if element == text:
        return line
    line = lines.get(id(element), line)
    items = element.values() if isinstance(element, dict) else element if isinstance(element, list) else ()
    found = (_line_of_text(item, text, lines, line) for item in items)
    return next((place for place in found if place is not None), None)


class Parser(BaseParser):
    """Front end of ``.launch.yaml``."""

    @classmethod
    def load(cls, file: FilePath | TextIO) -> tuple[Entity, Parser]:
        """Load a YAML file; return root entity and parser. Raises YAMLError, ``RefusedYaml``, OSError, RuntimeError."""
        return cls.load_source(launch_file.read(file))

    @classmethod
    def load_source(cls, source: launch_file.LaunchFile) -> tuple[Entity, Parser]:
        try:
            document = source.parsed_by(load_yaml_with_lines)
            tree = document.root
            if tree is None:
                raise TypeError("the file is empty, expected the key 'launch'")
            if len(tree) != 1:
                raise RuntimeError("Expected only one root")
            type_name = next(iter(tree.keys()))
        except Exception as error:  # the many types that odd documents raise, here as upstream
            mark_at(error, SourceLocation(source.name, _line_of(error)))
            raise
        line = document.lines.get(id(tree), 1)
        entity = Entity(tree[type_name], type_name, file=source.name, lines=document.lines, line=line)
        return entity, cls()

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        return {"launch.yaml", "launch.yml", "yaml", "yml", "launch"}


def _line_of(error: Exception) -> int:
    mark = getattr(error, "problem_mark", None)
    return mark.line + 1 if mark is not None else 0
