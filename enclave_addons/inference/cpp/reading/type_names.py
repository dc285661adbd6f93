"""The names of types: ``const std::shared_ptr<a::B<C>> &`` taken apart, interface types as ROS writes them. Pure."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

_NOISE = re.compile(
    r"\b(?:const|volatile|typename|struct|union|class|static|constexpr|inline|mutable|enum)\b"
)
POINTER_MEMBERS = frozenset({
    "SharedPtr", "UniquePtr", "WeakPtr", "ConstSharedPtr", "ConstUniquePtr", "ConstWeakPtr", "Ptr", "ConstPtr",
    "SharedPtrConst",
})  # fmt: skip


class Type(NamedTuple):
    """``name`` qualified as far as known, without template arguments. ``pointer``: nothing is made by declaring one."""

    name: str
    arguments: tuple[Type, ...] = ()
    pointer: bool = False

    @property
    def last(self) -> str:
        return self.name.rpartition("::")[2]

    def __str__(self) -> str:
        inner = f"<{', '.join(map(str, self.arguments))}>" if self.arguments else ""
        return self.name + inner


NO_TYPE = Type("")


@lru_cache(maxsize=8192)
def split_type(written: str) -> tuple[str, tuple[str, ...], str, bool]:
    """Name, template arguments, what follows them (``::SharedPtr``), whether it is a pointer."""
    cleaned = _NOISE.sub(" ", written).strip()
    pointer = cleaned.endswith("*") or cleaned.rstrip("&").rstrip().endswith("*")
    cleaned = re.sub(r"\s+", " ", cleaned.rstrip("&* ")).strip().replace(" ::", "::").replace(":: ", "::")
    start = cleaned.find("<")
    if start < 0:
        return cleaned.lstrip(":"), (), "", pointer
    depth, arguments, last = 0, [], start + 1
    for position in range(start, len(cleaned)):
        character = cleaned[position]
        depth += (character in "<(") - (character in ">)")
        if (character == "," and depth == 1) or depth == 0:
            arguments.append(cleaned[last:position].strip())
            last = position + 1
            if depth == 0:
                return (
                    cleaned[:start].strip().lstrip(":"),
                    tuple(filter(None, arguments)),
                    cleaned[last:],
                    pointer,
                )
    return cleaned[:start].strip().lstrip(":"), (), "", pointer


def ros_type(kind: Type) -> str:
    """Return ``std_msgs::msg::String`` as ``std_msgs/msg/String``; empty for what is not an interface type.

    If generated headers are in reach the name leads to their template, ``String_<...>`` (rosidl_generator_cpp).
    """
    steps = kind.name.split("::")
    if len(steps) == 3 and steps[1] in ("msg", "srv", "action") and steps[2]:
        return "/".join(steps).removesuffix("_")
    return ""
