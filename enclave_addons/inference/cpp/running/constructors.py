"""How objects are made: what a declaration makes of plain types, containers and classes.

Of a class its bases, its members in the order of their declaration, then the body of the constructor, as C++ does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from enclave_addons.inference.cpp.libraries import LIBRARY_CLASSES, Call, is_harmless_class
from enclave_addons.inference.cpp.reading.declarations import (
    Class,
    Field,
    Function,
    FunctionParameter,
    type_text,
)
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.running.arithmetic import as_type
from enclave_addons.inference.cpp.running.contents import (
    copied,
    elements_copied,
    handed_over,
    items_of,
    takes_another,
)
from enclave_addons.inference.cpp.running.foreign import unmodelled
from enclave_addons.inference.cpp.running.implicit_calls import (
    called_unseen,
    check_implicit_calls,
    keep_closures,
)
from enclave_addons.inference.cpp.running.machine import MAX_DEPTH, NEXT, Frame, Machine
from enclave_addons.inference.cpp.running.overloads import candidates, fits
from enclave_addons.inference.cpp.running.plain_types import (
    MAPS,
    NUMBERS,
    ORDERED,
    SEQUENCES,
    STREAMS,
    TEXT_CLASSES,
)
from enclave_addons.inference.cpp.running.references import (
    as_referred_to,
    forget,
    is_plain,
    keep_reference,
    leads_into,
)
from enclave_addons.inference.cpp.running.static_types import (
    check_hidden,
    given_in_braces,
    given_to,
    kinds_of,
    seen_class,
    seen_type,
    tested,
)
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    END,
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    literal,
    lost,
    open_sequence,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, children, field_of, last_name, text

_MOST_ELEMENTS = 1024


def declared_value(
    run: Machine, node: Node, written: str, value: Node | None, pointer: bool, frame: Frame
) -> Value:
    """Return what ``T x``, ``T x = v``, ``T x(v)``, ``T x{v}`` makes."""
    kind = run.type_of(written, frame)
    if value is None:
        return BOTTOM if pointer or kind.pointer else default_value(run, node, kind, frame)
    if pointer and value.type not in ("argument_list", "initializer_list") and _BINDS_A_NEW.search(written):
        of_other = made_of(run, kind, run.evaluate(value, frame), node, frame)
        if of_other is not None:
            return of_other
    if pointer or kind.pointer or _is_auto(written) or kind.name in NUMBERS:
        by_reference = pointer or (kind.pointer and "optional" not in written)
        found = initial_value(run, value, frame, by_reference or (_is_auto(written) and "&" in written))
        if kind.name == "bool" and not by_reference:
            found = tested(run, value, found, frame)
        if "optional" in written and not pointer:
            found = copied(run, found, node, frame, run.class_of(kind, frame))
        return found if pointer or kind.pointer else as_type(kind.name, found)
    if value.type not in ("argument_list", "initializer_list"):
        return converted(run, kind, run.evaluate(value, frame), node, frame)
    return made(run, node, kind, children(value), frame)


_BINDS_A_NEW = re.compile(r"\bconst\b.*&$|&&$")
"""A reference that an object may be made for."""


def _is_auto(written: str) -> bool:
    return "auto" in written.split() or written.startswith("decltype")


def initial_value(run: Machine, value: Node, frame: Frame, reference: bool = False) -> Value:
    """Return what ``= v`` (copied unless ``reference``), ``(v)`` or ``{v}`` gives; ``BOTTOM`` for empty brackets."""
    if value.type in ("argument_list", "initializer_list"):
        inner = children(value)
        if len(inner) == 1:
            return initial_value(run, inner[0], frame, reference)
        found = run.evaluate(value, frame) if inner else BOTTOM
        called_unseen(run, [found])  # of a deleter
        return found
    found = run.evaluate(value, frame)
    if reference or leads_into(value) or gives_pointer(run, value):
        return found
    if any(isinstance(atom, Seq | Map) for atom in found):
        return elements_copied(run, seen_type(run, value, frame), found, value, frame)
    # Behind a pointer lies an object.
    cls = seen_class(run, value, frame) if text(value).startswith("*") else None
    return copied(run, found, value, frame, cls)


def gives_pointer(run: Machine, value: Node) -> bool:
    """Return whether it is ``&x``, or a call of a function of the program that gives a pointer."""
    if value.type != "call_expression":
        return text(value).startswith("&")
    listed = run.names.functions_by_name.get(last_name(field_of(value, "function")), ())
    declarators = [field_of(each.node, "declarator") for each in listed]
    return bool(listed) and all(
        each is not None and each.type == "pointer_declarator" for each in declarators
    )


def converted(run: Machine, kind: Type, value: Value, node: Node, frame: Frame) -> Value:
    """Convert ``Foo x = y``: a copy of an object, as a Foo, or a Foo made of y."""
    cls = run.class_of(kind, frame)
    found = made_of(run, kind, value, node, frame)
    if found is not None:
        return found
    if any(isinstance(atom, Seq | Map) for atom in value) and cls is None:
        return elements_copied(run, kind, value, node, frame)
    if cls is None or any(isinstance(atom, Obj) for atom in value):
        return copied(run, value, node, frame, cls)
    if any(isinstance(atom, Seq | Group) for atom in value) or not run.names.find_methods(cls, cls.name):
        return value
    return construct(run, kind, [value], node, frame)


def made_of(
    run: Machine, kind: Type, value: Value, node: Node, frame: Frame, explicit: bool = False
) -> Value | None:
    """Return the object that a constructor makes where a value, or one in braces, stands for one ([class.conv.ctor]).

    ``None`` if it is such an object already, or no constructor takes it; ``explicit``: a cast asks for it.
    """
    cls = run.held_class(kind, frame)
    if cls is None or len(value) != 1 or isinstance(value[0], Unknown | Group):
        return None
    atom = value[0]
    if isinstance(atom, Obj) and cls in run.names.ancestry(atom.cls):
        return None
    fitting = [
        each
        for each in run.names.methods[cls].get(cls.name, ())
        if not takes_another(each) and (explicit or not _is_explicit(cls, each))
    ]
    in_braces = list(atom.items) if isinstance(atom, Seq) and not atom.open and not atom.place else []
    for given in (in_braces, [value]):
        if given and any(fits(each, given) for each in fitting):
            return construct(run, kind, given, node, frame)
    return None


def as_result(run: Machine, node: Node, frame: Frame) -> Value:
    """Return what ``return value`` makes of the type that the function says it gives; a closure's is not read."""
    function = frame.function if frame.outer is None else None
    declarator = field_of(function.node, "declarator") if function is not None else None
    if function is None or declarator is None or declarator.type != "function_declarator":
        return run.evaluate(node, frame)
    kind = run.type_of(type_text(function.node), frame)
    if node.type == "initializer_list" and run.held_class(kind, frame) is not None:
        return made(run, node, kind, children(node), frame)
    value = run.evaluate(node, frame)
    found = made_of(run, kind, value, node, frame)
    return value if found is None else found


def _is_explicit(cls: Class, constructor: Function) -> bool:
    """Return whether a constructor may be declared ``explicit``: that may stand where it has no body."""
    declared = [
        each for each in cls.declared.get(cls.name, ()) if len(each.parameters) == len(constructor.parameters)
    ]
    return any("explicit" in text(each.node).partition("(")[0] for each in (constructor, *declared))


def made(run: Machine, node: Node, kind: Type, given: Sequence[Node], frame: Frame) -> Value:
    """Make an object of ``kind`` from arguments in parentheses or braces."""
    cls = run.class_of(kind, frame)
    if cls is None and kind.name in SEQUENCES | MAPS and len(kind.arguments) > 1 + (kind.name in MAPS):
        compared = [each for each in given if each.type in ("identifier", "lambda_expression")]
        called_unseen(run, [run.evaluate(each, frame) for each in compared])  # a comparator, a hash
    if cls is None and kind.name in SEQUENCES:
        return _sequence(run, node, kind, given, frame)
    if cls is None and kind.name in MAPS:
        return as_map([_entry(run, kind, each, frame) for each in given])
    if cls is None and (kind.name in TEXT_CLASSES or kind.name in NUMBERS or kind.last in run.names.enums):
        if not given:
            return default_value(run, node, kind, frame)
        if kind.name in TEXT_CLASSES:
            parts = [run.evaluate(each, frame) for each in given]
            return begun_stream(parts[0]) if kind.name in STREAMS else text_of(run, parts)
        found = run.evaluate(given[0], frame)
        return as_type(kind.name, tested(run, given[0], found, frame) if kind.name == "bool" else found)
    values: list[Value] | None = None
    if cls is not None and len(given) == 1 and not given[0].type.startswith("initializer_"):
        values = [run.evaluate(given[0], frame)]
        if copies(run, cls, values[0]):
            return copied(run, values[0], node, frame, cls)
    if cls is not None and is_aggregate(run, cls) and given:
        return _aggregate(run, node, kind, cls, given, frame, values)
    values = values or [run.evaluate(each, frame) for each in given]
    if cls is None and len(values) == 1 and (_all_of(kind, values[0]) or _keeps(kind, values[0])):
        return values[0]  # a copy of a library's object, or a closure
    return construct(run, kind, values, node, frame)


def in_braces(run: Machine, value: Node, kind: Type, frame: Frame) -> Value:
    """Return what braces make of a type that is known; of anything else its value."""
    if value.type == "initializer_list" and kind.name:
        return made(run, value, kind, children(value), frame)
    return run.evaluate(value, frame)


def _sequence(run: Machine, node: Node, kind: Type, given: Sequence[Node], frame: Frame) -> Value:
    """Make a list: in braces its elements; in parentheses a copy, a part of another one, or so many equal elements."""
    inner = kind.arguments[0] if kind.arguments else NO_TYPE
    cls = run.held_class(inner, frame)
    if kind.name == "std::array" and [each.type for each in given] == ["initializer_list"]:
        within = children(given[0])  # the braces of the array that std::array holds
        if cls is None or any(each.type == "initializer_list" for each in within):
            given = within
    items = [
        made(run, each, inner, children(each), frame)
        if (cls is not None or inner.name in SEQUENCES) and each.type == "initializer_list"
        else run.evaluate(each, frame)
        if inner.pointer and (inner.name == "char" or each.type.endswith("literal"))
        else _pointed_to(run, each, frame)
        if inner.pointer
        else as_element(run, inner, run.evaluate(each, frame), each, frame)
        for each in given
    ]
    if len(given) == 1 and given[0].type != "initializer_list" and any(isinstance(a, Seq) for a in items[0]):
        return elements_copied(run, kind, items[0], node, frame)
    parent = given[0].parent if given else None
    if kind.name == "std::array":
        items += _not_given(run, node, kind, len(items), frame)
    if parent is None or parent.type != "argument_list":
        return (open_sequence(items) if kind.name in ORDERED else Seq(tuple(items)),)
    if len(items) > 1 and END in items[1]:
        parts = [items_of(run, atom) for atom in items[0]]
        listed = [item for part, _ in parts for item in part]
        found = Seq(tuple(listed)) if len(parts) == 1 and parts[0][1] else open_sequence(listed)
        return elements_copied(run, kind, (found,), node, frame)
    return _repeated(run, node, inner, frame, items[1] if len(items) > 1 else None)


def _not_given(run: Machine, node: Node, kind: Type, count: int, frame: Frame) -> list[Value]:
    """Return the elements of an array behind the ``count`` that its braces give: zero, or as made by default."""
    size = kind.arguments[1].name if count and len(kind.arguments) > 1 else ""
    left = int(size) - count if size.isdigit() else 0
    if left <= 0:
        return []
    inner = kind.arguments[0]
    if inner.pointer:
        value = BOTTOM
    else:
        is_number = inner.name in NUMBERS
        value = as_type(inner.name, (0,)) if is_number else default_value(run, node, inner, frame)
    return [value] * min(left, _MOST_ELEMENTS)


def as_element(run: Machine, kind: Type, value: Value, node: Node, frame: Frame) -> Value:
    """Return what an element of type ``kind`` holds: a copy, or an object made of the value."""
    found = made_of(run, kind, value, node, frame)
    return (
        as_type(kind.name, copied(run, value, node, frame, run.held_class(kind, frame)))
        if found is None
        else found
    )


def _pointed_to(run: Machine, given: Node, frame: Frame) -> Value:
    """Return what an element that is a pointer or reference shows; a plain variable may be written through it."""
    value = run.evaluate(given, frame)
    if is_plain(value) and given.type in ("identifier", "field_expression"):
        keep_reference(run, given, frame)
    return as_referred_to(value)


def _repeated(run: Machine, node: Node, inner: Type, frame: Frame, value: Value | None = None) -> Value:
    """Return several elements of type ``inner``, however many: one stands for all."""
    run.repeated += 1
    mark, steps = run.store.mark(), run.steps
    if value is not None:
        one = copied(run, value, node, frame, run.held_class(inner, frame))
    else:
        one = default_value(run, node, inner, frame) if inner.name and not inner.pointer else BOTTOM
        if _moved_again(run, mark, steps):
            one = default_value(run, node, inner, frame)
    run.repeated -= 1
    return (open_sequence((one,)),)


def _moved_again(run: Machine, mark: int, steps: int) -> bool:
    """Make plain values unknown that a constructor changed outside of its object, as each further one changes them.

    Returns:
        Whether there are any.
    """
    found = False
    for cell, before, value in [*run.moved(mark, steps)]:
        is_outside = before != BOTTOM or not isinstance(cell[0], Obj)
        if is_outside and any(isinstance(atom, Text | int) for atom in value):
            run.store.set(cell, unknown("a value that the constructor of each element changes"))
            found = True
    return found


def cast(run: Machine, kind: Type, value: Value) -> Value:
    """Evaluate ``static_cast<T>(x)``: a number as T holds it, or the object itself; which enumerator is not known."""
    return unknown("an enumerator") if kind.last in run.names.enums else as_type(kind.name, value)


def begun_stream(value: Value) -> Value:
    """Return what a stream holds that is given a text: what is written to it replaces the text from its start."""
    return value if all(plain(atom) == "" for atom in value) else unknown("a stream that begins with a text")


def text_of(run: Machine, values: Sequence[Value]) -> Value:
    """Make ``std::string(...)`` of a text, of so many letters, of a part of a text.

    Two letters in braces look the same.
    """
    if len(values) == 1:
        is_made = any(isinstance(atom, int | Seq) for atom in values[0])
        return unknown("a made text") if is_made else values[0]
    return unknown("a text made of several values")


def copies(run: Machine, cls: Class, value: Value) -> bool:
    """Return whether an object of the class, or of a derived one, is all that a constructor gets."""
    derived = all(isinstance(atom, Obj) and cls in run.names.ancestry(atom.cls) for atom in value)
    return bool(value) and derived and not any(map(takes_another, run.names.methods[cls].get(cls.name, ())))


def _all_of(kind: Type, value: Value) -> bool:
    return bool(value) and all(isinstance(atom, Obj) and atom.type.name == kind.name for atom in value)


def _keeps(kind: Type, value: Value) -> bool:
    """Return whether a closure is kept as it is, in the ``T`` of a template."""
    return bool(value) and all(isinstance(atom, Lambda | Bound) for atom in value) and "::" not in kind.name


def as_map(items: Sequence[Value]) -> Value:
    """Return a map of these pairs, the first of each key; a map among them comes back, all else gives an unknown."""
    entries: list[tuple[Value, Value]] = []
    for value in items:
        for atom in value:
            if isinstance(atom, Group | Seq) and len(atom.items) == 2:
                if all(key != atom.items[0] for key, _ in entries):
                    entries.append((atom.items[0], atom.items[1]))
            elif isinstance(atom, Map):
                return value
            else:
                return unknown("entries of a map")
    return (Map(tuple(entries)),)


def _entry(run: Machine, kind: Type, given: Node, frame: Frame) -> Value:
    """Return what is given to a map: of ``{key, value}`` with an object of a class in reach both."""
    inner = kind.arguments[1] if len(kind.arguments) > 1 else NO_TYPE
    pair = children(given) if given.type == "initializer_list" else []
    if len(pair) != 2 or run.held_class(inner, frame) is None:
        return run.evaluate(given, frame)
    key = run.evaluate(pair[0], frame)
    held = in_braces(run, pair[1], inner, frame)
    return (Group((key, as_element(run, inner, held, pair[1], frame))),)


def is_aggregate(run: Machine, cls: Class) -> bool:
    """Return whether braces fill its fields: the class has neither bases nor constructors."""
    return not (cls.bases or run.names.find_methods(cls, cls.name) or cls.name in cls.declared)


def fields_of(cls: Class) -> list[str]:
    """Return the members that braces fill, in order."""
    return [each.name for each in cls.fields.values() if not each.static]


def _aggregate(
    run: Machine,
    node: Node,
    kind: Type,
    cls: Class,
    given: Sequence[Node],
    frame: Frame,
    values: list[Value] | None,
) -> Value:
    """Make an object whose fields braces fill; ``values``: what was given, if that ran already."""
    names = fields_of(cls)
    bindings = run.names.bindings(cls, kind)
    members: dict[str, Value] = {}
    for position, item in enumerate(given):
        name, value = names[position] if position < len(names) else "", item
        if item.type == "initializer_pair":
            designator = field_of(item, "designator")
            name, value = text(designator).lstrip("."), field_of(item, "value") or item
        if name:
            member = cls.fields.get(name)
            inner = run.names.resolve(member.type, cls.scope, cls.file, bindings) if member else NO_TYPE
            given_value = values[position] if values else in_braces(run, value, inner, frame)
            by_value = member is not None and not member.pointer and not inner.pointer
            members[name] = elements_copied(run, inner, given_value, item, frame) if by_value else given_value
    return construct(run, kind, [], node, frame, members=members)


def default_value(run: Machine, node: Node, kind: Type, frame: Frame) -> Value:
    """Return what a declaration without initial value holds."""
    if kind.name in TEXT_CLASSES:
        return literal("")
    if kind.name == "std::array" and kind.arguments and not kind.arguments[0].pointer:
        return _repeated(run, node, kind.arguments[0], frame)
    if kind.name in SEQUENCES:
        return (Seq(()),)
    if kind.name in MAPS:
        return (Map(()),)
    if kind.name in NUMBERS or not kind.name or kind.last in run.names.enums:
        return unknown("a value that is not set")
    if kind.name in ("std::function", "std::pair", "std::tuple", "std::mutex"):
        return BOTTOM
    return construct(run, kind, [], node, frame)


# --- objects of classes ------------------------------------------------------------------------------------------


def construct(
    run: Machine,
    kind: Type,
    arguments: Sequence[Value],
    node: Node,
    frame: Frame,
    *,
    heap: bool = False,
    members: Mapping[str, Value] | None = None,
) -> Value:
    """Make an object of ``kind``: by its source, by the table of libraries, or one of which nothing is known."""
    cls = run.class_of(kind, frame)
    if cls is None and kind.name in SEQUENCES | MAPS and not arguments:
        run.handle(node, frame)
        if heap:
            return unknown("what several pointers may show")
        return (Seq(()),) if kind.name in SEQUENCES else (Map(()),)
    if cls is None:
        kind = _in_used_namespace(run, kind, frame)
    key = ("object", frame.file.file, node.start_byte, node.end_byte, frame.path, kind)
    made_object = run.obj(key, kind, cls=cls, heap=heap)
    run.handle(node, frame)
    if cls is not None:
        if members is None and arguments and is_aggregate(run, cls):
            members = dict(zip(fields_of(cls), arguments, strict=False))
        made_object.data["members"] = members or {}
        _start_fields(run, made_object, cls)
        check_hidden(run, made_object, cls, node, frame)
        check_implicit_calls(run, cls, node, frame)
        if any(cls.name in run.names.pointers_to_plain.get(field, ()) for field in cls.fields):
            for each, value in zip(given_to(node, frame), arguments, strict=False):
                if is_plain(value):
                    keep_reference(run, each, frame)
        construct_class(run, made_object, cls, kind, arguments, node, frame)
        keep_closures(run, made_object, cls)
        return (made_object,)
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        call = Call(node, frame, list(arguments), kind.arguments, receiver=made_object)
        found = model(run, call)
        return (made_object,) if found is None else found
    if kind.name.startswith("std::") and (heap or kind.name != "std::function"):
        called_unseen(run, arguments)
    if not is_harmless_class(kind.name):
        whom = f"the constructor of {kind.name}"
        handed_over(run, whom, arguments, node, frame)
        run.calls.may_be_written(run, whom, arguments, given_to(node, frame), frame)
        _unmodelled(run, kind, node, frame, heap or bool(arguments))
    made_object.data["arguments"] = list(arguments)
    return (made_object,)


def _in_used_namespace(run: Machine, kind: Type, frame: Frame) -> Type:
    """Return the class of the table, or of Eigen, that ``using namespace`` brings in under a name without one."""
    found = (f"{each}::{kind.name}" for each in run.names.used_namespaces(frame.file.file))
    known = (
        [name for name in found if name in LIBRARY_CLASSES or _EIGEN.fullmatch(name)]
        if "::" not in kind.name
        else []
    )
    return kind._replace(name=known[0]) if len(known) == 1 else kind


_EIGEN = re.compile(
    r"Eigen::(?:(?:Sparse|Diagonal)?Matrix\w*|(?:Row)?Vector\w*|Array\w*|Quaternion\w*|(?:Affine|Isometry|Translation)\w+|"
    r"AngleAxis\w*|Transform)"
)


def _unmodelled(run: Machine, kind: Type, node: Node, frame: Frame, deliberate: bool) -> None:
    """Make an object of a class that is neither in reach nor in the table: it may be a node or make one.

    ``deliberate``: it is made with arguments or with new, as structures of C are not.
    """
    why = unmodelled(run.names, kind.name, frame.scope, frame.file, deliberate)
    if why and all(why != said for _, said in run.gaps):  # one place says it of a class
        run.gap(node, frame, why)


def _never_known(run: Machine, this: Obj, cls: Class, why: str) -> None:
    """Know nothing of the texts and numbers that members of ``cls`` hold, whatever is written to them."""
    for name in cls.fields:
        run.store.share_cell((this, name), partial(lost, why=why))


def _start_fields(run: Machine, made_object: Obj, cls: Class) -> None:
    if cls.node.type == "union_specifier":
        _never_known(run, made_object, cls, "a member of a union")
    for each in run.names.ancestry(cls):
        for name, member in each.fields.items():
            if not member.static:
                run.store.set((made_object, name), BOTTOM)


def construct_class(
    run: Machine, this: Obj, cls: Class, kind: Type, arguments: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Run the constructor of ``cls`` (a base or the class itself) on ``this``."""
    if frame.depth > MAX_DEPTH:
        run.gap(node, frame, f"the bases of {cls.name} are deeper than is followed")
        return
    this.bindings[cls] = run.names.bindings(cls, kind)
    own = run.names.find_methods(cls, cls.name) if cls.name in run.names.methods[cls] else []
    own = [each for each in own if arguments or not takes_another(each)]
    given_here = given_to(node, frame) if len(own) > 1 else []
    fitting = candidates(own, arguments, kinds_of(run, given_here, frame))
    if given_here and given_here[0].parent is not None and given_here[0].parent.type == "initializer_list":
        listed = [f for f in own if f.parameters and "initializer_list" in f.parameters[0].type]
        if listed:  # comes first, whatever else fits ([over.match.list])
            fitting = [listed[0], *(each for each in fitting if each is not listed[0])]
            arguments = [(Seq(tuple(arguments)),)]
    is_of_text = any(isinstance(atom, Text) for value in arguments for atom in value)
    if len(fitting) > 1 and (is_of_text or any(run.makes_interfaces(f) or _holds_text(f) for f in fitting)):
        run.gap(node, frame, f"which constructor of {cls.name} is meant here is not known")
    if arguments and given_in_braces(node, frame) and any(_takes_list(f) and f not in fitting for f in own):
        run.gap(node, frame, f"which constructor of {cls.name} is meant here is not known: one takes a list")
    constructor = next(iter(fitting), None)
    path = (*frame.path[-24:], (frame.file.file, node.start_byte))
    inner = run.frame(
        (cls, this, path), Frame(cls.file, cls.scope, None, this, this.bindings[cls], path=frame.path)
    )
    if constructor is not None:
        if constructor in run.active:
            run.gap(node, frame, f"the constructor of {cls.name} calls itself")
            return
        inner.function, inner.file, inner.scope = constructor, constructor.file, constructor.scope
        run.called.add(constructor)
        run.active.append(constructor)
    inner.depth = frame.depth + 1
    inner.path = path
    inner.conditions = run.conditions(node, frame)
    run.begin(inner)
    if constructor is not None:
        bind_parameters(run, constructor, arguments, inner)
    written = list(constructor.initialisers) if constructor else []
    given = {_member_name(name): value for name, value in written}
    delegate = next((value for name, value in written if _is_delegate(cls, name)), None)
    if delegate is not None:
        values = [run.evaluate(each, inner) for each in children(delegate)]
        construct_class(run, this, cls, kind, values, delegate, inner)
    else:
        _bases(run, this, cls, given, arguments, node, inner)
        _members(run, this, cls, given, inner)
    this.building, outside = cls, this.building
    if constructor is not None and constructor.body is not None and not run.left:
        outcome = run.execute(constructor.body, inner)
        run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
        run.left = not outcome & NEXT and not inner.exits
    this.building = outside
    if constructor is not None:
        _written_arguments(run, constructor, arguments, inner, node, frame)
    inner.active, inner.finished = False, not inner.captured
    if constructor is not None:
        run.active.pop()
    elif arguments and not this.data["members"] and not cls.inherits_constructors:
        this.data["arguments"] = list(arguments)  # closures among them may be called with it
        _made_unseen(run, this, cls, arguments, node, frame)


def _takes_list(constructor: Function) -> bool:
    return any("initializer_list" in each.type for each in constructor.parameters[:1])


def _holds_text(constructor: Function) -> bool:
    """Return whether there is a text behind the parameters of a constructor."""
    return '"' in text(constructor.node).partition(")")[2]


def _made_unseen(
    run: Machine, this: Obj, cls: Class, arguments: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Make an object though no constructor in reach takes these arguments: a copy, or one that is not known."""
    if cls.name in cls.declared:
        whom = f"the constructor of {cls.name}, whose source is not in reach"
        handed_over(run, whom, arguments, node, frame)
        run.calls.may_be_written(run, whom, arguments, given_to(node, frame), frame)
        if not is_harmless_class(cls.qualified):
            run.gap(node, frame, f"the source of the constructor of {cls.name} is not in reach")
    elif len(arguments) > 1 or not all(isinstance(atom, Obj | Unknown) for atom in arguments[0]):
        why = f"how {cls.name} is made of what it is given is not known"
        run.gap(node, frame, why)
        run.store.lose([(this, name) for each in run.names.ancestry(cls) for name in each.fields], why)


def _written_arguments(
    run: Machine, constructor: Function, arguments: Sequence[Value], inner: Frame, node: Node, frame: Frame
) -> None:
    """Add a gap if a constructor writes to a text or list of its caller through a reference; none of them is known."""
    for parameter, value in zip(constructor.parameters, arguments, strict=False):
        after = run.store.get((inner, parameter.name)) or BOTTOM
        changed = parameter.written_back and set(after) != set(value)
        if changed and any(isinstance(atom, Text | Seq | Map) for atom in (*value, *after)):
            why = f"what the constructor of {constructor.name} writes to its argument {parameter.name} is not followed"
            run.gap(node, frame, why)
            for each in given_to(node, frame) or [node]:
                forget(run, each, frame, why, told=False)


def _is_delegate(cls: Class, written: str) -> bool:
    """Return whether an initialiser names the class itself, not a base or member of the same last name."""
    plain = written.partition("<")[0]
    if plain.rpartition("::")[2] != cls.name or cls.name in cls.fields:
        return False
    same = [base for base in cls.bases if _member_name(base) == cls.name]
    return not same or ("::" in plain and not any(base.partition("<")[0].endswith(plain) for base in same))


def _member_name(name: str) -> str:
    return name.partition("<")[0].rpartition("::")[2]


def _bases(
    run: Machine, this: Obj, cls: Class, given: dict[str, Node], arguments: Sequence[Value], node: Node, inner: Frame
) -> None:  # fmt: skip
    for written in cls.bases:
        kind = run.names.resolve(written, cls.scope, cls.file, this.bindings.get(cls))
        where = given.get(_member_name(written)) or given.get(kind.last)
        where = where or _alias_initialiser(run, cls, kind, given, inner)
        if where is not None:
            run.handle(where, inner)
            values = [run.evaluate(each, inner) for each in children(where)]
        else:
            values = list(arguments) if cls.inherits_constructors else []
        base = run.class_of(kind, cls)
        if cls.virtual_base and ((where is not None and values) or base in this.bindings):
            run.gap(where or node, inner, f"{cls.name} has a virtual base: who makes it is not followed")
            for each in run.names.ancestry(base):
                _never_known(run, this, each, "a member of a virtual base")
        if base is not None and base is not cls:
            construct_class(run, this, base, kind, values, where or node, inner)
        else:
            frame = inner if where is not None else Frame(cls.file, cls.scope, path=inner.path)
            _foreign_base(run, this, cls, kind, values, where or node, frame)


def _alias_initialiser(
    run: Machine, cls: Class, kind: Type, given: dict[str, Node], inner: Frame
) -> Node | None:
    for name, where in given.items():
        if name not in cls.fields and run.type_of(name, inner).name == kind.name:
            return where
    return None


def _foreign_base(
    run: Machine, this: Obj, cls: Class, kind: Type, values: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Make a base whose source is not in reach: of a node, of a library that is known, or a gap."""
    this.foreign_base = kind.name
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        model(run, Call(node, frame, list(values), this.type.arguments, receiver=this))
    elif not is_harmless_class(kind.name):
        why = f"the base class {kind} of {cls.name} is not known: it may be a node or make interfaces"
        run.gap(cls.node if frame.file is cls.file else node, frame, why, this.node)
        handed_over(run, f"the constructor of {kind}", values, node, frame, ignore=this)


def _members(run: Machine, this: Obj, cls: Class, given: dict[str, Node], inner: Frame) -> None:
    known: Mapping[str, Value] = this.data.get("members", {})  # of an aggregate
    of_class = Frame(
        cls.file, cls.scope, None, this, inner.bindings, path=inner.path, conditions=inner.conditions, depth=inner.depth
    )  # fmt: skip
    for name, member in cls.fields.items():
        if member.static:
            continue
        kind = run.names.resolve(member.type, cls.scope, cls.file, this.bindings.get(cls))
        where, kind = given.get(name), kind._replace(pointer=member.pointer or kind.pointer)
        if name in known:
            found = known[name]
            if not kind.pointer:
                found = copied(run, found, member.node, inner, run.class_of(kind, cls))
        else:
            found = _member(
                run, member, kind, where or member.default, inner if where is not None else of_class
            )
        if member.pointer and "char" not in member.type:
            found = as_referred_to(found)
        elif any(isinstance(atom, int) for atom in found):
            found = as_type(kind.name, found)
        before = run.store.get((this, name)) or BOTTOM  # of a member that this one hides
        run.store.set((this, name), join(before, found))


def _member(run: Machine, member: Field, kind: Type, value: Node | None, frame: Frame) -> Value:
    """Return what a member holds at first: of its initialiser, else as it is declared."""
    if value is None:
        if kind.pointer:
            return BOTTOM
        return default_value(run, member.node, kind, replace(frame, path=(*frame.path, member.name)))
    run.handle(value, frame)
    if kind.pointer or (member.type == "auto" and value.type not in ("argument_list", "initializer_list")):
        return initial_value(run, value, frame, True)
    if value.type in ("argument_list", "initializer_list"):
        return made(run, value, kind, children(value), frame)
    return converted(run, kind, run.evaluate(value, frame), value, frame)


def bind_parameters(run: Machine, function: Function, arguments: Sequence[Value], inner: Frame) -> None:
    """Give each parameter its argument, a copy unless ``&`` or ``*``; else its default or an unknown."""
    inner.function = function
    for index, parameter in enumerate(function.parameters):
        if index < len(arguments):
            value = arguments[index]
            if function.variadic and index + 1 == len(function.parameters) < len(arguments):
                value = unknown("several arguments of a parameter pack")
            value = as_parameter(run, parameter, value, function.node, inner)
        else:
            value = unknown(f"the argument {parameter.name}")
            if parameter.default is not None:
                place = Frame(
                    function.file, function.scope, None, inner.this, inner.bindings, path=inner.path
                )
                value = run.evaluate(parameter.default, place)
        if parameter.name:
            run.local(inner, parameter.name, value, parameter.type)


def as_parameter(run: Machine, parameter: FunctionParameter, value: Value, node: Node, inner: Frame) -> Value:
    """Return an argument as its parameter has it: a number of its type, an object of its class unless it is a reference
    or pointer.
    """
    if "*" not in parameter.type and any(isinstance(atom, int) for atom in value):
        value = as_type(run.type_of(parameter.type, inner).name, value)
    if parameter.type.endswith("*") and len(value) == 1 and isinstance(value[0], Seq):
        items = value[0].items  # ``f({this})``
        return items[0] if len(items) == 1 and all(isinstance(atom, Obj) for atom in items[0]) else value
    if not parameter.type.endswith(("&", "*")) or _BINDS_A_NEW.search(parameter.type):
        place = replace(inner, path=(*inner.path, parameter.name))
        found = made_of(run, run.type_of(parameter.type, inner), value, node, place)
        if found is not None:
            return found
    if parameter.type.rstrip().endswith(("&", "*")) or _is_pointer_in(node, parameter.name):
        return value
    return copied(run, value, node, inner, _class_of_parameter(run, parameter, value, inner))


def _is_pointer_in(function: Node, name: str) -> bool:
    """Return whether the body uses a parameter as a pointer, whatever its template argument or ``auto`` is."""
    return re.search(rf"\b{name}\s*->", text(field_of(function, "body"))) is not None


def _class_of_parameter(
    run: Machine, parameter: FunctionParameter, value: Value, inner: Frame
) -> Class | None:
    """Return the class of a parameter that is an object, if an object is given."""
    if not any(isinstance(atom, Obj) and atom.cls is not None for atom in value):
        return None
    if inner.function is not None and not {*re.findall(r"\w+", parameter.type)}.isdisjoint(
        inner.function.templates
    ):
        body = text(inner.function.body)
        is_object = re.search(rf"\b{parameter.name}\s*\.\s*\w", body) is not None
        return next((atom.cls for atom in value if isinstance(atom, Obj)), None) if is_object else None
    kind = run.type_of(parameter.type, inner)
    return run.held_class(kind, inner)
