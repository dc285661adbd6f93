"""How an object of a class is made: its bases, its members in the order of their declaration, the body, as C++ does."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import LIBRARY_CLASSES, NODE_BASES, is_harmless_class
from nodl.infer.cpp.reading.known_headers import KNOWN_HEADERS, ROS_LIBRARIES
from nodl.infer.cpp.running.contents import copied, handed_over
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import MAX_DEPTH, MAX_RECURSION, NEXT, Machine
from nodl.infer.cpp.running.objects import MAPS, SEQUENCES, converted, default_value, initial_value, made
from nodl.infer.cpp.running.values import BOTTOM, Bound, Lambda, Map, Obj, Seq, Text, Value, unknown
from nodl.infer.cpp.syntax import children

if TYPE_CHECKING:
    from tree_sitter import Node

    from nodl.infer.cpp.reading.declarations import Class, Function, FunctionParameter
    from nodl.infer.cpp.reading.type_names import Type


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
    """An object of ``kind``: by its source, by the table of libraries, or one of which nothing is known."""
    cls = run.names.class_of(kind, frame.scope, frame.file)
    if cls is None and kind.name in SEQUENCES | MAPS and not arguments:
        run.handle(node, frame)
        return (Seq(()),) if kind.name in SEQUENCES else (Map(()),)
    key = ("object", frame.file.file, node.start_byte, node.end_byte, frame.path, kind)
    made_object = run.obj(key, kind, cls=cls, heap=heap)
    run.handle(node, frame)
    if cls is not None:
        made_object.data["members"] = members or {}
        _start_fields(run, made_object, cls)
        construct_class(run, made_object, cls, kind, arguments, node, frame)
        return (made_object,)
    if kind.name in ("std::thread", "std::jthread") and arguments:
        from nodl.infer.cpp.running.standard import STANDARD

        STANDARD[kind.name](run, arguments, node, frame, ())
    model = LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        found = model(run, made_object, list(arguments), node, frame)
        return (made_object,) if found is None else found
    if not is_harmless_class(kind.name):
        handed_over(run, f"the constructor of {kind.name}", arguments, node, frame)
        _unmodelled(run, kind, node, frame, heap or bool(arguments))
    made_object.data["arguments"] = list(arguments)
    return (made_object,)


_NUMBERS_ONLY = re.compile(
    r"\{(?:\s*(?:const |unsigned )*(?:double|float|int|bool|char|long|short|size_t|\w+_t)\b[^;{}()]*;)*\s*\}"
)
"""A structure without a name whose members are numbers or structures of C."""


def _unmodelled(run: Machine, kind: Type, node: Node, frame: Frame, deliberate: bool) -> None:
    """A class that is neither in reach nor in the table may be a node or make one.

    ``deliberate``: it is made with arguments or with new, as structures of C are not.
    """
    if kind.name.startswith("{"):
        if not _NUMBERS_ONLY.fullmatch(kind.name):
            run.gap(node, frame, "a structure without a name is made: its members may make interfaces")
        return
    if run.names.is_of_c(kind.name, frame.file):
        return
    first = kind.name.partition("::")[0]
    if first in KNOWN_HEADERS and not (deliberate and first in ROS_LIBRARIES):
        return
    if first in ROS_LIBRARIES:
        run.gap(
            node, frame, f"the class {kind.name} is not in the table of {first}: it may be a node or make one"
        )
        return
    header = run.names.foreign_header(kind.name, frame.file)
    if not header and deliberate and "::" not in kind.name:
        header = "no header in reach defines it"
    if header:
        run.gap(
            node, frame, f"the class {kind.name} is not in reach ({header}): it may be a node or make one"
        )


def _start_fields(run: Machine, made_object: Obj, cls: Class) -> None:
    for each in run.names.ancestry(cls):
        for name, member in each.fields.items():
            if not member.static:
                run.store.set((made_object, name), BOTTOM)


def construct_class(
    run: Machine, this: Obj, cls: Class, kind: Type, arguments: Sequence[Value], node: Node, frame: Frame
) -> None:
    """Run the constructor of ``cls`` (a base or the class itself) on ``this``."""
    bindings = dict(zip(cls.templates, kind.arguments, strict=False))
    for name, default in cls.template_defaults.items():
        bindings.setdefault(name, run.names.resolve(default, cls.scope, cls.file))
    this.bindings[cls] = bindings
    constructor = chosen(
        run.names.find_methods(cls, cls.name) if cls.name in run.names.methods[cls] else [], arguments
    )
    path = (*frame.path[-24:], (frame.file.file, node.start_byte))
    inner = run.frame((cls, this, path), class_frame(run, this, cls, frame))
    if constructor is not None:
        if run.active.count(constructor) > MAX_RECURSION or frame.depth > MAX_DEPTH:
            run.gap(node, frame, f"the constructor of {cls.name} calls itself")
            return
        inner.function, inner.file, inner.scope = constructor, constructor.file, constructor.scope
        run.called.add(constructor)
        run.active.append(constructor)
    inner.depth = frame.depth + 1
    inner.path, inner.active = path, True
    inner.conditions = run.conditions(node, frame)
    inner.mark = run.store.mark()
    if constructor is not None:
        bind_parameters(run, constructor, arguments, inner)
    written = list(constructor.initialisers) if constructor else []
    given = {_member_name(name): value for name, value in written}
    delegate = next((value for name, value in written if _is_delegate(run, cls, name, inner)), None)
    if delegate is not None:
        values = [run.evaluate(each, inner) for each in children(delegate)]
        construct_class(run, this, cls, kind, values, delegate, inner)
    else:
        _bases(run, this, cls, given, arguments, node, inner)
        _members(run, this, cls, given, node, inner)
    this.building, outside = cls, this.building
    if constructor is not None and constructor.body is not None:
        outcome = run.execute(constructor.body, inner)
        run.settle(inner.mark, inner.exits, bool(outcome & NEXT))
    this.building = outside
    inner.active, inner.finished = False, not inner.captured
    if constructor is not None:
        run.active.pop()
    elif arguments and cls.name in cls.declared:
        handed_over(
            run, f"the constructor of {cls.name}, whose source is not in reach", arguments, node, frame
        )
        run.gap(node, frame, f"the source of the constructor of {cls.name} is not in reach")


def _is_delegate(run: Machine, cls: Class, written: str, inner: Frame) -> bool:
    """Whether an initialiser names the class itself, not a base or member of the same last name."""
    plain = written.partition("<")[0]
    if plain.rpartition("::")[2] != cls.name or cls.name in cls.fields:
        return False
    same = [base for base in cls.bases if _member_name(base) == cls.name]
    return not same or ("::" in plain and not any(base.partition("<")[0].endswith(plain) for base in same))


def class_frame(run: Machine, this: Obj, cls: Class, frame: Frame) -> Frame:
    """The frame of a constructor of ``cls`` before its parameters: scope, template arguments, ``this``."""
    return Frame(cls.file, cls.scope, None, this, this.bindings.get(cls, {}), path=frame.path)


def _member_name(name: str) -> str:
    return name.partition("<")[0].rpartition("::")[2]


def _bases(
    run: Machine,
    this: Obj,
    cls: Class,
    given: dict[str, Node],
    arguments: Sequence[Value],
    node: Node,
    inner: Frame,
) -> None:
    for written in cls.bases:
        kind = run.names.resolve(written, cls.scope, cls.file, this.bindings.get(cls))
        name = _member_name(written)
        where = given.get(name) or given.get(kind.last) or _alias_initialiser(run, cls, kind, given, inner)
        if where is not None:
            run.handle(where, inner)
            values = [run.evaluate(each, inner) for each in children(where)]
        else:
            values = list(arguments) if cls.inherits_constructors else []
        base = run.names.class_of(kind, cls.scope, cls.file)
        if base is not None and base is not cls:
            construct_class(run, this, base, kind, values, where or node, inner)
        else:
            foreign_base(
                run,
                this,
                cls,
                kind,
                values,
                where or node,
                inner if where is not None else Frame(cls.file, cls.scope, path=inner.path),
            )


def _alias_initialiser(
    run: Machine, cls: Class, kind: Type, given: dict[str, Node], inner: Frame
) -> Node | None:
    for name, where in given.items():
        if name not in cls.fields and run.type_of(name, inner).name == kind.name:
            return where
    return None


def foreign_base(
    run: Machine, this: Obj, cls: Class, kind: Type, values: Sequence[Value], node: Node, frame: Frame
) -> None:
    """A base whose source is not in reach: of a node, of a library that is known, or a gap."""
    this.foreign_base = kind.name
    model = NODE_BASES.get(kind.name) or LIBRARY_CLASSES.get(kind.name)
    if model is not None:
        model(run, this, list(values), node, frame)
    elif not is_harmless_class(kind.name):
        place = frame if frame.file is not cls.file else Frame(cls.file, cls.scope)
        run.gap(
            node if frame.file is not cls.file else cls.node,
            place,
            f"the base class {kind} of {cls.name} is not known: it may be a node or make interfaces",
            this.node,
        )
        handed_over(run, f"the constructor of {kind}", values, node, frame, ignore=this)


def _members(run: Machine, this: Obj, cls: Class, given: dict[str, Node], node: Node, inner: Frame) -> None:
    known: Mapping[str, Value] = this.data.get("members", {})  # of an aggregate
    for name, member in cls.fields.items():
        if member.static:
            continue
        if name in known:
            run.store.set((this, name), known[name])
            continue
        where = given.get(name)
        frame = (
            inner
            if where is not None
            else Frame(
                cls.file,
                cls.scope,
                None,
                this,
                inner.bindings,
                path=inner.path,
                conditions=inner.conditions,
                depth=inner.depth,
            )
        )
        value = where if where is not None else member.default
        if value is not None:
            run.handle(value, frame)
        at = value if value is not None else member.node
        kind = run.names.resolve(member.type, cls.scope, cls.file, this.bindings.get(cls))
        pointer = member.pointer or kind.pointer
        if value is not None and not pointer and value.type in ("argument_list", "initializer_list"):
            found = made(run, at, kind, children(value), frame)
        elif value is not None and (pointer or member.type == "auto"):
            found = initial_value(run, value, frame, True)
        elif value is not None:
            found = converted(run, kind, run.evaluate(value, frame), at, frame)
        elif pointer:
            found = BOTTOM
        else:
            keyed = Frame(
                cls.file,
                cls.scope,
                None,
                this,
                inner.bindings,
                path=(*inner.path, name),
                depth=inner.depth,
                conditions=inner.conditions,
            )
            found = default_value(run, member.node, kind, keyed)
        run.store.set((this, name), found)


def chosen(functions: Sequence[Function], arguments: Sequence[Value]) -> Function | None:
    """The overload that takes so many arguments; of several, the one whose parameters look like them."""
    found = candidates(functions, arguments)
    return found[0] if found else None


MAX_OVERLOADS = 3


def candidates(functions: Sequence[Function], arguments: Sequence[Value]) -> Sequence[Function]:
    """The overloads that fit best: more than one where a text may be meant in several ways. Of arguments that are not
    known the first decides; the ledger asks about the others."""
    fitting = [each for each in functions if _takes(each, len(arguments))]
    if len(fitting) <= 1:
        return fitting or (functions if len(functions) == 1 else ())
    scores = [sum(map(_likeness, each.parameters, arguments)) for each in fitting]
    best = [each for each, score in zip(fitting, scores, strict=True) if score == max(scores)]
    is_text = any(isinstance(atom, Text) for value in arguments for atom in value)
    return best if is_text and len(best) <= MAX_OVERLOADS else best[:1]


def _takes(function: Function, count: int) -> bool:
    required = sum(1 for p in function.parameters if p.default is None and "..." not in p.type)
    return function.variadic or required <= count <= len(function.parameters)


def _likeness(parameter: FunctionParameter, value: Value) -> int:
    """How well an argument fits a parameter, by their looks."""
    atom = value[0] if value else None
    kind = parameter.type
    is_text = "string" in kind or "char" in kind
    is_generic = (
        re.fullmatch(r"(?:const )?[A-Z]\w*(?: ?[&*]+)?", kind) is not None and "Descriptor" not in kind
    )
    if isinstance(atom, Text):
        return 3 if is_text else (1 if is_generic else -3)
    if isinstance(atom, Obj):
        names = {atom.type.last, *(c.name for c in atom.bindings)}
        if atom.node is not None and ("Node" in kind or "node" in kind):
            return 3
        return (
            3 if any(name and name in kind for name in names) else (1 if is_generic else -3 if is_text else 0)
        )
    if isinstance(atom, bool):
        return 3 if "bool" in kind else (1 if is_generic else -2)
    if isinstance(atom, int | float):
        own = r"double|float" if isinstance(atom, float) else r"int|size_t|long"
        return 3 if re.search(own, kind) else 2 if _NUMBER.search(kind) else (1 if is_generic else -2)
    if isinstance(atom, Lambda | Bound):
        return 2 if "function" in kind or "allback" in kind else (1 if is_generic else -2)
    if isinstance(atom, Seq | Map):
        return 2 if re.search(r"vector|array|list|map|set", kind) else (1 if is_generic else -2)
    return 0


_NUMBER = re.compile(r"int|double|float|size_t|long")


def bind_parameters(run: Machine, function: Function, arguments: Sequence[Value], inner: Frame) -> None:
    """Each parameter gets its argument, a copy unless ``&`` or ``*``; else its default or an unknown."""
    inner.function = function
    for index, parameter in enumerate(function.parameters):
        if index < len(arguments):
            value = arguments[index]
            if function.variadic and index + 1 == len(function.parameters) < len(arguments):
                value = unknown("several arguments of a parameter pack")
            if not parameter.type.rstrip().endswith(("&", "*")):
                value = copied(run, value, function.node, inner)
        else:
            value = unknown(f"the argument {parameter.name}")
            if parameter.default is not None:
                place = Frame(
                    function.file, function.scope, None, inner.this, inner.bindings, path=inner.path
                )
                value = run.evaluate(parameter.default, place)
        if parameter.name:
            run.local(inner, parameter.name, value, parameter.type)
