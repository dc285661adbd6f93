"""The names of one program: which class, function, constant or type a text means where it stands. Pure."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, update_wrapper
from itertools import chain
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Function, Global, Scope
from enclave_addons.inference.cpp.reading.type_names import POINTER_MEMBERS, Type, split_type

_WRAPPERS = frozenset({
    "std::shared_ptr", "std::unique_ptr", "std::weak_ptr", "std::optional", "boost::shared_ptr",
    "std::reference_wrapper", "std::atomic", "tl::optional", "boost::optional",
})  # fmt: skip


STANDARD_TYPES = frozenset({
    "string", "stringstream", "ostringstream", "istringstream", "vector", "array", "list", "deque", "set", "map",
    "unordered_set", "unordered_map", "multiset", "multimap", "queue", "stack", "pair", "tuple", "optional", "variant",
    "function", "shared_ptr", "unique_ptr", "weak_ptr", "thread", "mutex", "recursive_mutex", "lock_guard",
    "unique_lock", "scoped_lock", "atomic", "ifstream", "ofstream", "fstream", "string_view", "initializer_list",
    "condition_variable", "reference_wrapper", "any", "exception", "runtime_error", "bitset", "complex", "future",
    "promise", "regex", "random_device", "mt19937", "priority_queue", "forward_list", "jthread",
})  # fmt: skip

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")


def _once(
    method: Callable[Concatenate[Names, Asked], Answer],
) -> Callable[Concatenate[Names, Asked], Answer]:
    """Names do not change while a program runs: each question has one answer, which nobody may change."""
    name = method.__name__

    def ask(self: Names, /, *args: Asked.args, **kwargs: Asked.kwargs) -> Answer:
        key = (name, *args, *kwargs.items())
        try:
            known: Answer = self._answers[key]
        except KeyError:
            known = self._answers[key] = method(self, *args, **kwargs)
        return known

    return update_wrapper(ask, method)


_STATIC = re.compile(r"\bstatic\b(?!\s+const)")
_PLAIN = re.compile(
    r"(?:const\s+)?(?:std::)?(?:(?:string|char|u?int\d*(?:_t)?|bool|size_t|double|float)|"
    r"(?:vector|(?:unordered_)?(?:map|set)|list|array|deque|optional)<.*>)"
)


_ENDS = re.compile(r"(?<![\w.>])(std\s*::\s*|::\s*)?(_?exit|quick_exit|_Exit|abort|terminate)\s*\(")
"""Calls that end the program; not methods of an object: ``goal->abort()``."""
_FRESH = r"(?:new\b(?!\s*\()|nullptr\b|NULL\b)"
_POINTS_AT_NEW = rf"\s*(?:->|\[|[!=]=|=\s*{_FRESH}|[({{]\s*{_FRESH}|\)\s*\{{)"
"""Matches behind a pointer: a member access, a comparison, or an assignment of what ``new`` makes."""
_OF_ONE_STAR = re.compile(r"^[^*&]*\*[^*&]*$")


class Alias(NamedTuple):
    """A name that stands for another one, ``target``, as written in ``scope``."""

    qualified: str
    target: str
    scope: Scope
    file: FileIndex


Named = TypeVar("Named", Class, Function, Global, Alias)


class Names:
    """``files``: the sources and headers of the program. ``visible``: file -> every file that it includes."""

    def __init__(self, files: Iterable[FileIndex]):
        self.files = {index.file: index for index in files}
        self._answers: dict[tuple[object, ...], Any] = {}
        self._types: dict[tuple[str, Scope, str], Type] = {}
        self.classes: dict[str, list[Class]] = {}
        self.functions: dict[str, list[Function]] = {}
        self.declared: dict[str, list[Function]] = {}
        self.globals: dict[str, list[Global]] = {}
        self.aliases: dict[str, list[Alias]] = {}
        self.enumerators: dict[str, str] = {}
        self.enums: set[str] = set()
        self._bases: dict[str, tuple[str, ...]] = {}
        self.hidden: dict[Class, frozenset[str]] = {}  # what ``inheritance.hidden`` found
        self.depends: frozenset[str] = frozenset()  # what the packages of the program depend on
        self.plugins: dict[str, str] = {}  # lookup name or class -> class that pluginlib makes
        for index in self.files.values():
            self._add(index)
        self.doubts: dict[str, Class] = {}  # used templates with specialisations, which are not followed
        self._specialised = {
            each.qualified
            for found in self.classes.values()
            for each in found
            if each.specialises is not None and (each.fields or each.declared or each.methods)
        }
        self._attach()

    def _add(self, index: FileIndex) -> None:
        _extend(self.classes, index.classes)
        _extend(self.functions, index.functions)
        _extend(self.declared, index.declared)
        _extend(self.globals, index.globals)
        for qualified, (target, scope) in index.aliases.items():
            last = qualified.rpartition("::")[2]
            self.aliases.setdefault(last, []).append(Alias(qualified, target, scope, index))
        self.enumerators.update(index.enumerators)
        self.enums |= index.enums

    def _attach(self) -> None:
        """Attach methods defined outside of their class."""
        self.methods: dict[Class, dict[str, list[Function]]] = {}
        for each in (c for found in self.classes.values() for c in found):
            self.methods[each] = {name: [*found] for name, found in each.methods.items()}
        for function in (each for found in self.functions.values() for each in found):
            cls, name = self._class_of_method(function), function.name
            if cls is not None:
                self.methods[cls].setdefault(name, []).append(function)
                _complete(function, cls.declared.get(name, ()))
            elif not function.owner:
                _complete(function, self.declared.get(name, ()))

    def _class_of_method(self, function: Function) -> Class | None:
        """Return the class that a function outside of it names as its owner."""
        if not function.owner:
            return None
        outer = function.scope[: len(function.scope) - len(function.owner.split("::"))]
        return self.find_class(function.owner, outer, function.file)

    @_once
    def visible(self, file: str) -> frozenset[str]:
        found = {file}
        waiting = [file]
        while waiting:
            index = self.files.get(waiting.pop())
            for name in index.source.includes if index else ():
                if name not in found:
                    found.add(name)
                    waiting.append(name)
        return frozenset(found)

    @_once
    def used_namespaces(self, file: str) -> tuple[str, ...]:
        """Return those that ``using namespace`` brings into a file, its headers included."""
        seen = (self.files[each] for each in sorted(self.visible(file)) if each in self.files)
        return tuple(dict.fromkeys(used for index in seen for used in index.using))

    @cached_property
    def functions_by_name(self) -> dict[str, list[Function]]:
        found: dict[str, list[Function]] = {}
        for index in self.files.values():
            for function in index.all_functions:
                found.setdefault(function.name, []).append(function)
        return found

    @_once
    def spoken_of(self, function: Function) -> frozenset[str]:
        """Return the functions, classes and aliases of the program whose names a function mentions."""
        return function.words & self._declared_words

    @cached_property
    def _declared_words(self) -> frozenset[str]:
        return frozenset(
            self.functions_by_name.keys() | self.classes.keys() | self.aliases.keys() | self.named_as_messages
        )

    @cached_property
    def named_as_messages(self) -> frozenset[str]:
        """Return the program's own classes in namespaces as those of messages: ``msg::String``."""
        every = (each.qualified.split("::")[-2:] for each in chain.from_iterable(self.classes.values()))
        return frozenset("::".join(each) for each in every if each[0] in ("msg", "srv", "action"))

    # --- classes and functions --------------------------------------------------------------------------

    @_once
    def find_class(self, name: str, scope: Scope, file: FileIndex) -> Class | None:
        last = name.rpartition("::")[2]
        listed = self.classes.get(last)
        if not listed:
            return None
        matches = self._named(listed, name, scope, file)
        if matches:
            return self._nearest([each for each in matches if each.specialises is None] or matches, file)
        ending = [each for each in listed if "::" in name and each.qualified.endswith("::" + name)]
        return ending[0] if len(ending) == 1 else None

    def _named(self, listed: Iterable[Named], name: str, scope: Scope, file: FileIndex) -> list[Named]:
        """Return those of ``listed`` that a name means: the ones in the nearest scope."""
        listed = list(listed)
        for qualified in self._candidates(name, scope, file) if listed else ():
            if matches := [each for each in listed if each.qualified == qualified]:
                return matches
        return []

    def _candidates(self, name: str, scope: Scope, file: FileIndex) -> Iterable[str]:
        name = name.lstrip(":")
        for length in range(len(scope), -1, -1):
            yield "::".join((*scope[:length], name))
            for base in self._base_names("::".join(scope[:length])) if length else ():
                yield f"{base}::{name}"
        for used in self.used_namespaces(file.file):
            yield f"{used}::{name}"
            for length in range(len(scope), 0, -1):
                yield "::".join((*scope[:length], used, name))

    def _base_names(self, qualified: str) -> tuple[str, ...]:
        """Return the bases of a class by that name: what they declare is visible in it."""
        if qualified not in self._bases:
            self._bases[qualified] = ()  # while the bases themselves are looked up
            found = [
                c for c in self.classes.get(qualified.rpartition("::")[2], ()) if c.qualified == qualified
            ]
            self._bases[qualified] = tuple(b.qualified for c in found for b in self.ancestry(c)[1:])
        return self._bases[qualified]

    def _nearest(self, matches: Sequence[Named], file: FileIndex) -> Named:
        """Return the last one in the file itself, else the first in its headers, else the first anywhere."""
        own = [each for each in matches if each.file.file == file.file]
        seen = [each for each in matches if each.file.file in self.visible(file.file)]
        return own[-1] if own else (seen or matches)[0]

    @_once
    def find_functions(self, name: str, scope: Scope, file: FileIndex) -> list[Function]:
        """Free functions, the nearest namespace first; those of the same file before others."""
        listed = [
            each
            for each in self.functions.get(name.rpartition("::")[2], ())
            if self._class_of_method(each) is None
        ]
        matches = self._named(listed, self._alias_prefix(name, scope, file), scope, file) if listed else []
        return [each for each in matches if each.file.file == file.file] or matches

    def _alias_prefix(self, name: str, scope: Scope, file: FileIndex) -> str:
        first, separator, rest = name.partition("::")
        if not separator:
            return name
        alias = self.alias(first, scope, file)
        return f"{alias.target}::{rest}" if alias else name

    @_once
    def find_global(self, name: str, scope: Scope, file: FileIndex) -> Global | None:
        listed = self.globals.get(name.rpartition("::")[2])
        if not listed:
            return None
        matches = self._named(listed, self._alias_prefix(name, scope, file), scope, file)
        with_value = [each for each in matches if each.value is not None] or matches
        return self._nearest(with_value, file) if with_value else None

    @_once
    def bases(self, cls: Class) -> list[tuple[str, Class | None]]:
        """Return the bases as written, with the class if its source is in reach."""
        found = []
        for written in cls.bases:
            kind = self.resolve(written, cls.scope, cls.file)
            found.append((written, self.class_of(kind, cls.scope, cls.file)))
        return found

    def class_of(self, kind: Type, scope: Scope, file: FileIndex) -> Class | None:
        """Return the class of a type; of a template that has specialisations this is noted as a doubt."""
        cls = self.find_class(kind.name, scope, file)
        if cls is not None and cls.qualified in self._specialised:
            self.doubts.setdefault(cls.qualified, cls)
        return cls

    def bindings(self, cls: Class, kind: Type) -> dict[str, Type]:
        """Return what the parameters of the template ``cls`` stand for."""
        bound = dict(zip(cls.templates, kind.arguments, strict=False))
        for name, default in cls.template_defaults.items():
            bound.setdefault(name, self.resolve(default, cls.scope, cls.file, bound))
        return bound

    @_once
    def ancestry(self, cls: Class | None) -> list[Class]:
        """Return the class and its bases, nearest first; nothing for no class."""
        order: list[Class] = []
        waiting = [cls] if cls is not None else []
        while waiting:
            each = waiting.pop()
            if each not in order:
                order.append(each)
                waiting += [base for _, base in reversed(self.bases(each)) if base is not None]
        return order

    @_once
    def find_methods(self, cls: Class | None, name: str) -> list[Function]:
        for each in self.ancestry(cls):
            found = self.methods.get(each, {}).get(name, [])
            if name in each.uses:
                found = [*found, *self._brought_in(each, name, found)]
            if found:
                return found
        return []

    def overrides(self, own: Function, base: Function) -> bool | None:
        """Return whether a method of a derived class overrides a virtual one of the same name; ``None``: perhaps."""
        if len(own.parameters) != len(base.parameters) or own.constant != base.constant:
            return False
        alike = [
            self._alike(own, a.type, base, b.type)
            for a, b in zip(own.parameters, base.parameters, strict=True)
        ]
        if all(alike) or own.overrides:
            return True
        return False if False in alike else None

    def _alike(self, own: Function, mine: str, base: Function, other: str) -> bool | None:
        """Return whether two methods write the same type; ``None`` if that is not known."""
        if mine.split() == other.split():
            return True
        kinds = [self.resolve(mine, own.scope, own.file), self.resolve(other, base.scope, base.file)]
        marks = [
            (re.findall(r"[&*]", each), "const" in each and each.endswith(("&", "*")))
            for each in (mine, other)
        ]
        if kinds[0] == kinds[1]:
            return marks[0] == marks[1]
        classes = (
            *self.classes.get(own.owner.rpartition("::")[2], ()),
            *self.classes.get(base.owner.rpartition("::")[2], ()),
        )
        if any({*each.templates} & {*re.findall(r"\w+", f"{mine} {other}")} for each in classes):
            return True  # as the template's arguments say
        return False if all(_BUILT_IN.fullmatch(each.name) for each in kinds) else None

    def _brought_in(self, cls: Class, name: str, own: Iterable[Function]) -> Iterator[Function]:
        """Yield the methods of ``using Base::name``, without those that the class declares itself."""
        taken = {tuple(p.type for p in each.parameters) for each in own}
        for written in cls.uses[name]:
            base = self.class_of(self.resolve(written, cls.scope, cls.file), cls.scope, cls.file)
            for each in self.find_methods(base, name) if base is not cls else ():
                if tuple(p.type for p in each.parameters) not in taken:
                    yield each

    @_once
    def declarations(self, cls: Class | None, name: str) -> list[Function]:
        return [d for each in self.ancestry(cls) for d in each.declared.get(name, ())]

    # --- types ------------------------------------------------------------------------------------------

    @_once
    def alias(self, name: str, scope: Scope, file: FileIndex) -> Alias | None:
        matches = self._named(self.aliases.get(name.rpartition("::")[2], ()), name, scope, file)
        return self._nearest(matches, file) if matches else None

    def resolve(
        self,
        written: str,
        scope: Scope,
        file: FileIndex,
        bindings: Mapping[str, Type] | None = None,
        depth: int = 0,
    ) -> Type:
        """Return the type that ``written`` means, aliases followed and template parameters filled in."""
        key = (file.file, scope, written)
        if not bindings and key in self._types:
            return self._types[key]
        found = self._resolve(written, scope, file, bindings or {}, depth)
        if not bindings:
            self._types[key] = found
        return found

    def _resolve(
        self, written: str, scope: Scope, file: FileIndex, bindings: Mapping[str, Type], depth: int
    ) -> Type:
        name, given, rest, pointer = split_type(written)
        if depth > 12:
            return Type(name, (), pointer)
        if name in STANDARD_TYPES and name not in bindings and self.is_standard(name, scope, file):
            name = f"std::{name}"
        if rest.startswith("::"):
            outer = self._resolve(f"{name}<{', '.join(given)}>", scope, file, bindings, depth + 1)
            return self._member(outer, rest[2:], pointer, scope, file)
        if name in bindings:
            bound = bindings[name]
            filled = tuple(self.resolve(each, scope, file, bindings, depth + 1) for each in given)
            return bound._replace(pointer=pointer or bound.pointer, arguments=filled or bound.arguments)
        first, separator, tail = name.partition("::")
        if separator and first in bindings:
            return self._member(bindings[first], tail, pointer, scope, file)
        arguments = tuple(self.resolve(each, scope, file, bindings, depth + 1) for each in given)
        if name in _WRAPPERS and arguments:
            return arguments[0]._replace(pointer=True)
        alias = self.alias(name, scope, file)
        if alias is not None and alias.target != written:
            inner = self.resolve(alias.target, alias.scope, alias.file, None, depth + 1)
            if bindings and not given:
                inner = self._resolve(alias.target, alias.scope, alias.file, bindings, depth + 1)
            return inner._replace(pointer=pointer or inner.pointer, arguments=arguments or inner.arguments)
        return self._qualified(name, arguments, pointer, scope, file, bindings, depth)

    @_once
    def is_standard(self, name: str, scope: Scope, file: FileIndex) -> bool:
        """Return whether a name without a namespace is one of ``std``, which ``using namespace std`` brings in."""
        own = self.find_class(name, scope, file) is not None or self.alias(name, scope, file) is not None
        return "std" in self.used_namespaces(file.file) and not own

    def _qualified(
        self, name: str, arguments: tuple[Type, ...], pointer: bool, scope: Scope, file: FileIndex,
        bindings: Mapping[str, Type], depth: int,
    ) -> Type:  # fmt: skip
        cls = self.find_class(name, scope, file)
        if cls is not None:
            return Type(cls.qualified, arguments, pointer)
        head, separator, last = name.rpartition("::")
        if separator and last in POINTER_MEMBERS:
            return self.resolve(head, scope, file, bindings, depth + 1)._replace(pointer=True)
        if separator:
            prefix = self.resolve(head, scope, file, bindings, depth + 1).name
            if prefix != head and depth < 6:
                inner = self.resolve(f"{prefix}::{last}", scope, file, None, depth + 1)
                return inner._replace(arguments=arguments, pointer=pointer)
            if prefix != head:
                return Type(f"{prefix}::{last}", arguments, pointer)
        return Type(name, arguments, pointer)

    def _member(self, outer: Type, rest: str, pointer: bool, scope: Scope, file: FileIndex) -> Type:
        """Resolve a type named inside of another: ``Foo<T>::SharedPtr``, ``ActionT::Goal``."""
        if rest in POINTER_MEMBERS:
            return outer._replace(pointer=True)
        cls = self.find_class(outer.name, scope, file)
        if cls is not None:
            cls = self.class_of(outer, scope, file) or cls
            bound = self.bindings(cls, outer)
            return self.resolve(rest, cls.scope, cls.file, bound)._replace(pointer=pointer)
        return Type(f"{outer.name}::{rest}", (), pointer)


Declared = TypeVar("Declared")


def _plain(path: str) -> str:
    """Return the last part of a path without its ending, as ``AStarPlanner`` and ``a_star_planner.hpp`` share it."""
    return os.path.splitext(os.path.basename(path))[0].replace("_", "").lower()


def _extend(table: dict[str, list[Declared]], own: Mapping[str, list[Declared]]) -> None:
    for name, found in own.items():
        table.setdefault(name, []).extend(found)


def _complete(function: Function, declared: Iterable[Function]) -> None:
    """Add what only the declaration of a function says: default arguments, ``virtual``, ``override``."""
    for each in declared:
        if len(each.parameters) != len(function.parameters):
            continue
        function.virtual = function.virtual or each.virtual
        function.overrides = function.overrides or each.overrides
        for own, other in zip(function.parameters, each.parameters, strict=False):
            own.default = own.default or other.default


_BUILT_IN = re.compile(
    r"(?:(?:unsigned|signed|long|short|int|char|bool|float|double) ?)+|(?:std::)?(?:string|size_t)|u?int\d+_t"
)
