"""Every place that could make an interface is accounted for: as one, as dead for a reason, or as a gap.

Places are found by their words in the text of the program's files, whatever the grammar made of them: nothing that the
analysis did not run, or the parser did not understand, is missing without a word.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from enclave_addons.inference.cpp.reading.declarations import Class, Field, FileIndex, Function
from enclave_addons.inference.cpp.reading.type_names import POINTER_MEMBERS
from enclave_addons.inference.cpp.syntax import Node, field_of, line_of, text, words_in
from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from enclave_addons.inference.cpp.running.machine import Machine

CREATES = re.compile(
    r"create_(?:publisher|subscription|service|client|server|action_server|action_client|generic_\w+|sub_node|lifecycle_publisher|camera_publisher|"
    r"camera_subscription|subscriber)|advertise\w*|createPublisher|createSubscription|createService|createClient|"
    r"create(?:Shared|Unique|Unmanaged)?Instance|wait_for_message|createSubscriber|subscribeCamera|advertiseCamera|add_publisher|"
    r"configure_introspection|subscribe|on_parameter_event|"
    r"rclc?_(?:publisher|subscription|service|client|action_server|action_client|node)_init(?:_(?!options)\w+)?"
)
MAKERS = frozenset({
    "TransformListener", "TransformBroadcaster", "StaticTransformBroadcaster", "Updater", "Bond", "ImageTransport",
    "Subscriber", "SubscriberFilter", "BufferServer", "BufferClient", "AsyncParametersClient", "SyncParametersClient",
    "ParameterEventHandler", "InteractiveMarkerServer", "SimpleActionServer", "SimpleActionClient", "ServiceClient",
    "CameraInfoManager",
})  # fmt: skip
"""Classes of libraries whose objects make interfaces."""
_MADE = rf"(?:make_shared|make_unique)\s*<\s*(?:\w+::)*(?:{'|'.join(sorted(MAKERS))})\b"
_DECLARES = ("function_declarator", "using_declaration", "template_parameter_list", "friend_declaration")
_MAKING = ("call_expression", "field_initializer", "argument_list", "new_expression")
_SITE = re.compile(
    rf"(?<![\w])({CREATES.pattern})(?=\s*[<(])|(?<![\w])({_MADE})|(?<![\w])(new\s+(?:\w+::)*(?:{'|'.join(sorted(MAKERS))}))\b"
)
_STRINGS = re.compile(r'"(?:\\.|[^"\\\n])*"')


class Site(NamedTuple):
    """A place whose ``word`` may make an interface; ``offset`` counts bytes of the preprocessed text."""

    file: str
    offset: int
    line: int
    word: str


class SiteAnswer(NamedTuple):
    """``reason``: why the place is dead, or what is missing."""

    site: Site
    dead: bool
    reason: str

    @property
    def source(self) -> SourceRef:
        return SourceRef(self.site.file, self.site.line)


def sites_of(index: FileIndex) -> tuple[Site, ...]:
    """Return the places of one file, by the words in its preprocessed text."""
    if index.sites is None:
        index.sites = tuple(_found_in(index))
    return index.sites


def _found_in(index: FileIndex) -> Iterator[Site]:
    source = index.source.text
    if not _SITE.search(source):
        return
    blanked = _STRINGS.sub(lambda m: '"' + "_" * (len(m[0]) - 2) + '"', source)
    for match in _SITE.finditer(blanked):
        offset = len(source[: match.start()].encode())
        line = source.count("\n", 0, match.start()) + 1
        yield Site(index.file, offset, line, next(filter(None, match.groups())))


def account(run: Machine, files: Iterable[FileIndex]) -> list[SiteAnswer]:
    """Report what became of each place that has no interface and no gap of its own."""
    answers: list[SiteAnswer] = []
    reachable = reachable_functions(run)
    for index in files:
        functions = sorted(index.all_functions, key=lambda f: f.node.start_byte)
        starts = [function.node.start_byte for function in functions]
        handled = run.handled.get(index.file, set())
        for site in sites_of(index):
            answer = _answer(run, index, site, functions, starts, handled, reachable)
            if answer is not None:
                answers.append(answer)
    told = [*run.gaps, *(gap for record in run.nodes.values() for gap in record.gaps)]
    settled = {(source.file, source.line) for source, _ in told}
    settled |= {(answer.site.file, answer.site.line) for answer in answers if not answer.dead}
    for function in sorted(reachable | run.called, key=lambda f: (f.file.file, f.node.start_byte)):
        for site in open_calls(run, function):
            if (site.file, site.line) not in settled and not _is_settled(run, function):
                whose = (
                    f"{site.word}() was not followed here"
                    if function in run.called
                    else (f"{site.word}() is called by {function}, and it was not understood who calls that")
                )
                answers.append(SiteAnswer(site, False, f"{whose}: it may make interfaces"))
    return answers


def _is_settled(run: Machine, function: Function) -> bool:
    return function not in run.called and _is_overridden(run, function)


def open_calls(run: Machine, function: Function) -> Iterator[Site]:
    """Find the calls in ``function`` of functions that lead to interfaces, as far as they were not followed."""
    source, start = function.node.text or b"", function.node.start_byte
    handled = run.handled.get(function.file.file, set())
    resolved = run.resolved.get(function.file.file, set())
    for match in _CALL.finditer(source):
        word, offset = match[1].decode("utf-8", "replace"), start + match.start()
        if word in run.names.named_as_messages:
            word = word.rpartition("::")[2]
        called = run.names.functions_by_name.get(word, ()) if word not in _STATEMENTS else ()
        if not any(run.makes_interfaces(each) for each in called if _may_have_object(run, each)):
            continue
        node = _called_at(function.node.descendant_for_byte_range(offset, offset + len(match[1])))
        if node is None or node.start_byte in handled | resolved or _is_dead(run, function.file.file, offset):
            continue
        yield Site(function.file.file, offset, line_of(node), word)


def _may_have_object(run: Machine, function: Function) -> bool:
    """Return whether an object of the class was made; who makes one unseen is reported there."""
    owner = function.owner.rpartition("::")[2]
    return not owner or function.static or owner == function.name or owner in run.used_classes()


_STATEMENTS = frozenset({"if", "for", "while", "switch", "catch", "return"})
"""What the parser may take for functions in code that it does not understand."""
_CALL = re.compile(rb'(?<!["\w])((?:(?:msg|srv|action)::)?[A-Za-z_]\w*)\s*(?=[(<])')


def _called_at(node: Node | None) -> Node | None:
    """Return the call whose callee ends in the name at ``node``, or what the parser did not understand around it."""
    while (
        node is not None
        and node.parent is not None
        and node.type not in ("argument_list", "compound_statement")
    ):
        if node.is_error:
            return node
        if node.parent.type == "call_expression" and field_of(node.parent, "function") == node:
            return node.parent
        node = node.parent
    return None


def _answer(
    run: Machine, index: FileIndex, site: Site, functions: list[Function], starts: list[int], handled: set[int],
    reachable: set[Function],
) -> SiteAnswer | None:  # fmt: skip
    function = _around(site.offset, functions, starts)
    if function is None:
        if _is_declaration(index, site) or _is_handled(index, site, handled):
            return None
        owner = _class_around(index, site)
        made = (each for cls in run.made_classes() for each in run.names.ancestry(cls))
        if owner is not None and owner not in made:
            return SiteAnswer(site, True, f"the program makes no object of {owner}")
        return SiteAnswer(site, False, f"{site.word} stands where it is not understood")
    if _is_handled(index, site, handled):
        return None
    if function.name == site.word and site.offset < _body_start(function):
        return None  # the name of the function itself
    for (file, start, end), why in run.dead.items():
        if file == index.file and start <= site.offset < end:
            return SiteAnswer(site, True, why)
    if function not in run.called:
        if function not in reachable:
            return SiteAnswer(site, True, f"nothing in the program calls {function}")
        if _is_overridden(run, function):
            return SiteAnswer(site, True, f"every object of the program overrides {function}")
        return SiteAnswer(
            site, False, f"{site.word}: it was not understood who calls {function}, and for which node"
        )
    return SiteAnswer(
        site, False, f"{site.word} was not followed: whether it is reached, and for which node, is not known"
    )


def _class_around(index: FileIndex, site: Site) -> Class | None:
    inner: Class | None = None
    for cls in (each for listed in index.classes.values() for each in listed):
        around = cls.node.start_byte <= site.offset < cls.node.end_byte
        if around and (inner is None or cls.node.start_byte > inner.node.start_byte):
            inner = cls
    return inner


def _is_overridden(run: Machine, function: Function) -> bool:
    """Return whether no object has the method, since its class overrides it, and nobody calls it by its class."""
    if not function.virtual or not function.owner:
        return False
    last = function.owner.rpartition("::")[2]
    holders = [
        cls for cls in run.made_classes() if any(each.name == last for each in run.names.ancestry(cls))
    ]
    if not holders or any(function in run.names.find_methods(cls, function.name) for cls in holders):
        return False
    by_class = re.compile(rf"\b{last}\s*::\s*{re.escape(function.name)}\s*\(")
    return not any(by_class.search(text(each.body)) for each in run.called)


def _body_start(function: Function) -> int:
    return function.body.start_byte if function.body is not None else function.node.end_byte


def _around(offset: int, functions: list[Function], starts: list[int]) -> Function | None:
    position = bisect.bisect_right(starts, offset)
    best = None
    for function in functions[max(0, position - 40) : position]:
        if function.node.start_byte <= offset < function.node.end_byte:
            best = function
    return best


def _is_handled(index: FileIndex, site: Site, handled: set[int]) -> bool:
    """Return whether a call whose name is this word had its result: it begins before the word, its arguments behind
    it.
    """
    node = index.tree.root_node.descendant_for_byte_range(site.offset, site.offset + 1)
    while node is not None and node.type not in (
        "compound_statement",
        "function_definition",
        "argument_list",
    ):
        if node.type in _MAKING and node.start_byte in handled:
            return True
        node = node.parent
    return False


def _is_declaration(index: FileIndex, site: Site) -> bool:
    """Return whether ``create_publisher`` is the name of a method only declared, or in a macro that nobody uses."""
    node = index.tree.root_node.descendant_for_byte_range(site.offset, site.offset + 1)
    while node is not None and node.type not in ("call_expression", "ERROR", "init_declarator"):
        if node.type in _DECLARES:
            return True
        node = node.parent
    return False


# --- who may be called ------------------------------------------------------------------------------------------


def reachable_functions(run: Machine) -> set[Function]:
    """Return every function that one of those that ran could call, by its name: never fewer than are called."""
    return Reach(run).from_functions(run.called)


class Reach:
    """What can be called, by name. A method counts when its class, or one derived from it, is made or spoken of."""

    def __init__(self, run: Machine, operators: bool = False):
        """Begin with the classes that the program has used so far.

        Args:
            operators: Whether a sign in reached code also reaches the program's operators of that sign.
        """
        self.run, self.operators = run, operators
        self.by_name = run.names.functions_by_name
        self.mentioned: set[str] = set()
        self.used: set[str] = set()
        self.reached: set[Function] = set()
        self.waiting: list[Function] = []
        self.idle: dict[str, list[Function]] = {}  # class -> methods that wait for code that mentions it
        self.used |= run.used_classes()
        self.followed = False  # whether functions that ran count with what was not followed in them alone

    def from_functions(self, functions: Iterable[Function]) -> set[Function]:
        for cls in sorted(self.used):
            self._use_class(cls)
        self.waiting += functions
        self.waiting += [
            f for name, found in self.by_name.items() if name.startswith("operator") for f in found
        ]
        self.followed = True
        return set(self._each())

    def from_code(self, code: Function | Node) -> Iterator[Function]:
        """Yield the functions reachable from a function, itself included, or from a closure.

        The hooks of objects that were made are not among them.
        """
        if isinstance(code, Function):
            self.waiting.append(code)
        else:
            self._mention(words_in(code))
            self._sign(self.run.names.signs_in(code))
        yield from self._each()

    def from_words(self, words: Iterable[str]) -> Iterator[Function]:
        """Yield functions reachable from one that mentions ``words``, without the made objects' own hooks."""
        self._mention(words)
        yield from self._each()

    def _each(self) -> Iterator[Function]:
        while self.waiting:
            function = self.waiting.pop()
            if function not in self.reached and not self._is_idle(function):
                self.reached.add(function)
                yield function
                self._visit(function)

    def _is_idle(self, function: Function) -> bool:
        owner = function.owner.rpartition("::")[2]
        if not owner or function.static or owner in self.used or function in self.run.called:
            return False
        self.idle.setdefault(owner, []).append(function)
        return True

    def _visit(self, function: Function) -> None:
        if not self.followed or function not in self.run.called:
            self._mention(self.run.names.spoken_of(function))
            if self.operators:
                self._sign(self.run.names.signs(function))
            return
        calls, types = open_words(self.run, function, self.by_name)
        self._mention(calls)
        for name in types:
            if name in self.run.names.classes:
                self._use(name)

    def _sign(self, signs: frozenset[str]) -> None:
        for sign in signs - self.mentioned:
            self.mentioned.add(sign)
            self.waiting += self.run.names.operators[sign]

    def _mention(self, words: Iterable[str]) -> None:
        for word in words:
            if word in self.mentioned:
                continue
            self.mentioned.add(word)
            self.waiting += self.by_name.get(word, ())
            last = word.rpartition("::")[2]
            if last in self.run.names.classes and (last == word or word in self.run.names.named_as_messages):
                self._use(last)
            if word not in POINTER_MEMBERS:  # a pointer makes nothing of what it points to
                for alias in self.run.names.aliases.get(word, ()):
                    self._mention(_WORD.findall(alias.target))

    def _use(self, name: str) -> None:
        if name not in self.used:
            self.used.add(name)
            self._use_class(name)

    def _use_class(self, name: str) -> None:
        self.waiting += self.idle.pop(name, ())
        for cls in self.run.names.classes.get(name, ()):
            for written in cls.bases:
                self._mention(_WORD.findall(written))
            for field in cls.fields.values():
                self._field(field)
            for method in (m for table in self.run.names.methods.get(cls, {}).values() for m in table):
                # Called through a base, or by a sign.
                if method.virtual or method.name.startswith("operator"):
                    self.waiting.append(method)

    def _field(self, field: Field) -> None:
        """Follow a member: an object is made with its class, a pointer only points to an object made elsewhere."""
        words = _WORD.findall(field.type)
        if not field.pointer and not _POINTER.search(field.type):
            self._mention(words)
            return
        for word in words:
            if word in self.run.names.classes:
                self._use(word)


_POINTS = re.compile(r"_ptr\b|Ptr\b|\*|\bweak_")
_POINTER = re.compile(f"{_POINTS.pattern}|&")
_WORD = re.compile(r"[A-Za-z_]\w*")


def open_words(
    run: Machine, function: Function, by_name: Mapping[str, Sequence[Function]]
) -> tuple[set[str], set[str]]:
    """Return functions that one that ran mentions without the call having been followed; and classes only spoken of."""
    calls: set[str] = set()
    types: set[str] = set()
    source = function.node.text or b""
    start = function.node.start_byte
    handled = run.handled.get(function.file.file, set())
    for match in _TOKEN.finditer(source):
        word = match[0].decode("utf-8", "replace")
        if word not in by_name and word not in run.names.classes:
            continue
        offset = start + match.start()
        found = function.node.descendant_for_byte_range(offset, offset + len(match[0]))
        how = _mentioned_how(found, handled)
        if how == "type":
            types.add(word)
            if _is_object(found) and not _is_dead(run, function.file.file, offset):
                calls.add(word)  # a value that stands for an object runs a constructor
        elif how == "open" and not _is_dead(run, function.file.file, offset):
            calls.add(word)
    return calls, types


_TOKEN = re.compile(rb'(?<!["\w])[A-Za-z_]\w*')
_TYPES = ("parameter_declaration", "optional_parameter_declaration", "type_descriptor", "alias_declaration",
          "using_declaration", "trailing_return_type", "for_range_loop")  # fmt: skip


def _mentioned_how(node: Node | None, handled: set[int]) -> str:
    """Return ``followed``, ``type`` (nothing is made or called) or ``open``."""
    inside_type = False
    while node is not None and node.parent is not None:
        parent = node.parent
        if parent.type == "call_expression":
            is_callee = field_of(parent, "function") == node
            return "followed" if is_callee and parent.start_byte in handled else "open"
        if parent.type in ("new_expression", "compound_literal_expression"):
            is_made = field_of(parent, "type") == node
            return "followed" if is_made and parent.start_byte in handled else "open"
        if inside_type and parent.type == "declaration":
            return "type"  # of an element, whatever became of the list
        if parent.type in ("declaration", "field_initializer"):
            arguments = parent.named_children[-1].start_byte if parent.named_children else 0
            if parent.start_byte in handled or arguments in handled:
                return "followed"
            return (
                "type"
                if inside_type
                or (
                    field_of(parent, "type") == node
                    and _POINTER.search((parent.text or b"").decode("utf-8", "replace"))
                )
                else "open"
            )
        if parent.type in ("string_literal", "function_definition"):
            return "type"
        if parent.type in _TYPES[:2]:
            return "type"
        inside_type = inside_type or parent.type in _TYPES
        if parent.type in ("compound_statement", "argument_list"):
            return "type" if inside_type else "open"
        node = parent
    return "open"


def _is_object(name: Node | None) -> bool:
    """Return whether a type is that of an object, also in a container, or a reference to one made for it."""
    written = name
    while (
        written is not None
        and written.parent is not None
        and written.type != "trailing_return_type"
        and (written.parent.type in _PARTS_OF_TYPES or written.parent.type in _TYPES)
    ):
        written = written.parent
    parent = written.parent if written is not None else None
    if written is None or parent is None:
        return False
    if written.type not in _TYPES and field_of(parent, "type") != written:
        return False
    whole = text(parent if parent.type == "declaration" else written).partition("=")[0]
    declarator = field_of(parent, "declarator")
    if (
        parent.type == "function_definition"
        and declarator is not None
        and declarator.type != "function_declarator"
    ):
        return False
    return not _POINTS.search(whole) and ("&" not in whole or "const" in whole or "&&" in whole)


_PARTS_OF_TYPES = ("qualified_identifier", "template_type", "template_argument_list", "abstract_function_declarator",
                   "parameter_list")  # fmt: skip


def _is_dead(run: Machine, file: str, offset: int) -> bool:
    return any(where == file and start <= offset < end for where, start, end in run.dead)


def leads_to_interfaces(run: Machine, words: frozenset[str]) -> bool:
    """Return whether a function with these words, or one that it may call, makes an interface, a node or a plugin."""
    return without_interfaces(run, words) is None


def without_interfaces(run: Machine, words: frozenset[str]) -> Reach | None:
    """Return what a function with these words may call, if neither it nor any of that makes an interface or a node."""
    reach = Reach(run)
    makes = makes_by_words(words) or any(makes_by_words(each.words) for each in reach.from_words(words))
    return None if makes else reach


@lru_cache(maxsize=50_000)
def makes_by_words(words: frozenset[str]) -> bool:
    """Return whether one of the words makes an interface by itself."""
    return not words.isdisjoint(MAKERS) or any(map(CREATES.fullmatch, words))
