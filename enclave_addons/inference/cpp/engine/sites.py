"""Places in the text that may make an interface, and the functions that lead to one, by their words. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.declarations import FileIndex, Function
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


def sites_of(index: FileIndex) -> Iterator[Site]:
    """Yield the places of one file, by the words in its preprocessed text."""
    source = index.source.text
    if not _SITE.search(source):
        return
    blanked = _STRINGS.sub(lambda m: '"' + "_" * (len(m[0]) - 2) + '"', source)
    for match in _SITE.finditer(blanked):
        offset = len(source[: match.start()].encode())
        line = source.count("\n", 0, match.start()) + 1
        yield Site(index.file, offset, line, next(filter(None, match.groups())))


def makes(words: frozenset[str]) -> bool:
    """Return whether code with these words may make an interface or declare a parameter itself."""
    return not words.isdisjoint(MAKERS | _PARAMETERS) or any(CREATES.fullmatch(word) for word in words)


class Leading:
    """The functions and classes by whose names code leads to a place that makes an interface."""

    def __init__(self, names: Names):
        self._names = names

    @cached_property
    def words(self) -> frozenset[str]:
        """Return the names of functions and classes that lead to an interface, over any number of calls."""
        functions = [each for listed in self._names.functions_by_name.values() for each in listed]
        mentioning: dict[str, list[Function]] = {}
        for function in functions:
            for word in self._names.spoken_of(function):
                mentioning.setdefault(word, []).append(function)
        found: set[str] = set()
        waiting = [function for function in functions if makes(function.words)]
        seen = set(waiting)
        for listed in self._names.classes.values():
            for cls in listed:
                if any(base.rpartition("::")[2] in ("Node", "LifecycleNode") for base in cls.bases):
                    found.add(cls.name)
                    waiting += [f for f in mentioning.get(cls.name, ()) if f not in seen]
        while waiting:
            function = waiting.pop()
            seen.add(function)
            name = function.name.lstrip("~")
            if name not in found:
                found.add(name)
                waiting += [each for each in mentioning.get(name, ()) if each not in seen]
        return frozenset(found)

    def function(self, function: Function) -> bool:
        """Return whether a function may lead to an interface."""
        return makes(function.words) or not self.words.isdisjoint(self._names.spoken_of(function))

    def code(self, node: Node) -> bool:
        """Return whether a closure or other piece of code may."""
        return self.of_words(words_in(node))

    def of_words(self, words: frozenset[str]) -> bool:
        """Return whether code with these words may."""
        return makes(words) or not self.words.isdisjoint(words)
