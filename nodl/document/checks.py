"""Small checkers over lined YAML values, which raise ``InvalidNoDLDocumentError`` with file:line. Performs no I/O."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from enclave_common.terminal import quoted
from nodl.errors import InvalidNoDLDocumentError
from nodl.yaml_text import YamlList, YamlMap, YamlScalar, YamlValue

Checker = Callable[[YamlValue, str], None]


def fail(value: YamlValue, message: str) -> None:
    """Raise ``InvalidNoDLDocumentError`` with the place of ``value``."""
    raise InvalidNoDLDocumentError.at(value.source, message)


def text_of(pattern: str | None = None, meaning: str = "") -> Checker:
    """Check for text in which ``pattern``, if given, is found; ``meaning`` says in the error what that is."""
    compiled = re.compile(pattern) if pattern else None

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlScalar) or not isinstance(value.value, str):
            fail(value, f"{what} must be text")
        elif compiled and not compiled.search(value.value):
            fail(value, f"{what} {quoted(value.value)} is not {meaning}")

    return check


def one_of(*allowed: str) -> Checker:
    """Check for one of the given words."""

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlScalar) or value.value not in allowed:
            fail(value, f"{what} must be one of {', '.join(allowed)}")

    return check


def integer(minimum: int, maximum: int | None = None) -> Checker:
    """Check for an integer within bounds."""

    def check(value: YamlValue, what: str) -> None:
        number = value.value if isinstance(value, YamlScalar) else None
        if isinstance(number, float) and number.is_integer():  # JSON Schema takes 1.0 for an integer
            number = int(number)
        if isinstance(number, bool) or not isinstance(number, int):
            fail(value, f"{what} must be an integer")
        elif number < minimum or (maximum is not None and number > maximum):
            limit = f"at least {minimum}" if maximum is None else f"between {minimum} and {maximum}"
            fail(value, f"{what} must be {limit}")

    return check


def boolean(value: YamlValue, what: str) -> None:
    """Check for ``true`` or ``false``."""
    if not isinstance(value, YamlScalar) or not isinstance(value.value, bool):
        fail(value, f"{what} must be true or false")


def number(value: YamlValue, what: str) -> None:
    """Check for an integer or a float."""
    given = value.value if isinstance(value, YamlScalar) else None
    if isinstance(given, bool) or not isinstance(given, (int, float)):
        fail(value, f"{what} must be a number")


def anything(value: YamlValue, what: str) -> None:
    """Check nothing."""


def list_of(item: Checker, length: int | None = None, minimum: int = 0) -> Checker:
    """Check for a list whose elements pass ``item``."""

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlList):
            fail(value, f"{what} must be a list")
            return
        if length is not None and len(value.items) != length:
            fail(value, f"{what} must have exactly {length} elements")
        if len(value.items) < minimum:
            fail(value, f"{what} must have at least {minimum} elements")
        for index, each in enumerate(value.items):
            item(each, f"{what}[{index}]")

    return check


def map_of(
    keys: Mapping[str, Checker] | None = None,
    required: tuple[str, ...] = (),
    others: Checker | None = None,
    patterns: Mapping[str, Checker] | None = None,
    also: Callable[[YamlMap, str], None] | None = None,
    example: str = "",
) -> Checker:
    """Check for a mapping: known ``keys``, else by ``patterns``, else ``others``; an unknown key is an error.

    ``example`` is a valid one, shown where a required key is missing.
    """

    def check(value: YamlValue, what: str) -> None:
        if not isinstance(value, YamlMap):
            fail(value, f"{what} must be a mapping")
            return
        if missing := [f"'{name}'" for name in required if name not in value.items]:
            shown_example = f", for example {example}" if example else ""
            fail(
                value, f"{what} needs the key{'s' if missing[1:] else ''} {', '.join(missing)}{shown_example}"
            )
        for name, each in value.items.items():
            by_pattern = (c for p, c in (patterns or {}).items() if re.fullmatch(p, name))
            checker = (keys or {}).get(name) or next(by_pattern, others)
            if checker is None:
                known = ", ".join(keys or ())
                raise InvalidNoDLDocumentError.at(
                    value.keys[name], f"{what} has no key {quoted(name)}; known: {known}"
                )
            checker(each, name if what == "the document" else f"{what}.{name}")
        if also:
            also(value, what)

    return check


def either(*checkers: Checker) -> Checker:
    """Check by the first checker that is content; the complaint is that of the last one."""

    def check(value: YamlValue, what: str) -> None:
        for checker in checkers[:-1]:
            try:
                return checker(value, what)
            except InvalidNoDLDocumentError:
                continue
        return checkers[-1](value, what)

    return check


def null(value: YamlValue, what: str) -> None:
    """Check for nothing, as for a key that takes no argument."""
    if not isinstance(value, YamlScalar) or value.value is not None:
        fail(value, f"{what} takes no argument")
