"""Remap rules as rcl reads and applies them: ``[NODE:]MATCH:=REPLACEMENT``.

Performs no I/O. Launch passes rules on unchecked, so a bad rule is only
noticed by the started process; ``parse_rule`` notices it before.

Rules from ros2/rcl ``arguments.c`` and ``lexer.c`` (what parses), ``remap.c`` and
``node_resolve_name.c`` (order and matching), and for action names rcl pull request 1170.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from enum import Enum
from typing import NamedTuple

from enclave_common.terminal import quoted
from nodl.names import InvalidNameError, expand_name, join, validate_full_name

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"  # that it holds no "__" is checked apart
_NAME = re.compile(rf"(?:~/|/)?{_TOKEN}(?:/{_TOKEN})*\Z")
_PREFIX = re.compile(rf"({_TOKEN}):(?!//)")
_NODE_NAME = re.compile(rf"{_TOKEN}\Z")
_NAMESPACE = re.compile(rf"/\Z|(?:/{_TOKEN})+/?\Z")

ACTION_SERVICES = ("send_goal", "cancel_goal", "get_result")
ACTION_TOPICS = ("feedback", "status")
_LONGEST_PART = "cancel_goal"


class RemapKind(str, Enum):
    """The target of a rule; the value of a name rule is its written prefix."""

    __str__ = str.__str__

    ANY_NAME = ""
    TOPIC = "rostopic://"
    SERVICE = "rosservice://"
    NODE_NAME = "__node"
    NAMESPACE = "__ns"


_OF_THE_NODE = (RemapKind.NODE_NAME, RemapKind.NAMESPACE)


class InvalidRemapRuleError(ValueError):
    """A rule at which rcl's initialisation fails. ``rule`` is its text, ``origin`` where it was written."""

    def __init__(self, rule: str, reason: str, origin: str = ""):
        self.rule = rule
        self.reason = reason
        self.origin = origin
        where = f"{origin}: " if origin else ""
        super().__init__(f"{where}invalid remap rule {quoted(rule)}: {reason}")


class ParsedRule(NamedTuple):
    """A remap rule. ``node`` restricts it to nodes of that name; ``match`` is empty for ``__node`` and ``__ns``."""

    kind: RemapKind
    match: str
    replacement: str
    node: str | None = None
    text: str = ""
    origin: str = ""  # "file:line" or what else shows a reader where the rule was written

    def __str__(self) -> str:
        return f"{self.text} ({self.origin})" if self.origin else self.text


class Resolved(NamedTuple):
    """A fully qualified name and the rules that led to it, in the order applied (mostly none or one)."""

    name: str
    rules: tuple[ParsedRule, ...] = ()


class RemapRules(NamedTuple):
    """The rules one node obeys: its own (``local``, of a component's load request) before the process's.

    Within each list the first match wins and nothing is applied to the result.
    """

    local: tuple[ParsedRule, ...] = ()
    process: tuple[ParsedRule, ...] = ()

    @property
    def names(self) -> tuple[ParsedRule, ...]:
        """Return the rules for names of topics and services, in their order."""
        return tuple([rule for rule in (*self.local, *self.process) if rule.kind not in _OF_THE_NODE])

    def node_name(self, original: str) -> Resolved:
        """Return the name the node gets; ``NODE:`` compares with the original name."""
        return self._first(RemapKind.NODE_NAME, original, original)

    def namespace(self, original: str, node: str) -> Resolved:
        """Return the namespace the node gets; ``NODE:`` compares with ``node``, its name after remapping."""
        return self._first(RemapKind.NAMESPACE, node, original)

    def _first(self, kind: RemapKind, node: str, original: str) -> Resolved:
        for rule in (*self.local, *self.process):
            if rule.kind is kind and rule.node in (None, node):
                return Resolved(rule.replacement, (rule,))
        return Resolved(original)


class NodeNames:
    """Resolves names for one node; raises ``InvalidNameError`` from its methods for names that rcl would refuse."""

    def __init__(self, node: str, namespace: str, rules: RemapRules | None = None):
        self.node = node
        self.namespace = namespace
        self._topics: dict[str, ParsedRule] = {}
        self._services: dict[str, ParsedRule] = {}
        self._parts_are_named = False
        for rule in rules.names if rules else ():
            self._add(rule)

    @property
    def has_rules(self) -> bool:
        return bool(self._topics or self._services)

    @property
    def fqn(self) -> str:
        return join(self.namespace, self.node)

    def expand(self, name: str, what: str = "name") -> str:
        """Return the fully qualified name before remapping."""
        return expand_name(name, namespace=self.namespace, node=self.node, what=what)

    def rule_matching(self, full_name: str) -> ParsedRule | None:
        """Return the name rule, of whichever kind, that matches ``full_name``."""
        return self._topics.get(full_name) or self._services.get(full_name)

    def topic(self, name: str) -> Resolved:
        expanded = expand_name(name, namespace=self.namespace, node=self.node, what="topic name")
        return self._resolve(expanded, self._topics) if self._topics else Resolved(expanded)

    def service(self, name: str) -> Resolved:
        expanded = expand_name(name, namespace=self.namespace, node=self.node, what="service name")
        return self._resolve(expanded, self._services) if self._services else Resolved(expanded)

    def action(self, name: str, *, as_a_whole: bool) -> Resolved:
        """Return the action name; ``as_a_whole`` is true for the distributions that remap it (kilted and later).

        rcl then finds it among the topic rules. The five names below it are remapped once more, each by itself:
        ``action_parts``.
        """
        expanded = self.expand(name, "action name")
        return self._resolve(expanded, self._topics) if as_a_whole else Resolved(expanded)

    def action_parts(self, action: str) -> ActionParts | None:
        """Return what the parts of the expanded ``action`` get one by one; ``None`` if no rule names any."""
        validate_full_name(f"{action}/_action/{_LONGEST_PART}", "action name")
        names = [f"{action}/_action/{part}" for part in (*ACTION_SERVICES, *ACTION_TOPICS)]
        if not self._parts_are_named or not any(self.rule_matching(name) for name in names):
            return None
        services = {part: self.service(name) for part, name in zip(ACTION_SERVICES, names[:3], strict=True)}
        topics = {part: self.topic(name) for part, name in zip(ACTION_TOPICS, names[3:], strict=True)}
        return ActionParts(services, topics)

    def _add(self, rule: ParsedRule) -> None:
        if rule.node not in (None, self.node):
            return
        try:
            match = self.expand(rule.match)
        except InvalidNameError:
            return  # rcl skips a rule whose match cannot be expanded
        self._parts_are_named = self._parts_are_named or "/_action/" in match
        if rule.kind is not RemapKind.SERVICE:
            self._topics.setdefault(match, rule)
        if rule.kind is not RemapKind.TOPIC:
            self._services.setdefault(match, rule)

    def _resolve(self, expanded: str, rules: dict[str, ParsedRule]) -> Resolved:
        rule = rules.get(expanded)
        if rule is None:
            return Resolved(expanded)
        return Resolved(self.expand(rule.replacement), (rule,))


class ActionParts(NamedTuple):
    """Final names by part (``send_goal``, ``feedback`` ...)."""

    services: dict[str, Resolved]
    topics: dict[str, Resolved]

    @property
    def rules(self) -> tuple[ParsedRule, ...]:
        """Return the rules of all parts, services first."""
        return tuple(rule for part in (*self.services.values(), *self.topics.values()) for rule in part.rules)

    @property
    def moved_together(self) -> str | None:
        """Return the action that all five parts belong to after remapping; None if they no longer belong together."""
        found = {**self.services, **self.topics}
        action = self.services["send_goal"].name.removesuffix("/_action/send_goal")
        together = all(resolved.name == f"{action}/_action/{part}" for part, resolved in found.items())
        return action if together else None


def parse_rule(text: str, origin: str = "") -> ParsedRule:
    """Parse one rule as it follows ``-r``; raises ``InvalidRemapRuleError`` for what rcl's lexer refuses."""
    match, separator, replacement = text.partition(":=")
    if not separator:
        raise InvalidRemapRuleError(text, "must have the form FROM:=TO", origin)
    node: str | None = None
    prefix = _PREFIX.match(match)
    if prefix and "__" not in prefix[1]:
        node, match = prefix[1], match[prefix.end() :]
    try:
        return _rule_of_kind(match, replacement, node, text, origin)
    except ValueError as error:
        raise InvalidRemapRuleError(text, str(error), origin) from None


def valid_rules(texts: Iterable[str]) -> tuple[ParsedRule, ...]:
    """Return those of ``texts`` that rcl would take: another one cannot have acted."""
    rules = []
    for text in texts:
        with suppress(InvalidRemapRuleError):
            rules.append(parse_rule(text))
    return tuple(rules)


def _rule_of_kind(match: str, replacement: str, node: str | None, text: str, origin: str) -> ParsedRule:
    if match in ("__node", "__name"):
        _check(_NODE_NAME, replacement, "the node name")
        return ParsedRule(RemapKind.NODE_NAME, "", replacement, node, text, origin)
    if match == "__ns":
        _check(_NAMESPACE, replacement, "the namespace (it must be absolute)")
        return ParsedRule(RemapKind.NAMESPACE, "", replacement, node, text, origin)
    kind = RemapKind.ANY_NAME
    for candidate in (RemapKind.TOPIC, RemapKind.SERVICE):
        if match.startswith(candidate.value):
            kind, match = candidate, match[len(candidate.value) :]
    _check(_NAME, match, "the name to match")
    _check(_NAME, replacement, "the replacement")
    return ParsedRule(kind, match, replacement, node, text, origin)


def _check(pattern: re.Pattern[str], value: str, what: str) -> None:
    if not value:
        raise ValueError(f"{what} is empty")
    if "__" in value:
        raise ValueError(f"{what} {quoted(value)} contains '__', which rcl does not allow in rules")
    if "*" in value or "\\" in value:
        raise ValueError(f"{what} {quoted(value)} uses a pattern, which rcl has not implemented")
    if not pattern.match(value):
        raise ValueError(f"{what} {quoted(value)} is not a valid name")
