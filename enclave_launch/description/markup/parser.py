"""``Parser``: markup text -> entities -> actions (API of ``launch.frontend.Parser``)."""

from __future__ import annotations

import itertools
import os
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, TextIO

from enclave_launch.description.launch_description import LaunchDescription
from enclave_launch.description.markup import expose, parse_substitution, tags
from enclave_launch.description.markup.entity import Entity
from enclave_launch.frontend import launch_file
from enclave_launch.frontend.error_location import mark

if TYPE_CHECKING:
    from enclave_launch.description.entity import Action
    from enclave_launch.description.substitution import Substitution


# In the order in which they are tried. Their modules build on this one and are imported when first needed.
_FRONT_ENDS = {
    "xml": "enclave_launch.description.markup.xml",
    "yaml": "enclave_launch.description.markup.yaml",
}

FilePath = str | bytes | os.PathLike[str]


class InvalidLaunchFileError(Exception):
    """A launch file that no loader can read. ``likely_errors``: what each loader said, the likeliest first."""

    def __init__(self, extension: str = "", *, likely_errors: Sequence[BaseException] | None = None) -> None:
        self._extension = extension
        self._likely_errors = likely_errors
        self._error_message = _message(extension, likely_errors or ())
        if extension and likely_errors:
            self.__cause__ = likely_errors[0]

    @property
    def likely_errors(self) -> Sequence[BaseException]:
        return self._likely_errors or ()

    def __str__(self) -> str:
        return self._error_message


def _message(extension: str, errors: Sequence[BaseException]) -> str:
    if not extension or not errors:
        return "The launch file may have a syntax error, or its format is unknown"
    count = "multiple exceptions" if len(errors) > 1 else "exception"
    lines = [f"\n - {type(error).__name__}: {error}" for error in errors]
    return f"Caught {count} when trying to load file of format [{extension}]:{''.join(lines)}"


class InvalidFrontendLaunchFileError(InvalidLaunchFileError):
    """No front end could read the file."""


class Parser:
    """Front end of one syntax. Implementations override ``load`` and ``get_file_extensions``."""

    extensions_loaded = False
    frontend_parsers: dict[str, type[Parser]] | None = None

    @classmethod
    def load_launch_extensions(cls) -> None:
        """Import everything that registers actions and substitutions."""
        tags.load_all()
        cls.extensions_loaded = True

    @classmethod
    def load_parser_implementations(cls) -> None:
        """Find the front ends: ours, in the order in which they are tried."""
        if cls.frontend_parsers is None:
            modules = {name: import_module(module) for name, module in _FRONT_ENDS.items()}
            Parser.frontend_parsers = {name: module.Parser for name, module in modules.items()}

    def parse_action(self, entity: Entity) -> Action:
        """Build the action that ``entity`` describes."""
        return expose.instantiate_action(entity, self)

    def parse_substitution(self, value: str) -> list[Substitution]:
        """Parse text with ``$(...)`` into substitutions."""
        return parse_substitution.parse_substitution(value)

    def parse_if_substitutions(self, value: Any) -> Any:
        """See ``parse_substitution.parse_if_substitutions``."""
        return parse_substitution.parse_if_substitutions(value)

    def escape_characters(self, value: str) -> str:
        """Resolve backslash escapes."""
        return parse_substitution.replace_escaped_characters(value)

    def parse_description(self, entity: Entity) -> LaunchDescription:
        """Parse the root element to a ``LaunchDescription``; raises ``RuntimeError`` unless it is ``launch``."""
        try:
            if entity.type_name != "launch":
                raise RuntimeError("Expected 'launch' as root tag")
            deprecated = entity.get_attr("deprecated", optional=True)
            actions = [self.parse_action(child) for child in entity.children]
            return LaunchDescription(actions, deprecated_reason=deprecated)
        except Exception as error:
            mark(error, entity)
            raise

    @classmethod
    def _implementations(cls) -> dict[str, type[Parser]]:
        cls.load_parser_implementations()
        assert cls.frontend_parsers is not None
        return cls.frontend_parsers

    @classmethod
    def get_available_extensions(cls) -> list[str]:
        """Return the names of the front ends."""
        return list(cls._implementations())

    @classmethod
    def is_extension_valid(cls, extension: str) -> bool:
        """Return True if a front end has this name. Deprecated upstream."""
        warnings.warn(
            "Parser.is_extension_valid is deprecated, use Parser.is_filename_valid instead", stacklevel=2
        )
        return extension in cls._implementations()

    @classmethod
    def get_parser_from_extension(cls, extension: str) -> type[Parser]:
        """Return the front end of this name. Deprecated upstream."""
        warnings.warn(
            "Parser.get_parser_from_extension is deprecated, use Parser.get_parsers_from_filename instead",
            stacklevel=2,
        )
        try:
            return cls._implementations()[extension]
        except KeyError:
            raise RuntimeError("Not recognized frontend implementation") from None

    @classmethod
    def may_parse(cls, filename: str) -> bool:
        """Return True if the name ends like this front end's files."""
        return any(filename.endswith("." + extension) for extension in cls.get_file_extensions())

    @classmethod
    def is_filename_valid(cls, filename: str) -> bool:
        """Return True if the name ends like the files of any front end."""
        return any(parser.may_parse(filename) for parser in cls._implementations().values())

    @classmethod
    def get_parsers_from_filename(cls, filename: str) -> list[type[Parser]]:
        """Return the front ends whose files are named like this, in order."""
        return [parser for parser in cls._implementations().values() if parser.may_parse(filename)]

    @classmethod
    def get_file_extensions_from_parsers(cls) -> set[str]:
        """Return the file name extensions of all front ends."""
        parsers = cls._implementations().values()
        return set(itertools.chain.from_iterable(parser.get_file_extensions() for parser in parsers))

    @classmethod
    def load(cls, file: FilePath | TextIO) -> tuple[Entity, Parser]:
        """Read a file in whichever syntax fits, by its name first; raises ``InvalidFrontendLaunchFileError``."""
        source = launch_file.read(file)
        suggested = cls.get_parsers_from_filename(source.name)
        others = [parser for parser in cls._implementations().values() if parser not in suggested]
        errors: list[Exception] = []
        for parser in suggested + others:
            try:
                return parser.load_source(source)
            except Exception as error:  # each front end's own errors; all are reported together below
                errors.append(error)
        extension = os.path.splitext(source.name)[1][1:] if cls.is_filename_valid(source.name) else ""
        raise InvalidFrontendLaunchFileError(extension, likely_errors=errors)

    @classmethod
    def load_source(cls, source: launch_file.LaunchFile) -> tuple[Entity, Parser]:
        """Parse text that was already read (ours, so that several attempts read a file once)."""
        return cls.load(source.open())

    @classmethod
    def get_file_extensions(cls) -> set[str]:
        """Return extensions of this front end's files, without the leading dot."""
        return set()
