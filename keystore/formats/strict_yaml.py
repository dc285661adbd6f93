"""YAML that a person wrote for us, read strictly: no aliases, no key twice, no unknown key; errors with the place."""

from __future__ import annotations

from typing import TypeVar

import yaml
from pydantic import BaseModel, StrictInt, ValidationError

from enclave_common.yaml_reader import load_strict_yaml, problem_of
from keystore.errors import InvalidInputError
from keystore.formats.given_file import MAX_BYTES


# Only what pydantic 1.8 and 2 have in common: no Python union operator, no ``model_*``, no constraint on a list.
class Strict(BaseModel, extra="forbid", frozen=True):
    """The base of all entries: an unknown key is an error."""


class StrictDocument(Strict, frozen=True):
    """The base of whole files."""

    version: StrictInt


_Document = TypeVar("_Document", bound=StrictDocument)


def parse_strict(model: type[_Document], text: bytes, where: str) -> _Document:
    """Parse ``text`` as ``model``; raises InvalidInputError naming ``where`` and the line or the entry."""
    if len(text) > MAX_BYTES:
        raise InvalidInputError(f"{where}: larger than {MAX_BYTES} bytes")
    try:
        content = load_strict_yaml(text.decode("utf-8")).root
    except yaml.MarkedYAMLError as error:
        raise InvalidInputError(problem_of(error, where)) from None
    except (yaml.YAMLError, ValueError, RecursionError):  # numbers, dates, nesting that Python refuses
        raise InvalidInputError(f"{where}: not YAML text") from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        keys = " and ".join(dict.fromkeys(("version", *model.__annotations__)))
        raise InvalidInputError(f"{where}: document: not a mapping with the keys {keys}")
    try:
        document = model(**content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "document"
        raise InvalidInputError(f"{where}: {place}: {first['msg']}") from None
    if document.version != 1:
        raise InvalidInputError(f"{where}: version: {document.version} is not known, only 1 is")
    return document
