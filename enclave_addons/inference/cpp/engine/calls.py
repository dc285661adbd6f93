"""Who is called: functions and methods of the program, models of libraries, the standard library, or unknown code."""

from __future__ import annotations

import re
from collections.abc import Sequence

from enclave_addons.inference.cpp.engine.expressions import functions_named, named
from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.invocation import call_methods, call_value
from enclave_addons.inference.cpp.engine.machine import Machine, expression
from enclave_addons.inference.cpp.engine.objects import (
    LISTS,
    MAPS,
    TEXTS,
    arguments,
    construct,
    library_call,
    made_of,
    unreached,
)
from enclave_addons.inference.cpp.engine.places import places_of, read, write, write_all
from enclave_addons.inference.cpp.engine.sites import CREATES
from enclave_addons.inference.cpp.engine.standard import function_of_standard, method_of_standard
from enclave_addons.inference.cpp.engine.values import (
    BOTTOM,
    NULL,
    Atom,
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Pointer,
    Seq,
    Text,
    Unknown,
    Value,
    join,
    nodes_in,
    unknown,
)
from enclave_addons.inference.cpp.libraries import (
    IN_PLACE_OF_SOURCE,
    LIBRARY_CLASSES,
    LIBRARY_FUNCTIONS,
    LIBRARY_METHODS,
    NODE_METHODS,
    is_harmless_class,
    is_harmless_function,
)
from enclave_addons.inference.cpp.reading.declarations import Function
from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.syntax import (
    Node,
    callee_name,
    field_of,
    template_arguments,
    text,
    unwrapped,
)

_MAKE = re.compile(r"(?:std::|boost::)?(?:make_shared|make_unique|allocate_shared)|std::make_optional")
_CASTS = frozenset({"static_cast", "dynamic_cast", "const_cast", "reinterpret_cast"})
_POINTER_CASTS = re.compile(
    r"(?:std::|boost::)?(?:static|dynamic|const)_pointer_cast|std::(?:move|forward|ref|cref|as_const|any_cast)"
)
_TAKES_NODE = re.compile(r"(?:add|remove)_node|spin\w*|get_node_\w+_interface")
"""Methods of executors, which make nothing on a node that they get."""
_SAME = frozenset({"get", "lock", "shared_from_this", "value", "operator->"})


@expression("call_expression")
def _call(run: Machine, node: Node, frame: Frame) -> Value:
    function = unwrapped(field_of(node, "function"))
    if function is None:
        return unknown("a call")
    types = [run.type_of(text(each), frame) for each in template_arguments(function)]
    if function.type == "field_expression":
        return _method(run, node, function, types, frame)
    name = callee_name(function)
    given = arguments(field_of(node, "arguments"))
    if function.type in ("primitive_type", "sized_type_specifier"):
        return run.evaluate(given[0], frame) if given else (0,)
    if name in _CASTS:
        return run.evaluate(given[0] if given else None, frame)
    if name in ("bind", "std::bind", "boost::bind", "std::bind_front"):
        return _bind(run, given, node, frame)
    values = spread(run, given, frame)
    if _MAKE.fullmatch(name) and types:
        if name.endswith("allocate_shared"):
            values, given = values[1:], given[1:]
        return _made_shared(run, types[0], values, node, frame, given)
    if _POINTER_CASTS.fullmatch(name):
        return values[0] if values else BOTTOM
    return _named(run, function, name, types, values, given, node, frame)


def spread(run: Machine, given: Sequence[Node], frame: Frame) -> list[Value]:
    """Return the values of arguments; a pack stands for all of its own."""
    found: list[Value] = []
    for each in given:
        value = run.evaluate(each, frame)
        packs = [atom for atom in value if isinstance(atom, Group)]
        if each.type == "parameter_pack_expansion" and len(packs) == 1 == len(value):
            found += packs[0].items
        else:
            found.append(value)
    return found


def _made_shared(
    run: Machine, kind: Type, values: Sequence[Value], node: Node, frame: Frame, given: Sequence[Node]
) -> Value:
    kind = kind._replace(pointer=False)
    if kind.name in LISTS | MAPS | TEXTS:
        return made_of(run, kind, values, given, node, frame, braces=False)
    return construct(run, kind, values, node, frame, heap=True, given=given)


def _named(
    run: Machine, function: Node, name: str, types: Sequence[Type], values: list[Value], given: Sequence[Node],
    node: Node, frame: Frame,
) -> Value:  # fmt: skip
    """Call what a name means that stands alone or behind namespaces and classes."""
    head, _, last = name.rpartition("::")
    if function.type not in ("identifier", "qualified_identifier", "template_function"):
        found = call_value(run, run.evaluate(function, frame), values, node, frame, given)
        return found if found is not None else _unknown(run, name[:60], values, node, given, frame)
    if not head and (variable := frame.variables.get(name)) is not None:
        found = call_value(run, read(run, variable.place), values, node, frame, given)
        if found is not None:
            return found
    if last in ("shared_from_this", "weak_from_this") and frame.this is not None:
        return (frame.this,)
    model = _in_place_of_source(run, name, types, values, given, node, frame)
    if model is not None:
        return model
    if last in ("make_shared", "make_unique") and head and head not in ("std", "boost"):
        return construct(run, run.type_of(head, frame), values, node, frame, heap=True, given=given)
    functions = [f for f in functions_named(run, name, frame) if f.body is not None]
    if functions:
        this = frame.this
        is_method = bool(functions[0].owner) and not functions[0].static
        return call_methods(run, functions, this if is_method else None, values, node, frame, types, given)
    kind = run.type_of(text(function), frame)
    if kind.pointer:
        return values[0] if values else (NULL,)
    if run.class_of(kind, frame) is not None or kind.name in LIBRARY_CLASSES:
        return construct(run, kind, values, node, frame, given=given)
    if kind.name in TEXTS | LISTS | MAPS or kind.name in ("std::pair", "std::tuple", "std::function"):
        run.handle(node, frame)
        return made_of(run, kind, values, given, node, frame, braces=False)
    member = named(run, name, frame) if not head else BOTTOM
    found = call_value(run, member, values, node, frame, given)
    if found is not None:
        return found
    resolved = _resolved(run, name, frame)
    if frame.this is not None and (not head or resolved == f"{frame.this.foreign_base}::{last}"):
        found = _of_base(run, frame.this, last, types, values, given, node, frame)
        if found is not None:
            return found
    for each in dict.fromkeys((name, resolved)):
        if each in LIBRARY_FUNCTIONS:
            run.handle(node, frame)
            return LIBRARY_FUNCTIONS[each](run, library_call(node, frame, values, types, given, None))
    standard = function_of_standard(run, resolved, values, given, node, frame)
    if standard is not None:
        return standard
    return _unknown(run, resolved, values, node, given, frame)


def _resolved(run: Machine, name: str, frame: Frame) -> str:
    """Return the whole name of a function of a library, by namespace aliases and ``using``."""
    head, _, last = name.rpartition("::")
    if head:
        return f"{run.type_of(head, frame).name}::{last}"
    alias = run.names.alias(name, frame.scope, frame.file)
    if alias is not None:
        return alias.target.lstrip(":")
    for space in run.names.used_namespaces(frame.file.file):
        if f"{space}::{name}" in LIBRARY_FUNCTIONS or space == "std":
            return f"{space}::{name}"
    return name


def _in_place_of_source(
    run: Machine, name: str, types: Sequence[Type], values: Sequence[Value], given: Sequence[Node], node: Node,
    frame: Frame,
) -> Value | None:  # fmt: skip
    last = name.rpartition("::")[2]
    for whole in (
        name,
        *(f"{f.qualified}" for f in run.names.find_functions(name, frame.scope, frame.file)[:1]),
    ):
        model = IN_PLACE_OF_SOURCE.get(whole)
        if model is not None:
            run.handle(node, frame)
            return model(run, library_call(node, frame, values, types, given, None))
    if frame.this is not None and frame.this.node is not None:
        for cls in run.names.ancestry(frame.this.cls):
            model = IN_PLACE_OF_SOURCE.get(f"{cls.qualified}::{last}")
            if model is not None:
                run.handle(node, frame)
                return model(run, library_call(node, frame, values, types, given, frame.this))
    return None


def _bind(run: Machine, given: Sequence[Node], node: Node, frame: Frame) -> Value:
    """Return a function with the arguments that ``std::bind`` binds to it; placeholders are not known."""
    if not given:
        return BOTTOM
    functions = run.evaluate(given[0], frame)
    rest = []
    for each in given[1:]:
        is_placeholder = re.fullmatch(r"(?:std::placeholders::|placeholders::)?_\d", text(each))
        rest.append(unknown("an argument of a callback") if is_placeholder else run.evaluate(each, frame))
    found: list[Value] = []
    for atom in functions:
        if isinstance(atom, Bound):
            objects = [a for a in rest[0] if isinstance(a, Obj)] if rest else []
            is_method = bool(atom.function.owner) and not atom.function.static
            if is_method and objects:
                found += [(Bound(_overriding(run, atom, each), each, tuple(rest[1:])),) for each in objects]
            else:
                found.append((Bound(atom.function, atom.this, tuple(rest)),))
        else:
            found.append((atom,))
    if len(functions) > 1 and all(isinstance(atom, Bound) for atom in functions):
        count = len(rest) - 1
        fitting = [f for f in found if len(f[0].function.parameters) == count]
        found = fitting or found
    return join(*found)


def _overriding(run: Machine, atom: Bound, obj: Obj) -> Function:
    """Return the method of an object that stands for a virtual one of its base."""
    if not atom.function.virtual:
        return atom.function
    found = run.names.find_methods(obj.cls, atom.function.name)
    same = [each for each in found if len(each.parameters) == len(atom.function.parameters)]
    return same[0] if same else atom.function


# --- methods ------------------------------------------------------------------------------------------------------


def _method(run: Machine, node: Node, function: Node, types: Sequence[Type], frame: Frame) -> Value:
    base = field_of(function, "argument")
    receivers = run.evaluate(base, frame)
    field = field_of(function, "field")
    name = callee_name(field) if field is not None else ""
    qualifier, _, name = name.rpartition("::")
    given = arguments(field_of(node, "arguments"))
    values = spread(run, given, frame)
    if not receivers:
        run.lost(function, frame)
        run.later(values)
        return unknown(f"the result of {name}() of something that is not set")
    if name == "swap" and len(given) == 1:
        write_all(run, places_of(run, base, frame), values[0])
        write_all(run, places_of(run, given[0], frame), receivers)
        return BOTTOM

    def one(atom: Atom) -> Value:
        return _method_of(run, atom, qualifier, name, types, values, given, node, base, frame)

    useful = [atom for atom in receivers if atom != NULL] or list(receivers)
    return run.each_way(one, useful[:16])


def _method_of(
    run: Machine, atom: Atom, qualifier: str, name: str, types: Sequence[Type], values: list[Value],
    given: Sequence[Node], node: Node, base: Node | None, frame: Frame,
) -> Value:  # fmt: skip
    if isinstance(atom, Pointer):
        held = read(run, atom.place)
        if len(held) == 1 and not isinstance(held[0], Pointer):
            atom = held[0]
    if isinstance(atom, Obj):
        return _method_of_object(run, atom, qualifier, name, types, values, given, node, base, frame)
    if isinstance(atom, Lambda | Bound) and name in ("operator()", "target"):
        return call_value(run, (atom,), values, node, frame, given) or BOTTOM
    found = method_of_standard(run, atom, name, values, given, node, base, frame)
    if found is not None:
        return found
    if atom == NULL:
        return _on_nothing(run, name, values, node, base, frame)
    return _on_unknown(run, atom, name, values, node, given, base, frame)


def _method_of_object(
    run: Machine, this: Obj, qualifier: str, name: str, types: Sequence[Type], values: list[Value],
    given: Sequence[Node], node: Node, base: Node | None, frame: Frame,
) -> Value:  # fmt: skip
    cls = run.class_of(run.type_of(qualifier, frame), frame) if qualifier else this.cls
    for each in run.names.ancestry(cls):
        model = IN_PLACE_OF_SOURCE.get(f"{each.qualified}::{name}")
        if model is not None and this.node is not None:
            found = model(run, library_call(node, frame, values, types, given, this))
            if found is not None:
                run.handle(node, frame)
                return found
    methods = [f for f in run.names.find_methods(cls, name) if f.body is not None]
    if methods:
        return call_methods(run, methods, this, values, node, frame, types, given)
    if (
        name in ("get", "lock", "operator->")
        and not values
        and (this.cls is not None or this.node is not None)
    ):
        return (this,)
    if name == "reset":
        return _reset(run, values, base, frame)
    member = run.store.get((this, name))
    called = call_value(run, member, values, node, frame, given) if member else None
    if called is not None:
        return called
    found = _of_base(run, this, name, types, values, given, node, frame)
    if found is not None:
        return found
    if this.cls is not None and run.names.declarations(this.cls, name):
        return _without_source(run, this, name, values, node, frame)
    if name in _SAME and not values:
        return (this,)
    owner = f"{this.type.name}::{name}"
    modelled = this.type.name in LIBRARY_CLASSES or this.foreign_base in LIBRARY_CLASSES
    known = (modelled and not this.is_node) or _TAKES_NODE.fullmatch(name) is not None
    known = known or is_harmless_class(this.type.name) or is_harmless_function(owner)
    if known or _is_of_qt(run, this):
        run.handle(node, frame)
        run.later(values)
        return unknown(f"the result of {name}()")
    return _unknown(run, owner, values, node, given, frame, this)


def _reset(run: Machine, values: Sequence[Value], base: Node | None, frame: Frame) -> Value:
    for place in places_of(run, base, frame):
        write(run, place, values[0] if values else (NULL,))
    return BOTTOM


def _of_base(
    run: Machine, this: Obj, name: str, types: Sequence[Type], values: Sequence[Value], given: Sequence[Node],
    node: Node, frame: Frame,
) -> Value | None:  # fmt: skip
    """Call the model of a method that the object has from a library."""
    call = library_call(node, frame, values, types, given, this)
    for cls in dict.fromkeys((this.type.name, this.foreign_base)):
        if (cls, name) in LIBRARY_METHODS:
            run.handle(node, frame)
            return LIBRARY_METHODS[cls, name](run, call)
    if this.node is not None and name in NODE_METHODS:
        run.handle(node, frame)
        return NODE_METHODS[name](run, call)
    return None


def _without_source(
    run: Machine, this: Obj, name: str, values: Sequence[Value], node: Node, frame: Frame
) -> Value:
    """Call a method that is declared in a header in reach, and defined where it cannot be seen."""
    record = this.node or next((o.node for v in values for o in nodes_in(v)), None)
    if record is None:
        held = [run.store.get((this, f)) for cls in run.names.ancestry(this.cls) for f in cls.fields]
        record = next((o.node for v in held for o in nodes_in(v)), None)
    virtual = any(each.virtual and each.body is None for each in run.names.declarations(this.cls, name))
    if (record is not None and not virtual) or CREATES.fullmatch(name):
        run.gap(node, frame, f"the source of {name}() is not in reach; it may make interfaces", record)
    run.handle(node, frame)
    run.later(values)
    return unknown(f"the result of {name}()")


def _is_of_qt(run: Machine, this: Obj) -> bool:
    bases = (base for cls in run.names.ancestry(this.cls) for base in cls.bases)
    return any(re.fullmatch(r"Q[A-Z]\w*", base.rpartition("::")[2]) for base in bases)


def _on_nothing(
    run: Machine, name: str, values: Sequence[Value], node: Node, base: Node | None, frame: Frame
) -> Value:
    """Call a method of a pointer that is not set yet: a callback may set it."""
    run.unset.setdefault(
        (frame.file.file, node.start_byte), (run.place(node, frame), " ".join(text(base).split())[:40], name)
    )
    run.later(values)
    return BOTTOM


def _on_unknown(
    run: Machine, atom: Atom, name: str, values: Sequence[Value], node: Node, given: Sequence[Node],
    base: Node | None, frame: Frame,
) -> Value:  # fmt: skip
    """Call a method of a value that is not known."""
    why = atom.why if isinstance(atom, Unknown) else "a value"
    if _TAKES_NODE.fullmatch(name):
        return unknown(f"the result of {name}()")
    if CREATES.fullmatch(name) and isinstance(atom, Unknown):
        run.handle(node, frame)
        owner = next((each for value in values for each in nodes_in(value)), None)
        whose = " ".join(text(base).split())[:40]
        record = owner.node if owner else None
        run.gap(node, frame, f"{name}() of {whose} may make an interface; whose is not known", record)
        run.later(values)
        return unknown(f"the result of {name}()")
    if isinstance(atom, Unknown):
        run.unresolved.setdefault(name, run.place(node, frame))
    if why.startswith("the plugin"):  # which has a gap
        run.later(values)
        return unknown(why)
    unknown_callee(run, f"{name}()", values, node, given, frame)
    return unknown(why if name in ("get", "value", "c_str", "str", "lock") else f"the result of {name}()")


# --- what is not known --------------------------------------------------------------------------------------------


def _unknown(
    run: Machine, name: str, values: Sequence[Value], node: Node, given: Sequence[Node], frame: Frame,
    this: Obj | None = None,
) -> Value:  # fmt: skip
    """Call a function of a library that is not modelled."""
    last = name.rpartition("::")[2]
    head = name.rpartition("::")[0]
    harmless = is_harmless_function(name) or ("::" in head and is_harmless_class(head))
    if harmless:
        run.handle(node, frame)
        run.later(values)
        return unknown(f"the result of {last}()")
    if CREATES.fullmatch(last) and (this is None or this.node is not None or this.cls is None):
        run.handle(node, frame)
        run.gap(
            node, frame, f"{name}() may make an interface; whose is not known", this.node if this else None
        )
    run.unresolved.setdefault(last, run.place(node, frame))
    unknown_callee(run, f"{name}()", values, node, given, frame)
    return unknown(f"the result of {last}()")


def unknown_callee(
    run: Machine, name: str, values: Sequence[Value], node: Node, given: Sequence[Node], frame: Frame
) -> None:
    """Note that unknown code gets these values: a node among them is a gap, a variable may be written."""
    unreached(run, name, values, node, frame)
    for each in given:
        inner = unwrapped(each)
        is_address = inner is not None and inner.type == "pointer_expression" and text(inner).startswith("&")
        target = unwrapped(field_of(inner, "argument")) if is_address else inner
        if target is None or target.type not in ("identifier", "field_expression"):
            continue
        variable = frame.variables.get(text(target))
        if variable is not None and "const" in variable.type.split():
            continue
        for place in places_of(run, target, frame):
            held = read(run, place)
            if any(isinstance(atom, Text | Seq | Map | int | float) for atom in held) and not is_address:
                continue  # most functions of libraries take texts by value
            if any(isinstance(atom, Text | Seq | Map | Param | int | float) for atom in held):
                write(run, place, join(held, unknown(f"what {name} may have written")))


def handed_over(run: Machine, whom: str, values: Sequence[Value], node: Node, frame: Frame) -> None:
    """Note that unknown code gets these values."""
    unknown_callee(run, whom, values, node, (), frame)
