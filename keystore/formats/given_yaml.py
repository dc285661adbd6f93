"""Parse a YAML file that the user named."""

from __future__ import annotations

from enclave_common.strict_yaml import Model, YamlFileError, parse_strict
from keystore.errors import InvalidInputError


def parse_given(model: type[Model], text: bytes, where: str) -> Model:
    """Parse YAML as ``model``; raises InvalidInputError naming the file ``where`` and the line of each mistake."""
    try:
        return parse_strict(model, text, where)
    except YamlFileError as error:
        raise InvalidInputError(str(error)) from None
