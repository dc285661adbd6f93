"""The type that an expression has at compile time, and the class in which a member or method is looked up.

A member that a derived class hides shares its cell with the hidden one; where a text could be mistaken that is a gap.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from enclave_addons.inference.cpp.reading.declarations import Class, Function, type_text
from enclave_addons.inference.cpp.reading.names import hidden
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.machine import Frame, Machine
from enclave_addons.inference.cpp.running.overloads import as_number
from enclave_addons.inference.cpp.running.values import Obj, Param, Value, lost, unknown
from enclave_addons.inference.cpp.syntax import (
    Node,
    callee_name,
    children,
    field_of,
    last_name,
    parse_expression,
    template_arguments,
    text,
    unwrapped,
)


def check_hidden(run: Machine, this: Obj, cls: Class, node: Node, frame: Frame) -> None:
    """Add a gap if ``this`` has two plain members, or operators that matter, of one name: they are not distinguished,
    and what such a member holds is not known.
    """
    ancestry = run.names.ancestry(cls)
    for name in hidden(run.names, cls):
        plain = any(_PLAIN.search(each.fields[name].type) for each in ancestry if name in each.fields)
        if plain or (name.startswith("operator") and _methods_matter(run, cls, name)):
            why = f"{cls.name} hides {name} of a base: which of them is meant is not followed"
            run.gap(node, frame, why)
            run.store.share_cell((this, name), partial(lost, why=why))


def _methods_matter(run: Machine, cls: Class, name: str) -> bool:
    ancestry = run.names.ancestry(cls)
    kept = {field for each in ancestry for field in each.fields}
    return any(
        run.makes_interfaces(each) or "string" in type_text(each.node) or writes_of(each.node) & kept
        for owner in ancestry
        for each in run.names.methods[owner].get(name, ())
    )


def methods_meant(
    run: Machine, cls: Class, name: str, receiver: Node | None, call: Node, frame: Frame
) -> list[Function]:
    """Return what ``name()`` calls on an object of ``cls``.

    Of a method that hides a base's that of the class that the receiver has at compile time; if that is not known, each
    that it may be, with a gap. ``receiver``: ``None`` inside of a class.
    """
    unlike = name in run.names.unlike(cls)
    if name not in hidden(run.names, cls) and not unlike:
        return run.names.find_methods(cls, name)
    is_own = receiver is None or receiver.type == "this"
    seen = class_around(run, frame) if is_own else seen_class(run, receiver, frame)
    ancestry = run.names.ancestry(cls)
    virtual = any(each.virtual for owner in ancestry for each in run.names.methods[owner].get(name, ()))
    if seen in ancestry and seen is not None and not virtual:
        return run.names.find_methods(seen, name)
    found = (
        _last_overriders(run, cls, seen, name) if unlike and seen is not None and seen in ancestry else None
    )
    if found is not None:
        return found
    if not _methods_matter(run, cls, name):
        return run.names.find_methods(cls, name)
    run.gap(call, frame, f"{cls.name} hides {name} of a base: which of them is called is not known")
    return [each for owner in ancestry for each in run.names.methods[owner].get(name, ())]


def _last_overriders(run: Machine, cls: Class, seen: Class, name: str) -> list[Function] | None:
    """Return what the methods of ``seen`` are in an object of ``cls``; ``None`` if what overrides them is not known."""
    found: list[Function] = []
    for method in run.names.find_methods(seen, name):
        last = method
        for each in run.names.ancestry(cls) if method.virtual else ():
            if each is seen or seen not in run.names.ancestry(each):
                continue
            told = {f: run.names.overrides(f, method) for f in run.names.methods.get(each, {}).get(name, ())}
            if True in told.values():
                last = next(f for f, overrides in told.items() if overrides)
                break
            if None in told.values():
                return None
        found.append(last)
    return found


def class_around(run: Machine, frame: Frame) -> Class | None:
    """Return the class whose method the code is, by what it says; ``None`` for any other code."""
    owner = frame.function.owner if frame.function is not None else ""
    return run.names.find_class(owner, frame.scope, frame.file) if owner else None


def classes_around(run: Machine, frame: Frame) -> Iterator[Class]:
    """Yield the classes in whose scope the code is, the innermost first."""
    for depth in range(len(frame.scope), 0, -1):
        cls = run.names.find_class("::".join(frame.scope[:depth]), (), frame.file)
        if cls is not None:
            yield cls


def class_of_member(run: Machine, atom: Obj, access: Node, frame: Frame) -> Class | None:
    """Return the class in which ``x.name``, ``x->name`` or ``x.Base::name`` is looked up where ``x`` is ``atom``."""
    head = text(field_of(access, "field")).rpartition("::")[0]
    named = run.class_of(run.type_of(head, frame), frame) if head else None
    return next(
        (c for c in run.names.ancestry(atom.cls) if head and (c is named or c.name == head)), atom.cls
    )


def current_object(frame: Frame | None) -> Obj | None:
    """Return what ``this`` is, in a lambda that of the function around it; ``None`` outside of methods."""
    while frame is not None:
        if frame.this is not None:
            return frame.this
        frame = frame.outer
    return None


def static_by_name(run: Machine, name: str, frame: Frame) -> tuple[Class, str] | None:
    """Return the class that ``Foo::x`` is a static member of.

    Of ``x`` alone, if a class has one outside of its methods.
    """
    head, separator, last = name.rpartition("::")
    if separator:
        around: Iterable[Class | None] = [run.class_of(run.type_of(head, frame), frame)]
    else:
        around = classes_around(run, frame)
    for each in (base for cls in around for base in run.names.ancestry(cls)):
        if last in each.fields and each.fields[last].static:
            return each, last
    return None


def declared_type(run: Machine, node: Node, frame: Frame) -> tuple[Type, bool]:
    """Return the declared type of a variable or member, ``NO_TYPE`` if not known.

    And whether it is a pointer, or as a local variable a reference.
    """
    name, this = text(node).removeprefix("this->"), current_object(frame)
    owner = frame.owner_of(name)
    if owner is not None:
        written = owner.types.get(name, "")
        kind = run.type_of(written, owner)
        return kind, kind.pointer or written.endswith(("&", "*"))
    ancestry, bindings = (run.names.ancestry(this.cls), this.bindings) if this is not None else ([], {})
    for each in ancestry:
        if name in each.fields:
            found = each.fields[name]
            kind = run.names.resolve(found.type, each.scope, each.file, bindings.get(each))
            return kind, found.pointer or kind.pointer
    outside = run.names.find_global(name, frame.scope, frame.file)
    if outside is None:
        return NO_TYPE, False
    kind = run.names.resolve(outside.type, outside.scope, outside.file)
    return kind, outside.pointer or kind.pointer


def given_to(call: Node, frame: Frame) -> list[Node]:
    """Return the arguments of a call or an object's declaration as they are written."""
    return children(_given(call, frame))


def given_in_braces(call: Node, frame: Frame) -> bool:
    """Return whether the arguments of an object's declaration stand in braces."""
    given = _given(call, frame)
    return given is not None and given.type == "initializer_list"


def _given(call: Node, frame: Frame) -> Node | None:
    if call.type == "declaration":
        made = [each for each in children(call) if each.type.endswith("declarator")]
        if len(made) > 1:  # the path ends in the name of the variable that is made
            made = [each for each in made if text(field_of(each, "declarator")) in frame.path[-1:]]
        if made and made[0].type == "function_declarator":  # ``Foo f(a);``
            return field_of(parse_expression(f"f{text(field_of(made[0], 'parameters'))}"), "arguments")
        return field_of(made[0], "value") if made else None
    if call.type == "field_initializer":
        return call.named_children[-1]
    if call.type == "compound_literal_expression":
        return field_of(call, "value")
    return call if call.type in ("argument_list", "initializer_list") else field_of(call, "arguments")


def is_pointer(run: Machine, node: Node, frame: Frame) -> bool:
    """Return whether a variable or member was declared as a pointer, and not as a reference."""
    kind, marked = declared_type(run, node, frame)
    return kind.pointer or (marked and not _is_reference(run, node, frame))


def is_address(run: Machine, node: Node, frame: Frame) -> bool:
    """Return whether a variable, member or element is a pointer: other than an optional it holds no object itself."""
    written = _written_type(run, node, frame)
    return seen_type(run, node, frame).pointer and "optional" not in written and "&" not in written


def _written_type(run: Machine, node: Node, frame: Frame) -> str:
    """Return how a variable or member is declared; empty for anything else."""
    name = text(field_of(node, "field") or node)
    holder = frame.owner_of(name) if node.type == "identifier" else None
    if holder is not None:
        return holder.types.get(name, "")
    this = current_object(frame)
    around = this.cls if this is not None else None
    argument = field_of(node, "argument") if node.type == "field_expression" else None
    cls = around if argument is None or argument.type == "this" else seen_class(run, argument, frame)
    field = next((each.fields[name] for each in run.names.ancestry(cls) if name in each.fields), None)
    outside = run.names.find_global(name, frame.scope, frame.file) if field is None else None
    return text(field.node if field is not None else outside.node if outside is not None else None)


def _is_reference(run: Machine, node: Node, frame: Frame) -> bool:
    name, this = text(node), current_object(frame)
    owner = frame.owner_of(name)
    if owner is not None:
        return owner.types.get(name, "").endswith("&")
    ancestry = run.names.ancestry(this.cls) if this is not None else []
    declared = next((cls.fields[name].node for cls in ancestry if name in cls.fields), None)
    return "&" in text(declared).partition("=")[0]


def seen_class(run: Machine, node: Node | None, frame: Frame) -> Class | None:
    """Return the class that an expression has, or points to, at compile time; ``None`` if that is not known."""
    kind = seen_type(run, node, frame)
    return run.class_of(kind, frame) if kind.name else None


def seen_type(run: Machine, node: Node | None, frame: Frame) -> Type:
    """Return the type of a variable, a member, an element or a call; ``NO_TYPE`` for all else."""
    node = unwrapped(node)
    if node is None:
        return NO_TYPE
    if node.type == "pointer_expression":
        return seen_type(run, field_of(node, "argument"), frame)
    if node.type == "subscript_expression":
        return element_type(seen_type(run, field_of(node, "argument"), frame))
    if node.type == "call_expression":
        return _of_call(run, node, frame)
    owner = field_of(node, "argument") if node.type == "field_expression" else None
    if owner is None or owner.type == "this":
        kind, holder = declared_type(run, node, frame)[0], frame.owner_of(text(node))
        initial = holder.initial.get(text(node)) if holder is not None and kind.name == "auto" else None
        if initial is None or holder is None:
            return kind
        around, shown = initial.parent, seen_type(run, initial, holder)
        is_item = around is not None and around.type == "for_range_loop"
        return element_type(shown) if is_item else shown
    name = text(field_of(node, "field"))
    for each in run.names.ancestry(seen_class(run, owner, frame)):
        if name in each.fields:
            kind = run.names.resolve(each.fields[name].type, each.scope, each.file)
            return kind._replace(pointer=kind.pointer or each.fields[name].pointer)
    return NO_TYPE


TEXTS = re.compile(r"^(?!const\b).*\bstring\b")
"""Types of text that a pointer or reference can write."""


def points_to_plain(run: Machine, node: Node, frame: Frame, what: re.Pattern[str]) -> bool:
    """Return whether an expression names a member that is a pointer or reference to a type like ``what``."""
    inner = unwrapped(node) or node
    owner = field_of(inner, "argument") if inner.type == "field_expression" else None
    if owner is None and (inner.type != "identifier" or frame.owner_of(text(inner)) is not None):
        return False
    this = current_object(frame)
    own = this.cls if this is not None else None
    cls = own if owner is None or owner.type == "this" else seen_class(run, owner, frame)
    name = text(field_of(inner, "field") or inner)
    field = next((each.fields[name] for each in run.names.ancestry(cls) if name in each.fields), None)
    return field is not None and field.pointer and what.search(field.type) is not None


def _of_call(run: Machine, node: Node, frame: Frame) -> Type:
    """Return the type of what is made, of an element, or of what the only function of that name gives."""
    callee = unwrapped(field_of(node, "function")) or node
    owner, name = field_of(callee, "argument"), callee_name(field_of(callee, "field") or callee)
    made = template_arguments(callee) if _MAKES.search(name) else []
    if made:
        return run.type_of(text(made[0]), frame)
    if owner is None:
        found = run.names.find_functions(name, frame.scope, frame.file)
        found = found or run.names.find_methods(class_around(run, frame), name)
    else:
        kind = seen_type(run, owner, frame)
        if name in GIVES_INNER | _GIVES_ELEMENT:
            return kind if name in GIVES_INNER else element_type(kind)
        found = run.names.find_methods(run.class_of(kind, frame) if kind.name else None, name)
    if len(found) != 1:
        return NO_TYPE
    return run.names.resolve(type_text(found[0].node), found[0].scope, found[0].file)


def element_type(kind: Type) -> Type:
    """Return the type of a container's elements, of a map that of its values."""
    return kind.arguments[-1] if kind.arguments and kind.last != "array" else (*kind.arguments, NO_TYPE)[0]


def tested(run: Machine, node: Node | None, value: Value, frame: Frame) -> Value:
    """Return what a condition tests: a number in an optional or behind a pointer does not say whether that is set."""
    is_number = _is_number(run, node, frame) if any(isinstance(a, int | Param) for a in value) else True
    may_be_set = any(
        is_number is False if isinstance(atom, Param) else isinstance(atom, int) and not (atom or is_number)
        for atom in value
    )
    return unknown("whether an optional or pointer is set") if may_be_set else value


def _is_number(run: Machine, node: Node | None, frame: Frame) -> bool | None:
    """Return whether an expression is a number itself, not an optional or pointer; ``None`` if that is not known."""
    node = unwrapped(node)
    kind = node.type if node is not None else ""
    if node is None:
        return None
    if kind in ("argument_list", "initializer_list", "comma_expression"):
        return _is_number(run, next(reversed(children(node)), None), frame)
    if kind in ("assignment_expression", "update_expression"):
        return _is_number(run, field_of(node, "left") or field_of(node, "argument"), frame)
    if kind == "conditional_expression":
        sides = [_is_number(run, field_of(node, each), frame) for each in ("consequence", "alternative")]
        return sides[0] if sides[0] == sides[1] else None
    if kind == "call_expression":
        return _gives_number(run, node, frame)
    if text(node).startswith("&"):
        return False
    if kind == "pointer_expression":
        return _is_number_type(run, seen_type(run, node, frame)._replace(pointer=False))
    if kind not in _VARIABLES:
        return True  # a literal, a comparison, a sum
    holder = frame.owner_of(text(node))
    written = holder.types.get(text(node), "") if holder is not None else ""
    initial = holder.initial.get(text(node)) if holder is not None else None
    if initial is not None and holder is not None and run.type_of(written, holder).name == "auto":
        is_item = initial.parent is not None and initial.parent.type == "for_range_loop"
        return None if is_item or "*" in written else _is_number(run, initial, holder)
    static = static_by_name(run, text(node), frame) if holder is None else None
    if static is not None:
        field = static[0].fields[static[1]]
        seen = run.names.resolve(field.type, static[0].scope, static[0].file)
        return _is_number_type(run, seen._replace(pointer=field.pointer or seen.pointer))
    return _is_number_type(run, seen_type(run, node, frame), _written_type(run, node, frame))


_VARIABLES = (
    "identifier", "field_identifier", "qualified_identifier", "field_expression", "subscript_expression",
)  # fmt: skip


def _is_number_type(run: Machine, kind: Type, written: str = "") -> bool | None:
    if kind.pointer and "atomic" not in written:
        return False
    return True if _NUMBER.fullmatch(kind.name) or kind.last in run.names.enums else None


_NUMBER = re.compile(
    r"bool|char|double|float|short|bit_field|(?:un)?signed(?: \w+)*|long(?: \w+)*|"
    r"(?:std::)?(?:u?int(?:_\w+)?(?:\d+_t)?|size_t|atomic_\w+)"
)


def _gives_number(run: Machine, call: Node, frame: Frame) -> bool | None:
    """Return ``_is_number`` of a call."""
    callee = unwrapped(field_of(call, "function")) or call
    name, owner = last_name(callee), field_of(callee, "argument")
    listed = run.names.functions_by_name.get(name, ())
    if name == "static_cast" or (not listed and _NUMBER.fullmatch(text(callee))):
        made = template_arguments(callee)
        return _is_number_type(run, run.type_of(text(made[0]), frame) if made else Type(name))
    if owner is not None and name in _GIVES_ELEMENT and not listed:
        return _is_number_type(run, _of_call(run, call, frame))
    if owner is not None and name == "value" and not listed:
        return _is_number_type(run, seen_type(run, owner, frame)._replace(pointer=False))
    if not listed:
        return True if owner is not None and _COUNTS.fullmatch(name) else None
    found = {
        _is_number_type(run, run.names.resolve(type_text(each.node), each.scope, each.file))
        if (field_of(each.node, "declarator") or each.node).type == "function_declarator"
        else None
        for each in listed
    }
    return found.pop() if len(found) == 1 else None


def kinds_of(run: Machine, given: Sequence[Node], frame: Frame) -> list[str]:
    """Return of each argument which kind of number it is, ``text`` of a text, empty if that is not known."""
    return [_kind_of(run, unwrapped(each), frame) for each in given]


def _kind_of(run: Machine, node: Node | None, frame: Frame) -> str:
    written, kind = text(node).lower(), node.type if node is not None else ""
    if node is None or kind == "char_literal":
        return "char" if written.startswith("'") else ""
    if kind in ("string_literal", "raw_string_literal", "concatenated_string"):
        return "text"
    if kind in ("true", "false"):
        return "bool"
    if kind == "number_literal":
        suffix = written[len(written.rstrip("ulz")) :]
        return _OF_SUFFIX.get("".join(sorted(suffix)), "") if written.rstrip("ulz").isdigit() else ""
    if kind == "unary_expression":
        inner = _kind_of(run, field_of(node, "argument"), frame)
        return "bool" if written.startswith("!") else inner if inner in ("int", "long") else ""
    if kind not in _VARIABLES and kind != "call_expression":
        return ""
    seen, callee = seen_type(run, node, frame), last_name(field_of(node, "function"))
    if kind == "call_expression" and not _gives_number(run, node, frame):
        return "" if callee in run.names.functions_by_name or _MAY_BE_LETTER.fullmatch(callee) else "text"
    return "text" if seen.last in ("string", "string_view") else "" if seen.pointer else as_number(seen.name)


_MAY_BE_LETTER = re.compile(
    r"at|front|back|get\w*|value\w*|to(?:lower|upper)|\w+_cast|exchange|m(?:in|ax)|move|forward"
)


_OF_SUFFIX = {"": "int", "u": "unsigned int", "l": "long", "lu": "unsigned long"}
_COUNTS = re.compile(r"empty|size|length|count|contains|has_value|value_or|compare|\w+s_with|r?find\w*")
GIVES_INNER = frozenset({"get", "lock", "value", "release"})
_MAKES = re.compile(r"(?:^|::)(?:make_(?:shared|unique)|\w+_cast)$")
_PLAIN = re.compile(
    r"\b(?:string\w*|char|u?int(?:\d+_t)?|bool|double|float|size_t|long|vector|map|array|list|set)\b"
)
_GIVES_ELEMENT = frozenset({"at", "front", "back", "top"})
