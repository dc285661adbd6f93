"""All errors about NoDL documents; names and constructors of the NoDL v1 Python API, plus a place.

    NoDLError
    ├── NoNoDLFilesError            the package exports no NoDL
    ├── ExecutableNotFoundError     it does, but not for this executable
    ├── DuplicateNodeError          v1 API: the same executable is described twice
    ├── ConflictingNoDLError        several files disagree; lists them, --nodl chooses
    └── InvalidNoDLError            a document is wrong; ``source`` says where
        ├── InvalidXMLError             not well-formed
        ├── InvalidYAMLError            not well-formed (NoDL v2)
        ├── InvalidNoDLDocumentError    not what the schema asks for
        ├── IncludeError                an include (NoDL v2) that cannot or may not be followed
        ├── UnsupportedInterfaceError   a version we do not know
        └── InvalidElementError         one bad element
            └── InvalidActionError, InvalidParameterError, InvalidTopicError,
                InvalidServiceError, InvalidNodeChildError

The author of the package has to act on all of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from enclave_common.source_location import SourceLocation
from nodl.types import Node

if TYPE_CHECKING:
    from lxml import etree
    from typing_extensions import Self


class NoDLError(Exception):
    """Base class of all NoDL errors."""


class NoManifestError(NoDLError):
    """A folder that was named for its manifests has none."""


class NoNoDLFilesError(NoDLError):
    """A package without NoDL files."""

    def __init__(self, package_name: str):
        super().__init__(f"{package_name} has no NoDL files in its share directory")


class DuplicateNodeError(NoDLError):
    """Two definitions of one node of one executable."""

    def __init__(self, node: Node):
        super().__init__(f"node {node.name} of executable {node.executable} is defined more than once")


class ExecutableNotFoundError(NoDLError):
    """A package whose NoDL files do not describe the executable."""

    def __init__(self, package_name: str, executable_name: str):
        super().__init__(f"the NoDL files of {package_name} do not describe executable '{executable_name}'")


class ConflictingNoDLError(NoDLError):
    """Definitions that contradict each other. ``sources``: the definitions that do not agree."""

    def __init__(self, subject: str, sources: Iterable[SourceLocation]):
        self.sources = tuple(sources)
        listing = "".join(f"\n  {source}" for source in self.sources)
        super().__init__(
            f"conflicting NoDL definitions of {subject}:{listing}\n"
            "keep one of them, or name the file to use with --nodl"
        )


class InvalidNoDLError(NoDLError):
    """A document that cannot be used. ``source`` is ``None`` when made through a v1 constructor."""

    source: SourceLocation | None = None

    @classmethod
    def at(cls, source: SourceLocation, message: str) -> Self:
        """Make the error at a place, whatever the constructor of the v1 API wants."""
        error = cls.__new__(cls)
        NoDLError.__init__(error, f"{source}: {message}")
        error.source = source
        return error


class InvalidXMLError(InvalidNoDLError):
    """A document that no XML parser reads."""

    def __init__(self, err: etree.XMLSyntaxError):
        super().__init__(f"{err.filename}: not well-formed XML: {err.msg}")


class InvalidYAMLError(InvalidNoDLError):
    """A document that no YAML parser reads."""


class InvalidNoDLDocumentError(InvalidNoDLError):
    """Well-formed, and not what the format allows; the message holds file and line."""

    invalid: etree.DocumentInvalid | None = None

    def __init__(self, invalid: etree.DocumentInvalid):
        self.invalid = invalid
        super().__init__(f"not a valid NoDL document: {invalid}")


class IncludeError(InvalidNoDLError):
    """A document that includes another one which cannot be had."""


class InvalidElementError(InvalidNoDLError):
    """An element with content or attributes that it must not have; the message holds file and line."""

    element: etree._Element | None = None

    def __init__(self, message: str, element: etree._Element):
        super().__init__(f"{element.base}:{element.sourceline}: <{element.tag}> {message}")
        self.element = element


class InvalidActionError(InvalidElementError):
    """An ``action`` element that cannot be read."""


class InvalidParameterError(InvalidElementError):
    """A ``parameter`` element that cannot be read."""


class InvalidTopicError(InvalidElementError):
    """A ``topic`` element that cannot be read."""


class InvalidServiceError(InvalidElementError):
    """A ``service`` element that cannot be read."""


class InvalidNodeChildError(InvalidElementError):
    """An element within ``node`` that has no place there."""

    def __init__(self, element: etree._Element) -> None:
        super().__init__("is not allowed in a node, only action, parameter, service and topic are", element)


class UnsupportedInterfaceError(InvalidNoDLError):
    """A version of the format that is newer than what is read here."""

    def __init__(self, version: int, max_version: int) -> None:
        super().__init__(f"interface version {version} is not supported, at most {max_version} is")
