"""Read a file that the user named: a certificate, a key, a request, YAML."""

from __future__ import annotations

from pathlib import Path

from enclave_common.files import read_bytes
from enclave_common.strict_yaml import MAX_BYTES, Model, YamlFileError, parse_strict
from keystore.errors import InvalidInputError, printable


def read_given(path: Path) -> bytes:
    """Read its bytes; raises InvalidInputError for what cannot be read, or is larger than ``MAX_BYTES``."""
    try:
        return read_bytes(path, MAX_BYTES)
    except OSError as error:
        raise InvalidInputError(f"cannot read {printable(path)}: {error.strerror}") from None


def parse_given(model: type[Model], text: bytes, where: str) -> Model:
    """Parse YAML as ``model``; raises InvalidInputError naming the file ``where`` and the line of each mistake."""
    try:
        return parse_strict(model, text, where)
    except YamlFileError as error:
        raise InvalidInputError(str(error)) from None
