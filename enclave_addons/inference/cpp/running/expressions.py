"""What expressions are: literals, names, braces, lambdas, and operators on values. Calls have a module of their own."""

from __future__ import annotations

import re
from contextlib import suppress
from functools import partial

from enclave_addons.inference.cpp.reading.type_names import Type
from enclave_addons.inference.cpp.reading.writes import FILLS
from enclave_addons.inference.cpp.running.arithmetic import added, computed
from enclave_addons.inference.cpp.running.assignments import as_declared, assign
from enclave_addons.inference.cpp.running.constructors import cast, construct, initial_value, made, made_of
from enclave_addons.inference.cpp.running.contents import copied, elements_copied, items_of
from enclave_addons.inference.cpp.running.invocation import by_operator, pointed_to
from enclave_addons.inference.cpp.running.launch_values import decided, in_doubt, settled
from enclave_addons.inference.cpp.running.machine import NEXT, Frame, Machine, expression
from enclave_addons.inference.cpp.running.overloads import as_number
from enclave_addons.inference.cpp.running.references import (
    as_referred_to,
    forget_everything,
    is_plain,
    keep_reference,
)
from enclave_addons.inference.cpp.running.static_types import (
    class_of_member,
    current_object,
    declared_type,
    is_pointer,
    kinds_of,
    seen_type,
    tested,
)
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Bound,
    Group,
    Lambda,
    Map,
    Obj,
    Param,
    Seq,
    Unknown,
    Value,
    as_one_map,
    concatenated,
    has_text,
    join,
    join_in_doubt,
    literal,
    lost,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.running.variables import member, variable
from enclave_addons.inference.cpp.syntax import Node, children, field_of, text, unwrapped, walk

_ESCAPES = {"n": "\n", "t": "\t", "\\": "\\", '"': '"', "'": "'", "0": "\0", "r": "\r"}


@expression("string_literal")
def string_literal(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the text between the quotes with its escapes resolved; a prefix like ``u8`` is dropped."""
    whole = text(node)
    inner = whole[whole.find('"') + 1 : -1]
    found = re.sub(r"\\(x[0-9a-fA-F]+|[0-7]{1,3}|u[0-9a-fA-F]{4}|.)", lambda m: _escaped(m[1]), inner)
    return unknown("a text with a zero in it") if "\0" in found else literal(found)


def _escaped(written: str) -> str:
    if written[0] in "xu" and len(written) > 1:
        return chr(int(written[1:], 16))
    if written.isdigit() and written[0] in "01234567":
        return chr(int(written, 8))
    return _ESCAPES.get(written, written)


@expression("raw_string_literal")
def raw_string(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the text between the outer parentheses, backslashes as they are."""
    return literal(text(node).partition("(")[2].rpartition(")")[0])


@expression("concatenated_string")
def concatenated_string(run: Machine, node: Node, frame: Frame) -> Value:
    """Join adjacent literals to one text; a macro name between them may become an unknown part of it."""
    return concatenated(*(run.evaluate(child, frame) for child in children(node)))


@expression("user_defined_literal")
def user_defined(run: Machine, node: Node, frame: Frame) -> Value:
    """Return texts with the suffix ``s`` or ``sv``; any other suffix, such as ``ms``, makes an unknown."""
    inner = children(node)
    suffix = text(inner[-1]) if len(inner) > 1 else ""
    plain = suffix in ("s", "sv") and inner[0].type.endswith("string_literal")
    return run.evaluate(inner[0], frame) if plain else unknown(f"a literal with {suffix or 'a suffix'}")


@expression("char_literal")
def character(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the letter as a text, with simple escapes such as that for a newline resolved."""
    inner = text(node)[1:-1]
    return literal(_ESCAPES.get(inner[1:], inner[1:]) if inner.startswith("\\") else inner)


@expression("number_literal")
def number(run: Machine, node: Node, frame: Frame) -> Value:
    """Return an integer if the digits make one ([lex.icon]); fractions are not known."""
    digits = text(node).replace("'", "").lower().rstrip("ulz")
    octal = digits.isdigit() and digits.startswith("0")
    with suppress(ValueError):
        return (int(digits, 8 if octal else 0),)
    return unknown("a fraction")


@expression("true", "false")
def boolean(run: Machine, node: Node, frame: Frame) -> Value:
    """Return ``true`` and ``false`` as a Python ``bool``."""
    return (node.type == "true",)


@expression("null", "nullptr")
def null(run: Machine, node: Node, frame: Frame) -> Value:
    """Return no alternative at all: a null pointer adds nothing to what a variable may be."""
    return BOTTOM


@expression("this")
def this(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the object whose method runs; in a lambda that of the function around it; unknown outside of both."""
    owner: Frame | None = frame
    while owner is not None and owner.this is None:
        owner = owner.outer
    return (owner.this,) if owner is not None and owner.this is not None else unknown("this")


@expression("parenthesized_expression", "condition_clause", "dependent_name", "init_statement")
def inside(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate parentheses, a condition: the value of the expression in them."""
    return run.evaluate(unwrapped(node), frame)


@expression("fold_expression", "co_await_expression", "generic_expression")
def not_followed(run: Machine, node: Node, frame: Frame) -> Value:
    """Add a gap where what is not followed may make interfaces; what it may write is not known afterwards."""
    what = f"the C++ {node.type.replace('_', ' ')}"
    if run.subtree_matters(node) or b"=" in (node.text or b""):
        run.gap(node, frame, f"{what} is not followed; it may make interfaces, or write to their names")
    if any(each.type in _WRITES for each in walk(node)):
        forget_everything(run, f"what {what} may have written")
    return unknown(what)


_WRITES = frozenset({"call_expression", "assignment_expression", "update_expression", "ERROR"})


@expression("parameter_pack_expansion")
def expansion(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``args...``: the value of the expression before the dots."""
    return run.evaluate(node.named_children[0], frame)


@expression("comma_expression")
def comma(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate every operand from the left; the value is that of the last."""
    found = BOTTOM
    for child in children(node):
        found = run.evaluate(child, frame)
    return found


# --- names ----------------------------------------------------------------------------------------------------


@expression("identifier", "field_identifier", "namespace_identifier", "type_identifier")
def identifier(run: Machine, node: Node, frame: Frame) -> Value:
    """Look up a variable, member, constant or function; unknown if none of that name is in reach."""
    return variable(run, text(node), frame)


@expression("qualified_identifier")
def qualified(run: Machine, node: Node, frame: Frame) -> Value:
    """Look up, as ``identifier``, a name with ``::``, without blanks."""
    return variable(run, re.sub(r"\s+", "", text(node)), frame)


# --- what makes something ---------------------------------------------------------------------------------------


@expression("initializer_list")
def initializer_list(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate braces without a type: a list."""
    return (Seq(tuple(run.evaluate(child, frame) for child in children(node))),)


@expression("initializer_pair")
def initializer_pair(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the value of ``.field = value``; who fills an aggregate reads the field."""
    return run.evaluate(field_of(node, "value"), frame)


@expression("argument_list")
def argument_list(run: Machine, node: Node, frame: Frame) -> Value:
    """Return the value of a single argument; several, or none, make a ``Group``."""
    values = [run.evaluate(child, frame) for child in children(node)]
    return values[0] if len(values) == 1 else (Group(tuple(values)),)


@expression("compound_literal_expression")
def compound_literal(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``Foo{...}``: what the items in the braces make of the type."""
    kind = run.type_of(text(field_of(node, "type")), frame)
    return made(run, node, kind, children(field_of(node, "value")), frame)


@expression("new_expression")
def new(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``new Foo(...)``: what its constructor makes, on the heap, so that assigning it copies nothing."""
    kind = run.type_of(text(field_of(node, "type")), frame)
    given = children(field_of(node, "arguments"))
    values = [run.evaluate(child, frame) for child in given]
    several = field_of(node, "declarator") is not None
    if several and kind.name in ("unsigned char", "char", "double", "float", "int", "unsigned int", "bool"):
        return unknown("an array of numbers")
    run.repeated += several
    found = construct(run, kind._replace(pointer=False), values, node, frame, heap=True)
    run.repeated -= several
    return found


@expression(
    "delete_expression",
    "sizeof_expression",
    "alignof_expression",
    "offsetof_expression",
    "requires_expression",
)
def nothing_known(run: Machine, node: Node, frame: Frame) -> Value:
    """Gives an unknown and leaves the operands unevaluated."""
    return unknown("a computed value")


@expression("cast_expression")
def c_cast(run: Machine, node: Node, frame: Frame) -> Value:
    """Convert ``(T) x`` like ``static_cast<T>(x)``."""
    kind, given = run.type_of(text(field_of(node, "type")), frame), field_of(node, "value")
    value = run.evaluate(given, frame)
    is_object = not text(field_of(node, "type")).endswith(("*", "&"))
    made = made_of(run, kind, value, node, frame, True) if is_object else None
    if made is not None:
        return made
    return cast(run, kind, tested(run, given, value, frame) if kind.name == "bool" else value)


@expression("lambda_expression")
def lambda_(run: Machine, node: Node, frame: Frame) -> Value:
    """Capture by value what the variable holds now; the rest is looked up where the lambda was made."""
    inner = Frame(
        frame.file, frame.scope, frame.function, None, frame.bindings, frame, frame.path, run.conditions(node, frame),
        depth=frame.depth, captured=True,
    )  # fmt: skip
    inner = run.frame((node.id, frame, frame.path), inner)
    this = current_object(frame)
    if this is not None and re.search(r"\*\s*this\b", text(field_of(node, "captures"))):
        (inner.this,) = copied(run, (this,), node, frame, this.cls)
    is_mutable = re.search(r"\)\s*mutable\b", text(field_of(node, "declarator"))) is not None
    if is_mutable and (run.subtree_matters(node) or '"' in text(node)):
        run.gap(node, frame, "a mutable closure changes what it captured: what it makes is not followed")
    outer: Frame | None = frame
    while outer is not None:
        outer.captured, outer = True, outer.outer
    captures = children(field_of(node, "captures"))
    initialised: set[str] = set()

    def keep(name: str, held: Value, written: str = "") -> None:
        before = run.store.get((inner, name)) or BOTTOM  # what closures have that were made here before
        run.local(inner, name, join(before, held), written)

    for child in captures:
        if child.type == "lambda_capture_initializer" and len(children(child)) >= 2:
            named = children(child)
            name, refers = text(named[0]).lstrip("&"), text(named[0]).startswith("&")
            held = initial_value(run, named[-1], frame, refers)
            if is_mutable:
                run.store.share_cell((inner, name), partial(lost, why=_MUTABLE))
            keep(name, held)
            initialised.add(name)
    if frame.blocks or frame.kept:
        owners = {name: frame.owner_of(name) for name in words_of(node)}
        inner.kept = {name: owner for name, owner in owners.items() if owner is not None}
    names = {text(child) for child in captures if child.type == "identifier" and not _is_by_reference(child)}
    if "=" in {text(child) for child in captures} | {text(field_of(node, "captures"))[1:2]}:
        names |= set(words_of(node))
    for name in sorted(names):
        owner = frame.owner_of(name)
        if owner is not None and name not in initialised:
            held, written = run.store.get((owner, name)) or BOTTOM, owner.types.get(name, "")
            if is_mutable:
                run.store.share_cell((inner, name), partial(lost, why=_MUTABLE))
            keep(name, _captured(run, held, written, node, owner), written)
    return (Lambda(node, inner),)


_MUTABLE = "what a mutable closure captured"


def _captured(run: Machine, value: Value, written: str, node: Node, owner: Frame) -> Value:
    """Return what a closure keeps of a variable: an object, or the objects in a list, are copied."""
    kind = run.type_of(written, owner)
    if kind.pointer or "*" in written:
        return value
    if any(isinstance(atom, Seq | Map) for atom in value):
        return elements_copied(run, kind, value, node, owner)
    return copied(run, value, node, owner)


def _is_by_reference(capture: Node) -> bool:
    return capture.prev_sibling is not None and capture.prev_sibling.type == "&"


def words_of(node: Node) -> list[str]:
    """Yield every identifier in ``node``, in order and with repetitions."""
    return [text(each) for each in walk(node) if each.type in ("identifier", "field_identifier")]


# --- operators --------------------------------------------------------------------------------------------------


@expression("field_expression")
def field(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``x.f`` or ``x->f``: a member of an object, ``first`` or ``second`` of a pair; unknown for all else."""
    owners = run.evaluate(field_of(node, "argument"), frame)
    if text(field_of(node, "operator")) == "->":
        owners = pointed_to(run, owners, "operator->", node, frame)
    name = text(field_of(node, "field")).rpartition("::")[2]
    found: list[Value] = []
    for atom in owners:
        if isinstance(atom, Obj):
            value = member(run, atom, name, class_of_member(run, atom, node, frame))
            if value is None and atom.cls is None and name.endswith(("options", "callbacks")):
                value = (run.obj(("field", atom, name), Type("")),)  # options in options
                run.store.set((atom, name), value)
            found.append(value if value is not None else unknown(f"the value of {name}"))
        elif isinstance(atom, Group) and name in ("first", "second") and len(atom.items) == 2:
            found.append(atom.items[name == "second"])
        else:
            found.append(unknown(f"the value of {text(node)[:60]}"))
    return join(*found) if found else unknown(f"the value of {text(node)[:60]}")


@expression("binary_expression")
def binary(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``a && b`` with ``b`` run only where it may be, arithmetic, comparisons, joined texts, streams."""
    operator = text(field_of(node, "operator"))
    left_node, right_node = field_of(node, "left"), field_of(node, "right")
    left = run.evaluate(left_node, frame)
    if run.left:
        return BOTTOM
    if operator in ("&&", "||", "and", "or"):
        left = tested(run, left_node, left, frame)
        return _logical(run, operator in ("||", "or"), left, right_node, frame)
    right = run.evaluate(right_node, frame)
    if operator in ("==", "!=") and text(right_node) == "0":  # of a pointer
        left = tested(run, left_node, left, frame)
    own = by_operator(run, operator, left, [right], node, frame)
    if own is not None:
        if operator == "<<" and has_text(left):  # it gives the stream that it wrote to
            _write_stream(run, left_node, own, frame)
        return own
    if operator == ">>" and not (len(left) == 1 and isinstance(left[0], int)):
        if right_node is not None:
            assign(run, right_node, unknown("a word that is read from a stream"), frame)
        return unknown("a stream")
    if operator == "<<" and not (len(left) == 1 and isinstance(left[0], int)):
        return _streamed(run, left_node, left, right_node, right, frame)
    if operator == "+" and (has_text(left) or has_text(right)):
        kinds = kinds_of(run, [each for each in (left_node, right_node) if each is not None], frame)
        return unknown("a sum of letters") if all(map(as_number, kinds)) else added(left, right)
    if len(left) == 1 and len(right) == 1:
        return computed(operator, settled(run, left)[0], settled(run, right)[0])
    return unknown(f"the value of {text(node)[:60]}")


def _logical(run: Machine, either: bool, left: Value, right_node: Node | None, frame: Frame) -> Value:
    known = decided(run, left)
    if known is either and known is not None:
        if right_node is not None:
            run.kill(right_node, frame, "the condition before decides")
        return (either,)
    if known is not None:
        value = decided(run, tested(run, right_node, run.evaluate(right_node, frame), frame))
        return (value,) if value is not None else unknown("a condition")
    found: list[Value] = []

    def second() -> int:
        found.append(tested(run, right_node, run.evaluate(right_node, frame), frame))
        return NEXT

    run.branches([second, lambda: NEXT], tested=True)
    right = decided(run, found[0])
    return (either,) if right is either else unknown("a condition")


_MANIPULATORS = re.compile(
    r"std::(?:hex|oct|fixed|scientific|setw|setfill|setprecision|setbase|boolalpha|(?:no)?show\w+|(?:no)?uppercase|left|right|"
    r"internal|put_\w+)\b"
)


def _streamed(
    run: Machine, target: Node | None, left: Value, written: Node | None, right: Value, frame: Frame
) -> Value:
    """Evaluate ``stream << text``; the stream is a text that grows, until something changes how it writes."""
    if not has_text(left):
        return left or unknown("a stream")
    if written is not None and _MANIPULATORS.match(text(written)):
        found = unknown("a stream that writes in a way of its own")
    elif any(type(atom) is int for atom in right) and _is_letter(run, written, frame):
        found = concatenated(left, unknown("the letter of a number"))
    else:
        found = concatenated(left, right) if right else left
    _write_stream(run, target, found, frame)
    return found


def _is_letter(run: Machine, written: Node | None, frame: Frame) -> bool:
    """Return whether a number is one of 8 bits, which a stream writes as a letter."""
    return _LETTER.fullmatch(seen_type(run, written, frame).name) is not None or (
        re.search(r"\b(?:u?int8_t|char)\b", text(written)) is not None
    )


_LETTER = re.compile(r"(?:std::)?u?int8_t|(?:un)?signed char|char")


def _write_stream(run: Machine, target: Node | None, written: Value, frame: Frame) -> None:
    """Write to the stream at the beginning of ``s << a << b``."""
    inner = target
    while inner is not None and inner.type == "binary_expression":
        inner = field_of(inner, "left")
    if inner is not None and inner.type in ("identifier", "field_expression", "field_identifier"):
        assign(run, inner, written, frame)


@expression("unary_expression")
def unary(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``!x``, ``-x`` and ``+x``; unknown for other operators and for what cannot be computed."""
    operator = text(field_of(node, "operator"))
    value = run.evaluate(field_of(node, "argument"), frame)
    own = by_operator(run, operator, value, [], node, frame)
    if own is not None:
        return own
    if operator in ("!", "not"):
        known = decided(run, tested(run, field_of(node, "argument"), value, frame))
        return unknown("a condition") if known is None else (not known,)
    if operator == "-" and len(value) == 1 and isinstance(value[0], int):
        return (-value[0],)
    return value if operator == "+" else unknown("a computed value")


@expression("pointer_expression")
def pointer(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``&x`` and ``*x`` as ``x``; ``&Foo::f`` is the method, ``&text[i]`` is unknown."""
    argument = field_of(node, "argument")
    if text(node).startswith("&") and argument is not None and argument.type == "qualified_identifier":
        found = method_pointer(run, argument, frame)
        if found is not None:
            return found
    found = run.evaluate(argument, frame)
    if argument is not None and argument.type == "subscript_expression" and has_text(found):
        return unknown("a text from some letter on")
    if not text(node).startswith("&"):
        return pointed_to(run, found, "operator*", node, frame)
    own = by_operator(run, "&", found, [], node, frame)
    if own is not None:
        return own
    if not _is_kept(node) or not is_plain(found) or argument is None:
        return found
    keep_reference(run, argument, frame)
    return as_referred_to(found)


def _is_kept(address: Node) -> bool:
    """Return whether an address is stored: ``p = &a``, ``return &a``, ``{&a, &b}``, ``list.push_back(&a)``."""
    parent = address.parent
    call = parent.parent if parent is not None and parent.type == "argument_list" else None
    callee = field_of(call, "function") if call is not None else None
    return (parent is not None and parent.type in _KEEPS) or (
        callee is not None and text(field_of(callee, "field")) in FILLS
    )


_KEEPS = ("initializer_list", "assignment_expression", "return_statement")


def method_pointer(run: Machine, node: Node, frame: Frame) -> Value | None:
    """Evaluate ``&Foo::on_message``."""
    head, _, last = re.sub(r"\s+", "", text(node)).rpartition("::")
    kind = run.type_of(re.sub(r"<.*>$", "", head), frame)
    cls = run.class_of(kind, frame)
    if cls is None and (this_object := current_object(frame)) is not None and this_object.cls is not None:
        cls = next((c for c in run.names.ancestry(this_object.cls) if c.name == kind.last), None)
    methods = run.names.find_methods(cls, last)
    return tuple(Bound(each, None) for each in methods) or None


@expression("conditional_expression")
def conditional(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``a ? b : c``: the side that is chosen, the other one dead; both joined if that is not decided."""
    asked = field_of(node, "condition")
    condition = tested(run, asked, run.evaluate(asked, frame), frame)
    if run.left:
        return BOTTOM
    known = decided(run, condition)
    sides = {True: field_of(node, "consequence"), False: field_of(node, "alternative")}
    if known is not None:
        other = sides[not known]
        if other is not None:
            run.kill(other, frame, "the condition before decides")
        return run.evaluate(sides[known], frame)
    found: list[Value] = []

    def side(which: Node | None) -> int:
        found.append(run.evaluate(which, frame))
        return NEXT

    doubt = in_doubt(condition)
    run.branches([lambda: side(sides[True]), lambda: side(sides[False])], tested=True, doubt=doubt)
    return join_in_doubt(found, doubt) if doubt else join(*found)


@expression("update_expression")
def update(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``++x`` or ``x--``; an ``x`` that was not one known integer becomes unknown."""
    argument = field_of(node, "argument")
    before = run.evaluate(argument, frame)
    of_postfix = [] if text(node).startswith(("++", "--")) else [(0,)]  # which it takes to be distinguished
    own = by_operator(run, "++" if "++" in text(node) else "--", before, of_postfix, node, frame)
    if own is not None:
        return own
    step = 1 if "++" in text(node) else -1
    after = (before[0] + step,) if len(before) == 1 and isinstance(before[0], int) else unknown("a counter")
    if argument is not None:
        after = as_declared(run, argument, after, frame)
        assign(run, argument, after, frame)
    return before if not text(node).startswith(("++", "--")) else after


@expression("subscript_expression")
def subscript(run: Machine, node: Node, frame: Frame) -> Value:
    """Evaluate ``container[key]`` for all that the container may be; unknown if nothing is found."""
    container = field_of(node, "argument")
    held = run.evaluate(container, frame)
    keys = [run.evaluate(child, frame) for child in children(field_of(node, "indices"))]
    own = by_operator(run, "[]", held, keys, node, frame)
    if own is not None:
        return own
    if container is not None and has_text(held) and _is_pointer_to_text(run, container, frame):
        return unknown("a text behind a pointer")
    after = tuple(_with_entry_of(atom, keys[0]) for atom in held) if keys else held
    if container is not None and after != held:
        assign(run, container, after, frame)
        held = after
    found = [element(run, atom, keys[0] if keys else BOTTOM) for atom in held]
    result = join(*found) if found else BOTTOM
    return result or unknown(f"the value of {text(node)[:60]}")


def _is_pointer_to_text(run: Machine, container: Node, frame: Frame) -> bool:
    """Return whether ``p[1]`` is a text, not a letter: ``p`` points to the first of several."""
    kind, marked = declared_type(run, container, frame)
    return marked and kind.last == "string" and is_pointer(run, container, frame)


def _with_entry_of(atom: object, key: Value) -> object:
    """Return a map after ``map[key]``, which makes an entry if there is none under the key ([map.access]): its value is
    not known.
    """
    if not isinstance(atom, Map) or any(known == key for known, _ in atom.entries):
        return atom
    made = unknown("an entry that a map makes for a key that it did not have")
    is_known = len(key) == 1 and plain(key[0]) is not None
    return as_one_map((*atom.entries, (key, made)), atom.open or not is_known)


def element(run: Machine, atom: object, key: Value) -> Value:
    """Evaluate ``container[key]``."""
    if isinstance(atom, Param):
        (atom,) = settled(run, (atom,))
    if isinstance(atom, Map):
        definite = [value for known, value in atom.entries if len(key) == 1 and known == key]
        if definite and not atom.open:
            return definite[-1]
        return join(*(value for _, value in atom.entries), unknown("an element of a map"))
    if isinstance(atom, Seq | Group | Param):
        items, exact = items_of(run, atom)
        if exact and len(key) == 1 and isinstance(key[0], int) and 0 <= key[0] < len(items):
            return items[key[0]]
        which = "an element of a list, which of them is not known"
        return join_in_doubt(items, which) if items else unknown(which)
    return (atom,) if isinstance(atom, Unknown) else unknown("an element of something that is not known")
