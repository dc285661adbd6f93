"""The ``$(name arg ...)`` language: text -> ``Template`` -> text. Knows no substitution class.

A template is a sequence of texts and calls. An argument is a template again, in one of three contexts:

    unquoted   a$(b)c          ends at a space or ``)``; quotes and parentheses only with a backslash
    '...'      'a (b) $(c d)'  everything but its own quote; the arguments of calls inside cannot be quoted
    "..."      likewise

Rules that surprise, all upstream's (``launch/frontend/grammar.lark``): exactly one space separates arguments;
a backslash before ``$``, a quote or a parenthesis takes its meaning away, even when that backslash is itself
escaped; ``$`` without ``(`` is text. Contexts matter only for where an argument ends, so the result does not
keep them, except to name the rule in error messages.

The scanner is linear in the text. Next: ``launch.frontend.parse_substitution`` turns calls into objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

MAX_NESTING = 128  # where upstream ends in a RecursionError, too

TemplatePart: TypeAlias = "str | SubstitutionCall"
Template: TypeAlias = tuple[TemplatePart, ...]


class SubstitutionCall:
    """A call in a template: ``$(name arg ...)``. ``rule``: upstream's grammar rule, which says in which quotes it
    stands; calls that differ in nothing else are equal."""

    __slots__ = ("args", "name", "rule")

    def __init__(self, name: str, args: tuple[Template, ...], rule: str = "substitution") -> None:
        self.name = name
        self.args = args
        self.rule = rule

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SubstitutionCall) and (self.name, self.args) == (other.name, other.args)

    def __hash__(self) -> int:
        return hash((self.name, self.args))

    def __repr__(self) -> str:
        return f"SubstitutionCall({self.name!r}, {self.args!r}, {self.rule!r})"


class TemplateSyntaxError(ValueError):
    """A text is not a template. ``template`` is that text."""

    def __init__(self, message: str, template: str):
        super().__init__(message)
        self.template = template


class UnexpectedCharacters(TemplateSyntaxError):
    """A character that cannot stand at ``position`` (index into the text)."""

    def __init__(self, template: str, position: int, expected: str):
        self.position = position
        self.line = template.count("\n", 0, position) + 1
        start = template.rfind("\n", 0, position) + 1
        self.column = position - start + 1
        before = template[max(start, position - 40) : position].expandtabs()
        after = template[position : position + 40].split("\n", 1)[0]
        super().__init__(
            f"No terminal matches '{template[position]}' in the current parser context, at line {self.line} "
            f"col {self.column}\n\n{before}{after}\n{' ' * len(before)}^\nExpected {expected}",
            template,
        )


class UnexpectedEOF(TemplateSyntaxError):
    """The text ends inside ``$(...)``."""

    def __init__(self, template: str, expected: str):
        super().__init__(f"Unexpected end-of-input. Expected {expected}, in '{template}'", template)


class VisitError(ValueError):
    """A well-formed ``$(...)`` that names no substitution, or whose arguments its class refuses (``orig_exc``)."""

    def __init__(self, rule: str, template: str, orig_exc: Exception):
        super().__init__(f'Error trying to process rule "{rule}":\n\n{orig_exc}')
        self.rule = rule
        self.template = template
        self.orig_exc = orig_exc


def unescape(text: str) -> str:
    """Replace backslash and any character but a newline by that character."""
    return _ESCAPED.sub(r"\1", text) if "\\" in text else text


def parse_template(text: str) -> Template:
    """Parse ``text``; raises ``UnexpectedCharacters`` or ``UnexpectedEOF``."""
    if "$(" not in text:
        return (unescape(text),)
    return _Scanner(text).template()


def called_names(template: Template) -> Iterator[str]:
    """Yield the names of all calls, those in arguments included."""
    for part in template:
        if isinstance(part, SubstitutionCall):
            yield part.name
            for argument in part.args:
                yield from called_names(argument)


class _Context(NamedTuple):
    rule: str
    text: re.Pattern[str]  # a whole run of text
    argument: re.Pattern[str]  # a run of text inside an unquoted argument of a call here
    may_quote: bool  # whether arguments of a call here may be quoted
    quote: str = ""


_ESCAPED = re.compile(r"\\(.)")
_NAME_TEXT = r"[A-Za-z][A-Za-z0-9_-]*"
_NAME = re.compile(_NAME_TEXT)
_PLAIN_CALL = re.compile(rf"""\$\(({_NAME_TEXT})((?: [^ '"\\$()]+)*)\)""")  # most calls; the same anywhere
_DOLLAR = r"\$(?!\()|(?<=\\)\$"  # a dollar that begins no call
_PARENTHESIS = r"(?<=\\)[()]"

_UNQUOTED_ARGUMENT = re.compile(rf"""(?:[^ '"\\$()]+|\\["']|{_PARENTHESIS}|{_DOLLAR}|\\)+""")
_TOP = _Context("substitution", re.compile(rf"(?:[^$]+|{_DOLLAR})+"), _UNQUOTED_ARGUMENT, may_quote=True)
_QUOTED = {
    quote: _Context(
        f"{name}_quoted_substitution",
        re.compile(rf"(?:[^{quote}\\$]+|\\{quote}|{_DOLLAR}|\\)+"),
        re.compile(rf"(?:[^ {quote}\\$()]+|\\{quote}|{_PARENTHESIS}|{_DOLLAR}|\\)+"),
        may_quote=False,
        quote=quote,
    )
    for quote, name in (("'", "single"), ('"', "double"))
}


class _Scanner:
    def __init__(self, text: str):
        self.text = text
        self.position = 0
        self.depth = 0

    def template(self) -> Template:
        parts = self.parts(_TOP, _TOP.text)
        assert self.position == len(self.text)  # at the top everything is text or a call
        return parts

    def parts(self, context: _Context, text_pattern: re.Pattern[str]) -> Template:
        """Return texts and calls, up to the first character that is neither."""
        parts: list[TemplatePart] = []
        while self.position < len(self.text):
            match = text_pattern.match(self.text, self.position)
            if match:
                parts.append(unescape(match.group()))
                self.position = match.end()
            elif self.text.startswith("$(", self.position):
                parts.append(self.call(context))
            else:
                break
        return tuple(parts)

    def call(self, context: _Context) -> SubstitutionCall:
        if self.depth == MAX_NESTING:
            raise TemplateSyntaxError(
                f"substitutions are nested more than {MAX_NESTING} deep in '{self.text[:80]}...'", self.text
            )
        plain = _PLAIN_CALL.match(self.text, self.position)
        if plain is not None:
            self.position = plain.end()
            return SubstitutionCall(plain[1], tuple((arg,) for arg in plain[2].split(" ")[1:]), context.rule)
        self.position += 2
        self.depth += 1
        name = _NAME.match(self.text, self.position)
        if name is None:
            raise self.unexpected("the name of a substitution")
        self.position = name.end()
        args: list[Template] = []
        while self.peek() == " ":
            self.position += 1
            args.append(self.argument(context))
        if self.peek() != ")":
            raise self.unexpected("one space and an argument, or ')'")
        self.position += 1
        self.depth -= 1
        return SubstitutionCall(name.group(), tuple(args), context.rule)

    def argument(self, context: _Context) -> Template:
        quoted = _QUOTED.get(self.peek()) if context.may_quote else None
        if quoted is not None:
            return self.quoted_argument(quoted)
        parts = self.parts(context, context.argument)
        if not parts:
            raise self.unexpected("an argument")
        return parts

    def quoted_argument(self, context: _Context) -> Template:
        self.position += 1
        parts = self.parts(context, context.text)
        if self.peek() != context.quote:
            raise self.unexpected(f"a closing {context.quote}")
        self.position += 1
        return parts

    def peek(self) -> str:
        return self.text[self.position : self.position + 1]

    def unexpected(self, expected: str) -> TemplateSyntaxError:
        if self.position == len(self.text):
            return UnexpectedEOF(self.text, expected)
        return UnexpectedCharacters(self.text, self.position, expected)
