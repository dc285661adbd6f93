"""Text -> substitution objects (API of ``launch.frontend.parse_substitution``), cached: they never change."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from enclave_launch.description.markup import expose
from enclave_launch.description.substitution import Substitution, TextSubstitution
from enclave_launch.frontend.substitution_grammar import (
    SubstitutionCall,
    Template,
    VisitError,
    called_names,
    parse_template,
    unescape,
)
from enclave_launch.host.current import current_release

if TYPE_CHECKING:
    from enclave_launch.ros_rules.distro import Release


MAX_SHARED_LENGTH = 1024  # characters; longer texts are whole files, parsed once anyway
_shared_for: Release | None = None  # the release whose registered names the cached results used


def replace_escaped_characters(data: str) -> str:
    """Replace backslash and a character by that character."""
    return unescape(data)


def parse_substitution(string_value: str) -> list[Substitution]:
    """Parse text into a new list of substitutions; raises UnexpectedCharacters, UnexpectedEOF, VisitError."""
    global _shared_for
    if "$(" not in string_value:
        return [TextSubstitution(text=unescape(string_value))]
    release = current_release()
    if release is not _shared_for:
        _parse_shared.cache_clear()
        _shared_for = release
    shared = _parse_shared(string_value) if len(string_value) <= MAX_SHARED_LENGTH else None
    if shared is None:
        return _instantiate(parse_template(string_value), string_value)
    return list(shared)


def parse_if_substitutions(value: Any) -> Any:
    """Parse text with ``$(...)``, un-escape other text; lists item by item. Raises ValueError for mixed items."""
    if not isinstance(value, list):
        return _parse_if(value)
    result = [_parse_if(item) for item in value]
    plain_types = {
        type(parsed)
        for item, parsed in zip(value, result, strict=True)
        if not (isinstance(item, str) and isinstance(parsed, list))
    }
    if len(plain_types) > 1:
        raise ValueError("The result is a non-uniform list")
    return result


def _parse_if(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if "$(" not in value:
        return unescape(value)
    parts = parse_substitution(value)
    if len(parts) == 1 and isinstance(parts[0], TextSubstitution):
        return parts[0].text
    return parts


@lru_cache(maxsize=16384)
def _parse_shared(string_value: str) -> tuple[Substitution, ...] | None:
    """Return the substitutions of a text; None if a foreign class takes part, whose objects may have a state."""
    template = parse_template(string_value)
    if not all(expose.is_ours(name) for name in called_names(template)):
        return None
    return tuple(_instantiate(template, string_value))


def _instantiate(template: Template, text: str) -> list[Substitution]:
    return [
        _instantiate_call(part, text) if isinstance(part, SubstitutionCall) else TextSubstitution(text=part)
        for part in template
    ]


def _instantiate_call(call: SubstitutionCall, text: str) -> Substitution:
    args = [_instantiate(argument, text) for argument in call.args]
    try:
        return expose.instantiate_substitution(call.name, args)
    except Exception as error:  # whatever a parse method raises: upstream wraps it in the same way
        raise VisitError(call.rule, text, error) from error
