"""``Parser`` of XML launch files (API of ``launch_xml.Parser``)."""

from __future__ import annotations

from typing import TextIO

from enclave_launch.description.launch.frontend import Parser as BaseParser
from enclave_launch.description.launch.frontend.parser import FilePath
from enclave_launch.description.launch_xml.entity import Entity
from enclave_launch.frontend import launch_file
from enclave_launch.frontend.error_location import mark_at
from enclave_launch.frontend.xml_tree import parse_xml
from enclave_launch.source_location import SourceLocation


class Parser(BaseParser):
    """Front end of ``.launch.xml``."""

    @classmethod
    def load(cls, file: FilePath | TextIO) -> tuple[Entity, Parser]:
        """Root entity and parser of an XML file; raises ``ParseError``, ``RefusedXml``, ``OSError``."""
        return cls.load_source(launch_file.read(file))

    @classmethod
    def load_source(cls, source: launch_file.LaunchFile) -> tuple[Entity, Parser]:
        try:
            root = source.parsed_by(parse_xml)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "line", None) or getattr(error, "position", (0, 0))[0]
            mark_at(error, SourceLocation(source.name, line))
            raise
        return Entity(root, file=source.name), cls()

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        return {"launch.xml", "xml", "launch"}
