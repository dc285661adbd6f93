"""Names of nodes, namespaces, topics, services and actions: validity and expansion, as rcl has them.

Used by manifests (what may be written), by inference (what code may say) and
by policy derivation (what a name becomes once launch has decided node name and namespace).

Rules from ros2/design articles/topic_and_service_names, rcl ``validate_topic_name.c`` and
``expand_topic_name.c``, rmw ``validate_node_name.c``, ``validate_namespace.c`` and
``validate_full_topic_name.c``.
"""

from __future__ import annotations

import re

from enclave_common.terminal import quoted

MAX_NODE_NAME_LENGTH = 255
MAX_NAMESPACE_LENGTH = 245
MAX_NAME_LENGTH = 247

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_ABSOLUTE = re.compile(rf"(?:/{_TOKEN})+\Z")
_PLAIN = re.compile(rf"(~?/)?{_TOKEN}(?:/{_TOKEN})*\Z")  # what nearly every name looks like
_SUBSTITUTION = re.compile(r"\{([^{}]*)\}")
_WILDCARDS = frozenset("*?[]")


class InvalidNameError(ValueError):
    """A name that rcl or rmw would refuse. ``position`` counts from 0; ``None``: the whole name."""

    def __init__(self, what: str, name: str, reason: str, position: int | None = None):
        self.what = what
        self.name = name
        self.reason = reason
        self.position = position
        where = "" if position is None else f" (character {position + 1})"
        super().__init__(f"invalid {what} {quoted(name)}: {reason}{where}")


def validate_node_name(name: str) -> None:
    """Accept a single token of at most 255 characters; raises ``InvalidNameError``."""
    if name.isascii() and name.isidentifier() and len(name) <= MAX_NODE_NAME_LENGTH:
        return
    what = "node name"
    if not name:
        raise InvalidNameError(what, name, "must not be empty")
    _check_characters(what, name, allowed="")
    if name[0].isdigit():
        raise InvalidNameError(what, name, "must not start with a digit", 0)
    raise InvalidNameError(what, name, f"is longer than {MAX_NODE_NAME_LENGTH} characters")


def validate_namespace(namespace: str) -> None:
    """Accept ``/`` or an absolute name of at most 245 characters; raises ``InvalidNameError``."""
    if namespace != "/":
        _check_absolute("namespace", namespace, MAX_NAMESPACE_LENGTH)


def validate_full_name(name: str, what: str = "name") -> None:
    """Accept a fully qualified topic, service or action name, <= 247 characters; raises ``InvalidNameError``."""
    _check_absolute(what, name, MAX_NAME_LENGTH)


def is_full_name(name: str) -> bool:
    """Return whether ``name`` is absolute, well-formed and not longer than ROS allows."""
    return len(name) <= MAX_NAME_LENGTH and _ABSOLUTE.match(name) is not None


def is_name(name: str) -> bool:
    """Return True if code may write ``name``, as ``validate_name`` has it."""
    try:
        validate_name(name)
    except InvalidNameError:
        return False
    return True


def validate_name(name: str, what: str = "name") -> None:
    """Accept a name as rcl's ``rcl_validate_topic_name`` does (``~a`` passes); raises ``InvalidNameError``."""
    if not name:
        raise InvalidNameError(what, name, "must not be empty")
    if name[0].isascii() and name[0].isdigit():
        raise InvalidNameError(what, name, "must not start with a digit", 0)
    if name[-1] == "/":
        raise InvalidNameError(what, name, "must not end with '/'", len(name) - 1)
    _check_characters(what, name, allowed="/~{}")
    _check_tilde(what, name)
    _check_braces(what, name)
    _check_tokens(what, name)


def validate_written_name(name: str, what: str = "name") -> None:
    """Accept a name in a manifest; ``~a``, ``a//b`` and wildcards would never match, or match too much."""
    wildcard = next((i for i, c in enumerate(name) if c in _WILDCARDS), None)
    if wildcard is not None:
        raise InvalidNameError(
            what, name, "wildcards are not allowed here; they belong in a policy file (--policy)", wildcard
        )
    validate_name(name, what)
    if name[0] == "~" and name[1:2] not in ("", "/"):
        raise InvalidNameError(what, name, "'~' must be followed by '/'", 1)
    if "//" in name:
        raise InvalidNameError(what, name, "must not contain '//'", name.index("//"))
    unknown = [text for text in _SUBSTITUTION.findall(name) if text not in ("node", "ns", "namespace")]
    if unknown:
        written = "{" + unknown[0] + "}"
        raise InvalidNameError(what, name, f"unknown substitution {written}", name.index(written))


def expand_name(name: str, *, namespace: str, node: str, what: str = "name") -> str:
    """Return ``/ns/x`` for ``x``, ``/ns/node/x`` for ``~/x``, ``/x`` for itself; raises ``InvalidNameError``."""
    plain = _PLAIN.match(name)
    if plain:
        start = plain[1]
        quick = name if start == "/" else join(namespace, f"{node}{name[1:]}" if start else name)
        if len(quick) <= MAX_NAME_LENGTH:
            return quick
    validate_name(name, what)
    expanded = name
    if expanded[0] == "~":
        expanded = join(namespace, node) + expanded[1:]
    if "{" in expanded:
        expanded = _substitute(what, expanded, {"node": node, "ns": namespace, "namespace": namespace})
    if expanded[0] != "/":
        expanded = join(namespace, expanded)
    if not is_full_name(expanded):
        try:
            validate_full_name(expanded, what)
        except InvalidNameError as error:
            raise InvalidNameError(what, name, f"becomes {quoted(expanded)}, which {error.reason}") from error
    return expanded


def join(namespace: str, name: str) -> str:
    """Join ``namespace`` (absolute) and a relative ``name``; the root adds no second slash."""
    return f"/{name}" if namespace == "/" else f"{namespace}/{name}"


def split_fqn(fqn: str) -> tuple[str, str]:
    """Split ``/a/b/node`` into (``/a/b``, ``node``); the namespace of ``/node`` is ``/``."""
    namespace, _, name = fqn.rpartition("/")
    return namespace or "/", name


def _substitute(what: str, name: str, values: dict[str, str]) -> str:
    def value(match: re.Match[str]) -> str:
        if match[1] not in values:
            raise InvalidNameError(what, name, f"unknown substitution {match[0]}", match.start())
        return values[match[1]]

    return _SUBSTITUTION.sub(value, name)


def _check_absolute(what: str, name: str, maximum: int) -> None:
    if len(name) <= maximum and _ABSOLUTE.match(name):
        return
    if not name:
        raise InvalidNameError(what, name, "must not be empty")
    if name[0] != "/":
        raise InvalidNameError(what, name, "must be absolute, it must start with '/'", 0)
    if name[-1] == "/":
        raise InvalidNameError(what, name, "must not end with '/'", len(name) - 1)
    _check_characters(what, name, allowed="/")
    _check_tokens(what, name)
    if "//" in name:
        raise InvalidNameError(what, name, "must not contain '//'", name.index("//"))
    raise InvalidNameError(what, name, f"is longer than {maximum} characters")


def _check_characters(what: str, name: str, allowed: str) -> None:
    for position, character in enumerate(name):
        if not (character.isascii() and (character.isalnum() or character == "_" or character in allowed)):
            raise InvalidNameError(what, name, f"must not contain {quoted(character)}", position)


def _check_tokens(what: str, name: str) -> None:
    match = re.search(r"/[0-9]", name)
    if match:
        raise InvalidNameError(what, name, "no part may start with a digit", match.start() + 1)


def _check_tilde(what: str, name: str) -> None:
    if "~" in name[1:]:
        raise InvalidNameError(what, name, "'~' may only be the first character", name.index("~", 1))
    if name[0] == "~" and len(name) > 2 and name[1] != "/":
        raise InvalidNameError(what, name, "'~' must be followed by '/'", 1)


def _check_braces(what: str, name: str) -> None:
    opened: int | None = None
    for position, character in enumerate(name):
        if character == "{":
            if opened is not None:
                raise InvalidNameError(what, name, "'{' inside a substitution", position)
            opened = position
        elif character == "}":
            if opened is None:
                raise InvalidNameError(what, name, "'}' without '{'", position)
            opened = None
        elif opened is not None and character in "/~":
            raise InvalidNameError(what, name, f"'{character}' inside a substitution", position)
        elif opened == position - 1 and character.isdigit():
            raise InvalidNameError(what, name, "a substitution must not start with a digit", position)
    if opened is not None:
        raise InvalidNameError(what, name, "'{' without '}'", opened)
