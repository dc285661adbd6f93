"""Answers as JSON and back: named tuples and enumerations of a fixed list, nothing else; those kept under one key.

Not ``pickle``: what is read must never be able to run code.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any

from enclave_addons.inference.answers.folder import CacheFolder
from enclave_addons.inference.cpp.entry import Entry, FixedMapping, Solved
from enclave_addons.inference.cpp.reading.built import Definitions
from enclave_addons.inference.start import InferredProgram, LaunchKey
from enclave_common.source_location import SourceLocation
from nodl.dependence import Dependence, Test, Variation, When
from nodl.name_template import NameTemplate, ParameterPart, UnknownPart
from nodl.node_interface import Certainty, ClientLibrary, Endpoint, EndpointKind, Gap, NodeInterface

_RECORDS: dict[str, Callable[..., Any]] = {
    each.__name__: each
    for each in (
        Definitions, Dependence, Endpoint, Entry, Gap, InferredProgram, LaunchKey, NameTemplate, NodeInterface,
        ParameterPart, Solved, SourceLocation, Test, UnknownPart, Variation, When,
    )
}  # fmt: skip
_ENUMERATIONS: dict[str, type[Enum]] = {
    each.__name__: each for each in (Certainty, ClientLibrary, EndpointKind)
}


def encoded(value: object) -> object:
    """Return ``value`` as what JSON has; raises ``TypeError`` for what is not on the list."""
    if isinstance(value, Enum):
        return {"enum": type(value).__name__, "value": value.value}
    if value is None or isinstance(value, str | bool | int | float):
        return value
    name = type(value).__name__
    if name in _RECORDS:
        assert isinstance(value, tuple)
        return {"record": name, "fields": [encoded(each) for each in value]}
    if isinstance(value, Mapping):
        return {"mapping": [[encoded(key), encoded(each)] for key, each in value.items()]}
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):  # a record that is not listed
        return [encoded(each) for each in value]
    raise TypeError(f"{name} is not kept")


def decoded(value: object) -> Any:
    """Return what ``encoded`` was given; lists come back as tuples. Raises ``ValueError`` for anything else."""
    if isinstance(value, list):
        return tuple(decoded(each) for each in value)
    if not isinstance(value, dict):
        return value
    try:
        if "mapping" in value:
            return FixedMapping((decoded(key), decoded(each)) for key, each in value["mapping"])
        if "enum" in value:
            return _ENUMERATIONS[value["enum"]](value["value"])
        return _RECORDS[value["record"]](*(decoded(each) for each in value["fields"]))
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"not an answer of ours: {error}") from error


def variants(folder: CacheFolder, key: str) -> list[Any]:
    """Return the cached answers to one question under ``key``, newest first; none if they cannot be read."""
    content = folder.read(key)
    try:
        return list(decoded(json.loads(content))) if content is not None else []
    except (ValueError, RecursionError):
        return []


def keep_variant(folder: CacheFolder, key: str, variant: object, most: int) -> None:
    """Keep one more answer, and of those before the newest; one that cannot be written is not kept."""
    try:
        folder.write(key, json.dumps(encoded([variant, *variants(folder, key)][:most])).encode())
    except (TypeError, ValueError, RecursionError):
        return
