"""Functions of the C++ standard library: texts, pairs, bind, threads, and what algorithms write through closures."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain

from enclave_addons.inference.cpp.libraries import Call, library_class
from enclave_addons.inference.cpp.reading.declarations import parameters_of
from enclave_addons.inference.cpp.reading.writes import writes_of
from enclave_addons.inference.cpp.running.constructors import text_of
from enclave_addons.inference.cpp.running.contents import copied
from enclave_addons.inference.cpp.running.effects import effects_of
from enclave_addons.inference.cpp.running.implicit_calls import called_unseen
from enclave_addons.inference.cpp.running.machine import NEXT, Frame, Machine, registered
from enclave_addons.inference.cpp.running.references import is_plain
from enclave_addons.inference.cpp.running.static_types import is_pointer
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Bound,
    Group,
    Lambda,
    Obj,
    Seq,
    Text,
    Unknown,
    Value,
    concatenated,
    join,
    literal,
    plain,
    unknown,
)
from enclave_addons.inference.cpp.syntax import Node, children, field_of, text

Standard = Callable[[Machine, Sequence[Value], Node, Frame], Value]
STANDARD: dict[str, Standard] = {}
CASTS = frozenset({
    "static_cast", "dynamic_cast", "const_cast", "reinterpret_cast", "std::static_pointer_cast",
    "std::dynamic_pointer_cast", "std::const_pointer_cast", "std::move", "std::forward", "std::ref", "std::cref",
    "std::as_const", "move", "dynamic_pointer_cast", "static_pointer_cast", "std::addressof", "std::any_cast",
})  # fmt: skip


_READS = re.compile(
    r"std::(?:to_string|to_wstring|sto\w+|min|max|minmax|clamp|abs|isnan|isinf|isfinite|distance|next|prev|count\w*|all_of|any_of|"
    r"none_of|accumulate|reduce|inner_product|equal|mismatch|find\w*|search|adjacent_find|binary_search|lower_bound|upper_bound|"
    r"min_element|max_element|lexicographical_compare|is_\w+|get|get_if|holds_alternative|visit|size|ssize|empty|begin|end|cbegin|"
    r"cend|data|string\w*|vector|set|map|list|deque|array|pair|tuple|make_\w+|tie|forward_as_tuple|apply|invoke|bind\w*|ref|cref|"
    r"function|optional|shared_ptr|unique_ptr|weak_ptr|thread|jthread|async|call_once|for_each|this_thread\w*|cout|cerr|quoted|"
    r"tolower|toupper|isspace|isdigit|isalpha|isalnum|strlen|strcmp|printf|puts|getenv|sqrt|pow|floor|ceil|round|lround|fmod|sin|"
    r"cos|tan|a?tan2?|asin|acos|hypot|exp|log\w*|hash|mutex|lock_guard|unique_lock|scoped_lock|chrono|any|any_cast|variant|move|"
    r"forward|as_const|addressof|declval|less|greater|plus|minus|cmp_\w+|initializer_list|atomic(?:_load)?|runtime_error|\w+_error|"
    r"exception|out_of_range|invalid_argument|signal|system|exit|abort|terminate|filesystem)\b.*"
)
"""Functions of the standard library that leave the texts and containers alone that they get."""


def may_write(name: str) -> bool:
    """Return whether a function of the standard library may change what its arguments refer to."""
    return name.startswith("std::") and _READS.fullmatch(name) is None


def _standard(*names: str) -> Callable[[Standard], Standard]:
    return registered(STANDARD, names)


@_standard("std::string", "std::string_view", "string", "std::filesystem::path", "std::quoted")
def _text(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    return text_of(run, values) if values else literal("")


@_standard("std::to_string")
def _to_string(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    if any(isinstance(atom, Text) and plain(atom) is not None for value in values for atom in value):
        return unknown("the number of a letter")
    return concatenated(values[0]) if values else unknown("a text")


@_standard(
    "std::make_pair", "std::pair", "std::make_tuple", "std::tuple", "std::tie", "std::forward_as_tuple"
)
def _pair(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    return (Group(tuple(_by_value(run, values, node, frame))),)


def _by_value(run: Machine, values: Sequence[Value], call: Node, frame: Frame) -> list[Value]:
    """Return the arguments as a callee stores them that copies objects; not those behind pointers and ``std::tie``."""
    given = children(field_of(call, "arguments"))
    if len(given) != len(values) or _TIES.search(text(field_of(call, "function"))):
        return list(values)
    return [
        copied(run, value, each, frame)
        if each.type in ("identifier", "field_expression") and not is_pointer(run, each, frame)
        else unknown("what a reference shows later")
        if is_plain(value) and _REFERS.match(text(each))
        else value
        for value, each in zip(values, given, strict=True)
    ]


_REFERS = re.compile(r"(?:(?:std|boost)::)?c?ref\(")
_TIES = re.compile(r"\b(?:tie|forward_as_tuple)\b")


@_standard("std::get")
def _get(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    position = re.search(r"get<\s*(\d+)\s*>", text(node))
    found = [atom.items[int(position[1])] for value in values for atom in value
             if position and isinstance(atom, Group | Seq) and int(position[1]) < len(atom.items)]  # fmt: skip
    return join(*found) if found else unknown("an element of a tuple")


@_standard("std::bind", "boost::bind", "std::bind_front")
def _bind(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    """Bind a method to its object, or a function; where arguments are bound, too, placeholders are not known."""
    if not values:
        return BOTTOM
    values = _by_value(run, values, node, frame)
    found: list[Bound | Lambda] = []
    for atom in values[0]:
        objects = [each for each in values[1] if isinstance(each, Obj)] if len(values) > 1 else []
        if isinstance(atom, Bound) and atom.this is None and atom.function.owner and objects:
            fixed = _fixed(values[2:])
            found += [Bound(atom.function, each, fixed) for each in objects]
        elif isinstance(atom, Bound):
            found.append(Bound(atom.function, atom.this, _fixed(values[1:])))
        elif isinstance(atom, Lambda) and _fixed(values[1:]):
            run.later([(atom,)], frame)
        elif isinstance(atom, Lambda):
            found.append(atom)
    return tuple(found) if found else unknown("a function")


def _fixed(given: Sequence[Value]) -> tuple[Value, ...]:
    """Return bound arguments; none if they are nothing but ``_1``, ``_2`` ... in their order."""
    whys = [atom.why for value in given for atom in value if isinstance(atom, Unknown)]
    in_order = [bool(re.search(rf"the value of (?:\w+::)*_{at}$", why)) for at, why in enumerate(whys, 1)]
    return () if len(whys) == len(given) and all(in_order) else tuple(given)


@_standard("std::thread", "std::jthread", "std::async", "std::call_once", "std::for_each", "std::transform",
           "std::sort", "std::any_of", "std::all_of", "std::make_heap", "std::generate", "std::invoke")  # fmt: skip
def _calls_back(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    if text(node).startswith("std::invoke") and values:
        is_method = any(isinstance(a, Bound) and a.this is None and a.function.owner for a in values[0])
        first = 2 if is_method else 1
        callee = _bind(run, values[:2], node, frame) if is_method else values[0]
        return run.calls.call_values(run, callee, values[first:], node, frame)
    if text(node).startswith("std::async"):
        run.store.others_run()
    items = [
        item
        for atom in (values or [BOTTOM])[0]
        if isinstance(atom, Seq) and atom.place
        for item in atom.items
    ]
    for atom in (atom for value in values for atom in value if _runs_now(run, atom)):
        once = partial(_once, run, atom, [join(*items)] if items else [], node, frame)
        # Before what follows, or not.
        run.branches([once, lambda: NEXT], doubt="what a closure that runs meanwhile writes")
    position = next(
        (at for at, value in enumerate(values) if any(isinstance(a, Lambda | Bound) for a in value)), 0
    )
    if text(field_of(node, "function")).startswith(_ALGORITHMS):
        return unknown("the result of an algorithm")
    run.later([_bind(run, values[position:], node, frame)], frame)
    run.later([tuple(a for a in value if not isinstance(a, Bound)) for value in values], frame)
    return unknown(f"the result of {text(node.child_by_field_name('function'))[:40]}()")


_NAMES_SPIN = re.compile(r"\bspin\w*")


@library_class("std::thread", "std::jthread")
def _thread(run: Machine, call: Call) -> None:
    """Run a thread beside what follows."""
    if call.values:
        run.store.others_run()
        kept = (a for value in call.values for a in value if isinstance(a, Lambda | Bound))
        words = (effects_of(run, a).words for a in kept)
        spins = any(map(_NAMES_SPIN.search, (text(call.node), *chain.from_iterable(words))))
        run.spins_beside = run.spins_beside or spins
        _calls_back(run, call.values, call.node, call.frame)


_ALGORITHMS = ("std::for_each", "std::transform", "std::sort", "std::any_of", "std::all_of")
"""They call their closure, and keep it not."""


def _runs_now(run: Machine, atom: object) -> bool:
    """Return whether it is a closure, or an object whose ``operator()`` writes something."""
    own = run.methods_of(atom, "operator()")
    return isinstance(atom, Lambda) or any(writes_of(each.node) for each in own)


def _once(run: Machine, atom: Lambda | Obj, elements: Sequence[Value], node: Node, frame: Frame) -> int:
    run.calls.call_values(run, (atom,), elements, node, frame)
    return NEXT


@_standard("std::function", "std::optional", "std::make_optional", "std::shared_ptr", "std::unique_ptr", "std::begin",
           "std::weak_ptr", "std::mem_fn", "std::remove_reference", "std::launder", "std::exchange")  # fmt: skip
def _itself(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    called_unseen(run, values[1:])  # a deleter
    return values[0] if values else BOTTOM


@_standard("getenv", "std::getenv", "rcpputils::get_env_var")
def _environment(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> Value:
    return unknown("an environment variable")


INTO_FIRST = r"v?sn?printf|strn?(?:cpy|cat)|memcpy"
"""Functions of C that write to what their first argument points to."""
_BY_ARGUMENT = re.compile(
    r"for_each(?:_n)?|transform|(?:stable_|partial_)?sort|reverse|rotate|shuffle|fill(?:_n)?|generate(?:_n)?|copy(?:_if|_n)?|"
    r"replace(?:_if)?|remove_if|unique|iota|(?:stable_)?partition|swap(?:_ranges)?|iter_swap|accumulate|getline|"
    r"(?:all|any|none)_of|(?:count|find)(?:_if)?|" + INTO_FIRST
)
_KEEPS = re.compile(
    r"std::(?:thread|jthread|async|bind\w*|function|make_\w+|pair|tuple|optional|any|\w+_ptr|forward_as_tuple|tie)"
)
"""Takes copies of its arguments, or only keeps them."""
_CALLS = frozenset({"std::for_each", "std::invoke", "std::apply", "std::visit"})


def as_algorithm(name: str, given: Sequence[Node]) -> str:
    """Find ``for_each(v.begin(), ...)`` in ``std`` by its arguments ([basic.lookup.argdep])."""
    return f"std::{name}" if len(given) > 1 and _BY_ARGUMENT.fullmatch(name) else name


def writes_elements(run: Machine, name: str, values: Sequence[Value]) -> bool:
    """Return whether a standard function calls something that writes to what it gets by reference."""
    if not name.startswith("std::") or _KEEPS.fullmatch(name):
        return False
    atoms = [atom for value in values for atom in value]
    called = [a for a in atoms if isinstance(a, Lambda | Bound) or run.methods_of(a, "operator()")]
    return any(_writes(run, atom) for atom in called) or (name in _CALLS and not called)


def _writes(run: Machine, atom: object) -> bool:
    if isinstance(atom, Lambda):
        declarator = field_of(atom.node, "declarator")
        given = [p.name for p in parameters_of(declarator) if p.written_back] if declarator else []
        return bool(given) and not writes_of(atom.node).isdisjoint(given)
    if isinstance(atom, Bound):
        given = [p.name for p in atom.function.parameters if p.written_back]
        return bool(given) and not writes_of(atom.function.node).isdisjoint(given)
    return any(_writes(run, Bound(each, None)) for each in run.methods_of(atom, "operator()"))


def called_now(run: Machine, values: Sequence[Value], node: Node, frame: Frame) -> None:
    """Run closures that write to what they captured: they may be called before what follows, or not."""

    def once(atom: Lambda) -> int:
        run.calls.call_lambda(run, atom, [unknown("an argument")] * 8, node, frame)
        return NEXT

    held = (
        each
        for value in values
        for atom in value
        if isinstance(atom, Obj)
        for each in atom.data.get("arguments", ())
    )
    for atom in (atom for value in (*values, *held) for atom in value if isinstance(atom, Lambda)):
        if writes_of(atom.node):
            run.branches(
                [partial(once, atom), lambda: NEXT], doubt="what a closure writes that may be called"
            )
