"""Types of C++ that are known by their name: texts, numbers and containers."""

from __future__ import annotations

from enclave_addons.inference.cpp.reading.declarations import BIT_FIELD

SEQUENCES = frozenset({
    "std::vector", "std::array", "std::list", "std::deque", "std::set", "std::unordered_set", "std::initializer_list",
    "vector", "std::multiset", "std::queue", "std::stack",
})  # fmt: skip
ORDERED = frozenset({"std::set", "std::unordered_set", "set", "std::multiset", "std::priority_queue"})
MAPS = frozenset({"std::map", "std::unordered_map", "map"})
STREAMS = frozenset({"std::stringstream", "std::ostringstream"})
TEXT_CLASSES = frozenset({
    "std::string", "string", "std::string_view", "std::stringstream", "std::ostringstream", "std::filesystem::path",
})  # fmt: skip
NUMBERS = frozenset({
    "bool", "int", "float", "double", "char", "size_t", "std::size_t", "unsigned", "long", "short", "auto",
    "uint8_t", "uint16_t", "uint32_t", "uint64_t", "int8_t", "int16_t", "int32_t", "int64_t", "unsigned int",
    "std::atomic_bool", "std::chrono::milliseconds", "std::chrono::seconds", BIT_FIELD,
})  # fmt: skip


def is_plain_type(name: str) -> bool:
    """Return whether it is a text, number or container."""
    return name in SEQUENCES or name in MAPS or name in TEXT_CLASSES or name in NUMBERS
