"""Humble's name for ``some_entities_type``."""

from enclave_launch.description.launch.some_entities_type import (
    SomeEntitiesType as SomeActionsType,
)
from enclave_launch.description.launch.some_entities_type import (
    SomeEntitiesType_types_tuple as SomeActionsType_types_tuple,
)

__all__ = ["SomeActionsType", "SomeActionsType_types_tuple"]
