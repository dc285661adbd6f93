"""Places in the text that may make an interface, and the functions that lead to one, by their words. Pure."""

from __future__ import annotations

import re
from functools import cached_property, lru_cache
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.declarations import Class, FileIndex, Function, Mention
from enclave_addons.inference.cpp.reading.names import Names
from enclave_addons.inference.cpp.syntax import Node, words_in

CREATES = re.compile(
    r"create_(?:publisher|subscription|service|client|server|action_server|action_client|generic_\w+|sub_node|"
    r"lifecycle_publisher|camera_publisher|camera_subscription|subscriber)|advertise\w*|createPublisher|"
    r"createSubscription|createService|createClient|create(?:Shared|Unique|Unmanaged)?Instance|wait_for_message|"
    r"createSubscriber|subscribeCamera|advertiseCamera|add_publisher|configure_introspection|subscribe|"
    r"on_parameter_event|rclc?_(?:publisher|subscription|service|client|action_server|action_client|node)_init(?:_(?!options)\w+)?"
)
MAKERS = frozenset({
    "TransformListener", "TransformBroadcaster", "StaticTransformBroadcaster", "Updater", "Bond", "ImageTransport",
    "Subscriber", "SubscriberFilter", "BufferServer", "BufferClient", "AsyncParametersClient", "SyncParametersClient",
    "ParameterEventHandler", "InteractiveMarkerServer", "SimpleActionServer", "SimpleActionClient", "ServiceClient",
    "CameraInfoManager",
})  # fmt: skip
"""Classes of libraries whose objects make interfaces."""
_PARAMETERS = frozenset({"declare_parameter", "auto_declare", "add_on_set_parameters_callback"})
_MADE = rf"(?:make_shared|make_unique)\s*<\s*(?:\w+::)*(?:{'|'.join(sorted(MAKERS))})\b"
_SITE = re.compile(
    rf"(?<![\w])({CREATES.pattern})(?=\s*[<(])|(?<![\w])({_MADE})|"
    rf"(?<![\w])(new\s+(?:\w+::)*(?:{'|'.join(sorted(MAKERS))}))\b"
)
_STRINGS = re.compile(r'"(?:\\.|[^"\\\n])*"')


class Site(NamedTuple):
    """A place whose ``word`` may make an interface; ``offset`` counts bytes of the preprocessed text."""

    file: str
    offset: int
    line: int
    word: str


@lru_cache(maxsize=4096)
def sites_of(index: FileIndex) -> tuple[Site, ...]:
    """Return the places of one file, by the words in its preprocessed text."""
    source = index.source.text
    if not _SITE.search(source):
        return ()
    blanked = _STRINGS.sub(lambda m: '"' + "_" * (len(m[0]) - 2) + '"', source)
    return tuple(
        Site(
            index.file,
            len(source[: match.start()].encode()),
            source.count("\n", 0, match.start()) + 1,
            next(filter(None, match.groups())),
        )
        for match in _SITE.finditer(blanked)
    )


def makes(words: frozenset[str]) -> bool:
    """Return whether code with these words may make an interface or declare a parameter itself."""
    return not words.isdisjoint(MAKERS | _PARAMETERS) or any(CREATES.fullmatch(word) for word in words)


class Leading:
    """The functions from which code leads to a place that makes an interface, over any number of calls.

    Who is called is read from the text: a method of the class that the object before it is declared with, or of one
    above or below that class; where no class is known, every function of that name.
    """

    def __init__(self, names: Names):
        self._names = names
        self._classes = [cls for listed in names.classes.values() for cls in listed]
        self._owners = {
            method: cls
            for cls in self._classes
            for listed in names.methods.get(cls, {}).values()
            for method in listed
        }

    @cached_property
    def words(self) -> frozenset[str]:
        """Return the names of the functions and classes that lead to an interface."""
        return self._nodes | {each.name.lstrip("~") for each in self._functions}

    @cached_property
    def _nodes(self) -> frozenset[str]:
        ends = ("Node", "LifecycleNode")
        return frozenset(
            cls.name for cls in self._classes if any(base.rpartition("::")[2] in ends for base in cls.bases)
        )

    @cached_property
    def _functions(self) -> frozenset[Function]:
        functions = [each for listed in self._names.functions_by_name.values() for each in listed]
        callers: dict[Function, list[Function]] = {}
        for function in functions:
            for called in self._called(function):
                callers.setdefault(called, []).append(function)
        waiting = [
            f
            for f in functions
            if makes(f.words) or not self._nodes.isdisjoint(f.words) or self._calls_closures(f)
        ]
        found = set(waiting)
        while waiting:
            new = [each for each in callers.get(waiting.pop(), ()) if each not in found]
            found.update(new)
            waiting += new
        return frozenset(found)

    def _calls_closures(self, function: Function) -> bool:
        """Return whether a function names a member that holds a closure, which may be any code."""
        fields = {
            name: (field.type, cls)
            for cls in reversed(self._names.ancestry(self._owners.get(function)))
            for name, field in cls.fields.items()
            if "function" in field.type or "allback" in field.type
        }
        named = (fields[each.name] for each in function.mentions if each.name in fields)
        return any(
            self._names.resolve(kind, cls.scope, cls.file).name == "std::function" for kind, cls in named
        )

    def _declared(self, function: Function, name: str) -> tuple[str | None, Class | None]:
        """Return the type that a parameter, or a member of a class, is declared with."""
        for parameter in function.parameters:
            if parameter.name == name:
                return parameter.type, None
        for cls in self._names.ancestry(self._owners.get(function)):
            if name in cls.fields:
                return cls.fields[name].type, cls
        return None, None

    def _called(self, function: Function) -> set[Function]:
        """Return the functions of the program that a function may call."""
        found: set[Function] = set()
        by_name = self._names.functions_by_name
        for mention in function.mentions:
            named = [*by_name.get(mention.name, ()), *by_name.get(f"~{mention.name}", ())]
            if named:
                known, cls = self._receiver(function, mention)
                found.update(
                    each for each in named if not known or self._is_meant(each, cls, bool(mention.link))
                )
        return found

    def _is_meant(self, function: Function, cls: Class | None, is_member: bool) -> bool:
        """Return whether a function is a method of the family of ``cls``, or can be called without an object."""
        owner = self._owners.get(function)
        if owner is None or (not is_member and function.name.lstrip("~") == owner.name):
            return not is_member
        return cls is not None and (owner in self._names.ancestry(cls) or cls in self._names.ancestry(owner))

    def _receiver(self, function: Function, mention: Mention) -> tuple[bool, Class | None]:
        """Return whether it is known whose method is called, and the class, ``None`` for one of a library."""
        own = self._owners.get(function)
        if not mention.link or mention.before == "this":
            return True, own
        if mention.link == "::":
            cls = (
                self._names.find_class(mention.before, function.scope, function.file)
                if mention.before
                else None
            )
            return cls is not None, cls
        written, place = self._declared(function, mention.before)
        if written is None:
            return False, None
        scope, file = (function.scope, function.file) if place is None else (place.scope, place.file)
        kind = self._names.resolve(written, scope, file)
        if kind.pointer and mention.link == "." and "*" not in written:
            return True, None  # of the smart pointer itself
        cls = self._names.class_of(kind, scope, file)
        return cls is not None or kind.name.startswith("std::"), cls

    def function(self, function: Function) -> bool:
        """Return whether a function may lead to an interface."""
        return function in self._functions

    def code(self, node: Node) -> bool:
        """Return whether a closure or other piece of code may."""
        return self.of_words(words_in(node))

    def of_words(self, words: frozenset[str]) -> bool:
        """Return whether code with these words may."""
        return makes(words) or not self.words.isdisjoint(words)
