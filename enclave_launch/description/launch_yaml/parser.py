"""``Parser`` of YAML launch files (API of ``launch_yaml.Parser``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, TextIO

from enclave_launch.description.launch.frontend import Parser as BaseParser
from enclave_launch.description.launch.frontend.parser import FilePath
from enclave_launch.description.launch_yaml.entity import Entity
from enclave_launch.frontend import launch_file
from enclave_launch.frontend.error_location import mark_at
from enclave_launch.source_location import SourceLocation

if TYPE_CHECKING:
    from enclave_launch.frontend.yaml_tree import YamlDocument


class Parser(BaseParser):
    """Front end of ``.launch.yaml``."""

    @classmethod
    def load(cls, file: FilePath | TextIO) -> tuple[Entity, Parser]:
        """Root entity and parser of a YAML file.

        Raises ``yaml.YAMLError``, ``RefusedYaml``, ``OSError``, and ``RuntimeError`` or a Python exception
        for a document that is no mapping with one key.
        """
        return cls.load_source(launch_file.read(file))

    @classmethod
    def load_source(cls, source: launch_file.LaunchFile) -> tuple[Entity, Parser]:
        try:
            document = source.parsed_by(_parse_yaml)
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


def _parse_yaml(text: str) -> YamlDocument:
    from enclave_launch.frontend.yaml_tree import parse_yaml  # loads PyYAML, which XML does not need

    return parse_yaml(text)


def _line_of(error: Exception) -> int:
    """Line of a YAML error, 0 when it has none."""
    mark = getattr(error, "problem_mark", None)
    return mark.line + 1 if mark is not None else 0
