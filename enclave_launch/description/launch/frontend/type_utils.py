"""Types that front ends can be asked for (API of ``launch.frontend.type_utils``)."""

from __future__ import annotations

from typing import Any, List  # noqa: UP035  (upstream's identifiers name typing.List)

from enclave_launch.description.launch.frontend.entity import Entity

_TYPE_OF_IDENTIFIER: dict[str, Any] = {
    "str": str,
    "bool": bool,
    "float": float,
    "int": int,
    "list_of_str": List[str],  # noqa: UP006
    "list_of_bool": List[bool],  # noqa: UP006
    "list_of_float": List[float],  # noqa: UP006
    "list_of_int": List[int],  # noqa: UP006
    "yaml": None,
}


def check_is_list_entity(data_type: Any) -> bool:
    """Whether ``data_type`` is a list type whose items are entities."""
    items = getattr(data_type, "__args__", None)
    if not items or getattr(data_type, "__origin__", None) is not list:
        return False
    return isinstance(items[0], type) and issubclass(items[0], Entity)


def get_data_type_from_identifier(type_identifier: str) -> Any:
    """``'list_of_int'`` -> ``List[int]``; ``'yaml'`` -> ``None``. ``ValueError`` for an unknown one."""
    if type_identifier not in _TYPE_OF_IDENTIFIER:
        raise ValueError(f"Got invalid type identifier '{type_identifier}'")
    return _TYPE_OF_IDENTIFIER[type_identifier]
