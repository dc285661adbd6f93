"""YAML that a person wrote for us, read strictly: no aliases, no key twice, no unknown key; errors with file and place.

What the governance and the hosts file have in common.
"""

from __future__ import annotations

from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, StrictInt, ValidationError

from keystore.errors import InvalidInputError
from keystore.formats.given_file import MAX_BYTES


# Only what pydantic 1.8 and 2 have in common: no Python union operator, no ``model_*``, no constraint on a list.
class Strict(BaseModel, extra="forbid"):
    """The base of all entries: an unknown key is an error."""


class StrictDocument(Strict):
    """The base of whole files."""

    version: StrictInt


_Document = TypeVar("_Document", bound=StrictDocument)


def parse_strict(model: type[_Document], text: bytes, where: str) -> _Document:
    """``text`` as ``model``; raises InvalidInputError naming ``where`` and the line or the entry."""
    if len(text) > MAX_BYTES:
        raise InvalidInputError(f"{where}: larger than {MAX_BYTES} bytes")
    try:
        content = yaml.load(text, _SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InvalidInputError(f"{where}{line}: {error.problem or 'not YAML'}") from None
    except (yaml.YAMLError, ValueError, RecursionError):  # numbers, dates, nesting that Python refuses
        raise InvalidInputError(f"{where}: not YAML text") from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        keys = " and ".join(name for name in ("version", *_others(model)))
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


def _others(model: type[Strict]) -> list[str]:
    return [name for name in model.__annotations__ if name != "version"]


class _SafeLoader(yaml.SafeLoader):
    """No aliases (nothing here needs them, bombs do) and no key twice."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases are not allowed here", event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                mark = key.start_mark
                raise yaml.constructor.ConstructorError(None, None, "a key must be a plain word", mark)
            if key.value in seen:
                mark = key.start_mark
                raise yaml.constructor.ConstructorError(None, None, f"{key.value!r} is written twice", mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)
