"""Evaluate a template or a condition of a document in one situation: parameters, options, ``$(...)``.

    $(param NAME [DEFAULT])      the parameter's value; DEFAULT, else the document's, when launch sets none
    $(option NAME [DEFAULT])     the value of a command-line option that the document declares
    $(argument N [DEFAULT])      the N-th word of the command line that is neither option nor value of one, from 1
    $(item) $(plugin)            the entry of ``each``, the instance of a plugin list
    $(node) $(namespace)         the node's final name and namespace
    $(remapped NAME)             the final name of a topic, where the program asks for it itself
    $(camera_info NAME)          the camera_info beside the final name of an image
    $(parent)                    the namespace less its last part: that of the node which made a costmap

Inner references are replaced first: ``$(param $(plugin).topic)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from nodl.builtin_interfaces import DISTROS
from nodl.dependence import Situation, Test, When
from nodl.name_template import NameTemplate, Part, UnknownPart
from nodl.ros_arguments import split_options

_REFERENCE = re.compile(r"\$\(([a-z_]+)(?: ([^()]*))?\)")
_ARGUMENTS = "arguments "
_ARGUMENT = "argument "
_HELD = re.compile("\x00([0-9]+)\x00")


class Filled(NamedTuple):
    """A template filled in: ``parts`` of a name; ``notes``: where its pieces came from, for a reader."""

    parts: tuple[Part, ...]
    notes: tuple[str, ...] = ()

    @property
    def template(self) -> NameTemplate:
        return NameTemplate(self.parts)

    @property
    def text(self) -> str | None:
        """Return the whole text, None if a piece is not known."""
        return "".join(str(part) for part in self.parts) if self.template.is_literal else None


class Value(NamedTuple):
    """A parameter's or option's value; ``origin`` says who set it."""

    value: object
    origin: str


class Scope:
    """One situation seen with the defaults of one document; ``plugin`` when it describes a plugin's instance."""

    def __init__(
        self,
        situation: Situation,
        defaults: Mapping[str, object],
        options: Mapping[str, tuple[str, ...]],
        plugin: str = "",
    ):
        self.situation = situation
        self._bound = {
            "plugin": plugin,
            "node": situation.node,
            "namespace": situation.namespace,
            "parent": situation.namespace.rpartition("/")[0],
        }
        self._defaults = {self._plain(name): value for name, value in defaults.items()}
        self._options, self._arguments = _command_line(situation.words, options)

    def fill(self, template: str, item: str = "") -> Filled:
        """Return ``template`` with its references replaced; a value that is not known becomes an unknown part."""
        return _Filling(self, {**self._bound, "item": item}).of(template)

    def holds(self, when: When, item: str = "") -> bool:
        """Return True if the condition holds; a distribution that we do not know counts as the newest."""
        known = self.situation.distro in DISTROS
        age = DISTROS.index(self.situation.distro) if known else len(DISTROS)
        if when.since and age < DISTROS.index(when.since):
            return False
        if when.until and age > DISTROS.index(when.until):
            return False
        return not when.any_of or any(all(self._passes(t, item) for t in group) for group in when.any_of)

    def items(self, each: str) -> Iterator[str]:
        """Yield the entries of a list parameter, or the words of a text.

        ``*`` (or ``#``, a number) yields what it stands for in parameter names, ``arguments N`` the words of the
        command line from the N-th on.
        """
        each = self._plain(each)
        if each.startswith(_ARGUMENTS):
            yield from self._arguments[int(each.removeprefix(_ARGUMENTS)) - 1 :]
            return
        if "*" in each or "#" in each:
            pattern = re.compile(re.escape(each).replace(r"\*", "([^.]+)").replace(r"\#", "([0-9]+)"))
            found = (pattern.fullmatch(name) for name in self.situation.parameters)
            yield from dict.fromkeys(match[1] for match in found if match)
            return
        value = self.value(each)
        if value is not None:
            yield from _entries(value.value)

    def value(self, name: str, default: object = None) -> Value | None:
        """Return the value of a parameter, of an option (``--name``), or of a word of the command line (``argument
        N``).
        """
        if name.startswith("--"):
            return self.option(name[2:], default)
        if name.startswith(_ARGUMENT):
            return self.argument(name.removeprefix(_ARGUMENT), default)
        if name in self.situation.parameters:
            return Value(self.situation.parameters[name], f"parameter {name}, set by launch")
        return _default(f"parameter {name}", self._defaults.get(name) if default is None else default)

    def option(self, name: str, default: object = None) -> Value | None:
        if name in self._options:
            return Value(self._options[name], f"option {name}, set by launch")
        return _default(f"option {name}", default)

    def argument(self, number: str, default: object = None) -> Value | None:
        index, what = int(number) - 1, f"argument {number} of the command line"
        return (
            Value(self._arguments[index], what) if index < len(self._arguments) else _default(what, default)
        )

    def _plain(self, text: str) -> str:
        return text.replace("$(plugin)", self._bound["plugin"]).replace("$(node)", self._bound["node"])

    def _passes(self, test: Test, item: str) -> bool:
        name = self._plain(test.parameter).replace("$(item)", item)
        words = Value(self.situation.words, "the command line")
        found = words if name == "words" else self.value(name)
        return self._meets(test, None if found is None else found.value) is not test.negated

    @staticmethod
    def _meets(test: Test, value: object) -> bool:
        entries = [_text(entry) for entry in _entries(value)] if test.contains else [_text(value)]
        if test.is_set:
            return value is not None and _text(value) not in ("", "()")
        return any(entry == allowed for entry in entries for allowed in test.values)


def _default(what: str, default: object) -> Value | None:
    return None if default is None else Value(default, f"{what}, its default")


class _Filling:
    """One template. Values are kept apart while references are replaced, so that no value is read as a reference."""

    def __init__(self, scope: Scope, bound: Mapping[str, str]):
        self._scope = scope
        self._bound = bound
        self._held: list[str | None] = []
        self._why: list[str] = []
        self._notes: list[str] = []

    def of(self, template: str) -> Filled:
        while match := _REFERENCE.search(template):
            template = template[: match.start()] + self._replaced(match) + template[match.end() :]
        return Filled(tuple(self._parts(template)), tuple(dict.fromkeys(self._notes)))

    def _replaced(self, match: re.Match[str]) -> str:
        word, rest = match[1], match[2] or ""
        if word in self._bound:
            return self._hold(self._bound[word])
        name, blank, default = rest.partition(" ")
        name = self._released(name)
        given = self._released(default).strip("'") if blank else None
        if word in ("remapped", "camera_info"):
            return self._hold(self._remapped(word, name))
        scope = self._scope
        value_of = {"param": scope.value, "option": scope.option, "argument": scope.argument}[word]
        found = value_of(name, given)
        if found is None or isinstance(found.value, (tuple, list)):
            self._why.append(f"{'parameter' if word == 'param' else word} {name!r} has no value")
            return self._hold(None)
        self._notes.append(found.origin)
        return self._hold(_text(found.value, lower=False))

    def _remapped(self, word: str, name: str) -> str:
        """Return the remapped name, or what stands beside it, as ``image_transport::getCameraInfoTopic`` does."""
        final = self._scope.situation.remap(name)
        return final if word == "remapped" else f"{final.rpartition('/')[0]}/camera_info"

    def _hold(self, text: str | None) -> str:
        self._held.append(text)
        return f"\x00{len(self._held) - 1}\x00"

    def _released(self, text: str) -> str:
        return _HELD.sub(lambda match: self._held[int(match[1])] or "", text)

    def _parts(self, template: str) -> Iterator[Part]:
        unknown = iter(self._why)
        literal = ""
        for index, piece in enumerate(_HELD.split(template)):
            known = piece if index % 2 == 0 else self._held[int(piece)]
            if known is not None:
                literal += known
                continue
            if literal:
                yield literal
            literal = ""
            yield UnknownPart(next(unknown, ""))
        if literal:
            yield literal


def _entries(value: object) -> list[str]:
    """Return the entries of a list, or the words of a text such as ``a b`` or ``A|B``."""
    if isinstance(value, (list, tuple)):
        return [text for text in map(str, value) if text]
    return str(value).replace("|", " ").split() if value is not None else []


def _text(value: object, *, lower: bool = True) -> str:
    """Return booleans as ROS writes them; compared without regard to case."""
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return text.lower() if lower else text


def _command_line(
    words: Sequence[str], options: Mapping[str, tuple[str, ...]]
) -> tuple[dict[str, str], list[str]]:
    """Return the declared options (the first value of each), and the words that belong to none."""
    by_spelling = {spelling: name for name, spellings in options.items() for spelling in spellings}
    given, others = split_options(words, by_spelling)
    values = {by_spelling[spelling]: value for spelling, value in reversed(given)}
    return values, [word for word in others if not word.startswith("-") or _is_number(word)]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
