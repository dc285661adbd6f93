"""YAML that a person wrote for us, read strictly: no aliases, no key twice, no unknown key; errors with the place."""

from __future__ import annotations

from typing import TypeVar

import yaml
from pydantic import BaseModel, StrictInt, ValidationError

from enclave_common.yaml_reader import compose_yaml, construct
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
        root = compose_yaml(text.decode("utf-8"))
        _refuse_aliases_and_repeated_keys(root)
        content = None if root is None else construct(root)
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InvalidInputError(f"{where}{line}: {error.problem or 'not YAML'}") from None
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


def _refuse_aliases_and_repeated_keys(root: yaml.Node | None) -> None:
    """Raise ``yaml.MarkedYAMLError``: nothing here needs aliases; of two values under one key only one would count."""
    seen: set[int] = set()
    pending = [] if root is None else [root]
    for node in pending:
        if id(node) in seen:
            raise _refused(node, "aliases are not allowed here")
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            pending += node.value
        elif isinstance(node, yaml.MappingNode):
            _refuse_repeated_keys(node)
            pending += [value for _, value in node.value]


def _refuse_repeated_keys(node: yaml.MappingNode) -> None:
    seen: set[str] = set()
    for key, _ in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise _refused(key, "a key must be a plain word")
        if key.value in seen:
            raise _refused(key, f"{key.value!r} is written twice")
        seen.add(key.value)


def _refused(node: yaml.Node, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
