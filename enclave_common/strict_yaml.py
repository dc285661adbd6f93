"""Read YAML that a person wrote for us: no aliases, no key twice, no unknown key; errors with file and line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import yaml
from pydantic import BaseModel, StrictInt, ValidationError

from enclave_common.terminal import quoted
from enclave_common.words import counted, did_you_mean
from enclave_common.yaml_reader import compose_yaml, line_of, load_strict_yaml, problem_of

MAX_BYTES = 200_000
_SHOWN = 3  # mistakes of one file


class YamlFileError(ValueError):
    """A file that is not what it should be. The text names the file and the line of each mistake."""


# Only what pydantic 1.8 and 2 have in common: no Python union operator, no ``model_*``, no constraint on a list.
class Strict(BaseModel, extra="forbid", frozen=True):
    """Base of all entries: an unknown key is an error."""

    @classmethod
    def prepared(cls, content: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a file in the one form that the fields have."""
        return content


class StrictDocument(Strict, frozen=True):
    """Base of whole files with a version."""

    version: StrictInt


Model = TypeVar("Model", bound=Strict)
Place = Sequence[str | int]
"""Keys and positions that lead to a value, such as ``("accept", 0, "code")``."""


def parse_strict(model: type[Model], text: bytes, where: str) -> Model:
    """Parse a document.

    Args:
        model: What the document must be.
        text: The content of the file, in UTF-8.
        where: The name of the file in errors.

    Returns:
        The document.

    Raises:
        YamlFileError: The text is not such a document; the first three mistakes, one a line.
    """
    if len(text) > MAX_BYTES:
        raise YamlFileError(f"{where}: larger than {MAX_BYTES} bytes")
    try:
        content = load_strict_yaml(text.decode("utf-8")).root
    except yaml.MarkedYAMLError as error:
        raise YamlFileError(problem_of(error, where)) from None
    except (yaml.YAMLError, ValueError, RecursionError):  # numbers, dates, nesting that Python refuses
        raise YamlFileError(f"{where}: not YAML text") from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise YamlFileError(f"{where}: not a mapping with the keys {', '.join(_keys(model))}")
    try:
        document = model(**model.prepared(content))
    except ValidationError as error:
        found = sorted(set(_mistakes(error, model, text.decode("utf-8"))))
        lines = [f"{where}:{line}: {problem}" for line, problem in found]
        more = [f"and {counted(len(lines) - _SHOWN, 'more mistake')}"] if len(lines) > _SHOWN else []
        raise YamlFileError("\n".join((*lines[:_SHOWN], *more))) from None
    version = getattr(document, "version", 1)
    if version != 1:
        raise YamlFileError(f"{where}: version: {version} is not known, only 1 is")
    return document


def line_at(text: str, place: Place) -> int:
    """Return the line of the value at ``place``, or of the nearest value around it."""
    node = compose_yaml(text)
    line = 0 if node is None else line_of(node)
    for step in place:
        found = _below(node, step)
        if found is None:
            break
        key, node = found
        line = line_of(key)
    return line


def _below(node: yaml.Node | None, step: str | int) -> tuple[yaml.Node, yaml.Node] | None:
    if isinstance(node, yaml.MappingNode):
        return next(((key, value) for key, value in node.value if key.value == str(step)), None)
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        return node.value[step], node.value[step]
    return None


def _mistakes(error: ValidationError, model: type[Strict], text: str) -> Iterator[tuple[int, str]]:
    """Yield each mistake with its line."""
    for each in error.errors():
        place = tuple(part for part in each["loc"] if part != "__root__")
        kind = each["type"]
        holder = _model_at(model, place[:-1])
        if kind in ("extra_forbidden", "value_error.extra"):
            known = _keys(holder) if holder else ()
            meant = did_you_mean(str(place[-1]), known) or f"; known are {', '.join(known)}"
            within = _written(place[:-1])
            problem = f"{within}unknown key {quoted(str(place[-1]))}{meant}"
        elif kind in ("missing", "value_error.missing"):
            problem = f"{_written(place[:-1])}the key {place[-1]!r} is missing"
        else:
            problem = f"{_written(place)}{_expectation(kind, each['msg'])}"
        yield line_at(text, place), problem


_EXPECTED = (
    ("str", "a text is expected; put it in quotes if it looks like a number or a date"),
    ("int", "a whole number is expected"),
    ("bool", "true or false is expected"),
    ("list", "a list is expected, such as [one, two]"),
    ("dict", "a mapping is expected, with 'key: value' lines"),
    ("model", "a mapping is expected, with 'key: value' lines"),
)


def _expectation(kind: str, message: str) -> str:
    """Return what pydantic 1 (``type_error.str``) or 2 (``string_type``) expected, in words."""
    if kind == "value_error.strictbool":  # pydantic 1
        kind = "type_error.bool"
    if kind.startswith("type_error.") or kind.endswith("_type"):
        for word, text in _EXPECTED:
            if word in kind.removeprefix("type_error."):
                return text
    return message[:1].lower() + message[1:]


def _written(place: Place) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).lstrip(".")
    return f"{text}: " if text else ""


def _fields(model: type[Strict]) -> dict[str, str]:
    """Map the keys of a document to the names of the fields, which differ where a key is not a valid name in Python."""
    fields = getattr(model, "model_fields", None) or getattr(model, "__fields__", {})
    return {getattr(field, "alias", None) or name: name for name, field in fields.items()}


def _keys(model: type[Strict]) -> tuple[str, ...]:
    return tuple(_fields(model))


def _model_at(model: type[Strict], place: Place) -> type[Strict] | None:
    """Return the model of the mapping at ``place``."""
    current: Any = model
    for step in place:
        if _is_model(current):
            name = _fields(current).get(str(step))
            current = get_type_hints(current).get(name) if name else None
        else:
            current = next(iter(get_args(current)[-1:]), None)
        current = next((each for each in _alternatives(current) if each is not type(None)), None)
    return current if _is_model(current) else None


def _is_model(hint: Any) -> bool:
    # Python 3.10 takes list[int] for a type.
    return get_origin(hint) is None and isinstance(hint, type) and issubclass(hint, Strict)


def _alternatives(hint: Any) -> Iterable[Any]:
    return get_args(hint) if get_origin(hint) is Union else (hint,)
