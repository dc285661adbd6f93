"""Calls by name: methods of the own class, functions, static methods, what makes objects.

A call that cannot be followed is a gap when one of its possible targets makes interfaces, when it gets a node, or when
its name makes an interface in rclcpp.
"""

from __future__ import annotations

import re

from enclave_addons.inference.cpp.ledger import CREATES
from enclave_addons.inference.cpp.libraries import (
    LIBRARY_CLASSES,
    LIBRARY_FUNCTIONS,
    LIBRARY_METHODS,
    NODE_BASES,
    NODE_METHODS,
    FunctionModel,
)
from enclave_addons.inference.cpp.reading.declarations import Class, Function, Scope
from enclave_addons.inference.cpp.reading.names import STANDARD_TYPES
from enclave_addons.inference.cpp.reading.type_names import NO_TYPE, Type
from enclave_addons.inference.cpp.reading.writes import FILLS
from enclave_addons.inference.cpp.running.assignments import assign
from enclave_addons.inference.cpp.running.callbacks import run_meanwhile
from enclave_addons.inference.cpp.running.constructors import cast, construct, made, made_of
from enclave_addons.inference.cpp.running.containers import CONTAINER_METHODS, container_call, is_standard
from enclave_addons.inference.cpp.running.contents import copied, handed_over
from enclave_addons.inference.cpp.running.implicit_calls import called_unseen
from enclave_addons.inference.cpp.running.invocation import CallSite, call_functions, call_values, pointed_to
from enclave_addons.inference.cpp.running.left_out import forget_writes
from enclave_addons.inference.cpp.running.machine import Frame, Machine, expression
from enclave_addons.inference.cpp.running.plain_types import is_plain_type
from enclave_addons.inference.cpp.running.references import (
    REFERRED_TO,
    forget,
    is_plain,
    keep_reference,
    leads_into,
    through,
)
from enclave_addons.inference.cpp.running.standard import (
    CASTS,
    STANDARD,
    as_algorithm,
    may_write,
    writes_elements,
)
from enclave_addons.inference.cpp.running.static_types import (
    GIVES_INNER,
    TEXTS,
    class_around,
    class_of_member,
    classes_around,
    current_object,
    declared_type,
    methods_meant,
    points_to_plain,
    tested,
)
from enclave_addons.inference.cpp.running.unknown_calls import (
    changed_by_standard,
    may_be_written,
    unknown_call,
    without_source,
)
from enclave_addons.inference.cpp.running.values import (
    BOTTOM,
    Atom,
    Bound,
    Const,
    Group,
    Lambda,
    Obj,
    Seq,
    Unknown,
    Value,
    join,
    lost,
    unknown,
)
from enclave_addons.inference.cpp.running.variables import member, variable
from enclave_addons.inference.cpp.syntax import (
    Node,
    callee_name,
    field_of,
    template_arguments,
    text,
    unwrapped,
)

_NAMES = frozenset({
    "identifier", "qualified_identifier", "template_function", "type_identifier", "template_type", "primitive_type",
    "dependent_name",
})  # fmt: skip
_MAKERS = frozenset({
    "std::make_shared", "std::make_unique", "make_shared", "make_unique", "boost::make_shared", "std::allocate_shared",
})  # fmt: skip


_RUNS_OTHERS = re.compile(
    r"spin\w*$|(?:^|\W)(?:execute(?:_\w+)?|handle_(?:message|request|response|loaned_message))$"
)
"""Functions of rclcpp that run callbacks of a node (executors.hpp, timer.hpp, subscription.hpp, service.hpp)."""


_SPINS = re.compile(r"(?:^|\W)spin\w*$")
_WAITS = re.compile(r"(?:^|\W)(?:sleep\w*|wait\w*|ok|join)$")
"""What a program does while callbacks run in a thread of their own."""


@expression("call_expression")
def call_expression(run: Machine, node: Node, frame: Frame) -> Value:
    """Calls a method on an object, something by its name, or else whatever the callee evaluates to."""
    callee = unwrapped(field_of(node, "function"))
    if callee is None:
        return unknown("a call")
    site = CallSite(run, node, callee, frame)
    name = callee_name(callee)
    if name == "noexcept":
        run.kill(field_of(node, "arguments"), frame, "noexcept() does not run what stands in it")
        return unknown("what noexcept() says")
    if _RUNS_OTHERS.search(name):
        if callee.type in _NAMES:
            _ = site.values  # made before anything spins: ``spin(std::make_shared<Talker>())``
        run.store.others_run()
    if _SPINS.search(name):
        run.spins_beside = run.spins_beside or bool(run.closures)
        if run.spins_beside or len(run.active) > 1 or _makes_more(run, node):
            run_meanwhile(run)
    elif run.spins_beside and _WAITS.search(name):
        run_meanwhile(run)
    if callee.type == "field_expression":
        return method_call(run, site)
    if callee.type in _NAMES:
        return _named_call(run, callee_name(callee), site)
    values = site.values
    return call_values(run, run.evaluate(callee, frame), values, node, frame)


_LOOPS = frozenset({"for_statement", "for_range_loop", "while_statement", "do_statement"})


def _makes_more(run: Machine, call: Node) -> bool:
    """Return whether something may make an interface behind ``call`` in its function: most programs only end there."""
    each: Node | None = call
    while each is not None and each.type not in ("function_definition", "lambda_expression"):
        behind = each.next_named_sibling
        while behind is not None:
            if run.subtree_matters(behind):
                return True
            behind = behind.next_named_sibling
        if each.type in _LOOPS and run.subtree_matters(each):
            return True
        each = each.parent
    return False


# --- by name --------------------------------------------------------------------------------------------------


def _named_call(run: Machine, name: str, site: CallSite) -> Value:
    if name in CASTS:
        run.resolve(site.node, site.frame)
        return _cast(run, name, site)
    if _is_global(site) and "::" not in name:
        return _free_call(run, name, site, scope=())
    used = site.frame.bindings.get(name)  # by ``using ns::f`` in this function
    if used is not None and run.names.find_functions(used.name, (), site.frame.file):
        return _free_call(run, used.name, site, scope=())
    owner = site.frame.owner_of(name) if "::" not in name else None
    if owner is not None:
        run.resolve(site.node, site.frame)
        values = site.values
        return call_values(run, run.store.get((owner, name)) or BOTTOM, values, site.node, site.frame)
    if _hides_dependent(run, name, site.frame):
        return _free_call(run, name, site, site.frame.scope)
    found = _own_method(run, name, site)
    found = _method_around(run, name, site) if found is None else found
    return _free_call(run, name, site, site.frame.scope) if found is None else found


def _hides_dependent(run: Machine, name: str, frame: Frame) -> bool:
    """Return whether a name means a function though a base has such a method: one whose type depends on the parameters
    of the template ([temp.dep]/3).
    """
    cls = class_around(run, frame)
    if cls is None or not cls.templates or name in cls.uses or name in run.names.methods[cls]:
        return False
    depends_on = {*cls.templates}
    bases = {
        base for written, base in run.names.bases(cls) if depends_on.isdisjoint(re.findall(r"\w+", written))
    }
    return not any(run.names.find_methods(base, name) for base in bases) and bool(
        run.names.find_functions(name, frame.scope, frame.file)
    )


def _method_around(run: Machine, name: str, site: CallSite) -> Value | None:
    """Call a static method of a class around by its name alone; ``None`` if none has it."""
    for cls in classes_around(run, site.frame):
        methods = run.names.find_methods(cls, name) if name != cls.name else []
        if methods:
            return site.call_methods(methods, None, exactly=True)
    return None


def _is_global(site: CallSite) -> bool:
    """Return whether it is ``::f()``."""
    return text(site.callee).startswith("::")


def _cast(run: Machine, name: str, site: CallSite) -> Value:
    value = run.evaluate(site.given[0], site.frame) if site.given else BOTTOM
    if name == "std::ref" and is_plain(value):
        keep_reference(run, site.given[0], site.frame)
    if name == "std::move" and is_plain(value):
        forget(run, site.given[0], site.frame, "what is left after std::move", told=False)
    if name.rpartition("::")[2] in ("dynamic_cast", "dynamic_pointer_cast") and site.types:
        return _cast_down(run, site.types[0], value, site.frame)
    if name == "std::any_cast":  # to another type it gives nothing, or throws
        return join(lost(value, "what a std::any holds"), unknown("what a std::any holds"))
    if name != "static_cast":
        return value
    cls = run.class_of(site.types[0], site.frame)
    if cls is not None and not text(template_arguments(site.callee)[0]).endswith(("&", "*")):
        made = made_of(run, site.types[0], value, site.node, site.frame, True)
        return copied(run, value, site.node, site.frame, cls) if made is None else made
    if site.types[0].name == "bool":
        value = tested(run, site.given[0], value, site.frame)
    return cast(run, site.types[0], value)


def _cast_down(run: Machine, kind: Type, value: Value, frame: Frame) -> Value:
    """Return the objects that are of a class, or of one derived from it; whether a pointer is set is open otherwise."""
    cls = run.class_of(kind, frame)
    kept = tuple(
        atom
        for atom in value
        if cls is None or not isinstance(atom, Obj) or atom.cls is None or cls in run.names.ancestry(atom.cls)
    )
    return value if len(kept) == len(value) else join(kept, unknown("a cast that gives nothing"))


def _own_method(run: Machine, name: str, site: CallSite) -> Value | None:
    """Call ``f()`` and ``Base::f()`` inside of a class; ``None`` if the class has no such method."""
    this, frame = current_object(site.frame), site.frame
    if this is None:
        return None
    head, separator, last = name.rpartition("::")
    if separator:
        return _of_named_class(run, this, head, last, site)
    if this.cls is not None:
        methods = of_this(run, this, name, site.node, frame) or run.names.find_methods(
            class_around(run, frame), name
        )
        if methods:
            return site.call_methods(methods, this)
        field = member(run, this, name)
        if field is not None:
            return site.call_value(field)
    if run.names.find_functions(name, frame.scope, frame.file):
        return None
    if model_of(this, name) is not None or name in _ITSELF:
        return on_object(run, this, name, site)
    return only_declared(run, this.cls, name, site, this)


def _of_named_class(run: Machine, this: Obj, head: str, last: str, site: CallSite) -> Value | None:
    kind = run.type_of(head, site.frame)
    ancestry = run.names.ancestry(this.cls)
    # A class finds its bases by their bare names, whatever their namespaces ([class.pre]/2).
    cls = run.class_of(kind, site.frame) or next((each for each in ancestry if each.name == head), None)
    methods = run.names.find_methods(cls, last) if cls in ancestry else []
    if methods:
        return site.call_methods(methods, this, exactly=True)
    known = NODE_BASES | {this.foreign_base, this.foreign_base.rpartition("::")[2]}
    if cls is None and kind.name in known:
        return by_model(run, this, last, site)
    return None


def _free_call(run: Machine, name: str, site: CallSite, scope: Scope) -> Value:
    node, frame = site.node, site.frame
    qualified = _qualified(run, name, frame)
    if qualified in _MAKERS:
        kind = site.types[0] if site.types else NO_TYPE
        return construct(run, kind._replace(pointer=False), site.values, node, frame, heap=True)
    functions = run.names.find_functions(name, scope, frame.file)
    functions = _declared_before(run, [*functions, *_beside_arguments(run, name, functions, site)], site)
    if functions:
        return call_functions(run, functions, site.values, node, frame, site.types)
    qualified = as_algorithm(qualified, site.given)
    model = LIBRARY_FUNCTIONS.get(qualified)
    if model is not None:
        call = site.call()
        run.handle(node, frame)
        return model(run, call)
    standard = STANDARD.get(qualified)
    if standard is not None or may_write(qualified):
        run.resolve(node, frame)
        given_back = standard(run, site.values, node, frame) if standard is not None else BOTTOM
        if may_write(qualified) or writes_elements(run, qualified, site.values):
            changed_by_standard(run, qualified, site.given, frame)
            if standard is None:
                given_back = unknown_call(run, qualified, site.values, node, [], frame)
        return given_back
    return _made_or_unknown(run, name, qualified, site)


def _declared_before(run: Machine, functions: list[Function], site: CallSite) -> list[Function]:
    """Return the overloads that a call sees, which in a template may be later ones; all if it seems to see none."""
    around, cls = site.frame.function, class_around(run, site.frame)
    if len(functions) < 2 or (around is not None and around.templates) or (cls is not None and cls.templates):
        return functions

    def is_seen(each: Function) -> bool:
        if each.file.file != site.frame.file.file or each.node.start_byte < site.node.start_byte:
            return True
        taken = [_SPACE.sub("", p.type) for p in each.parameters]
        return any(
            other.file.file != each.file.file or other.node.start_byte < site.node.start_byte
            for other in run.names.declared.get(each.name, ())
            if [_SPACE.sub("", p.type) for p in other.parameters] == taken
        )

    return [each for each in functions if is_seen(each)] or functions


_SPACE = re.compile(r"\s+")


def _beside_arguments(run: Machine, name: str, found: list[Function], site: CallSite) -> list[Function]:
    """Return functions of that name that ``found`` lacks, in the namespaces of the arguments' classes
    ([basic.lookup.argdep]).
    """
    listed = run.names.functions.get(name.rpartition("::")[2], ())
    if not listed or "::" in text(site.callee):
        return []
    objects = (atom for value in site.values for atom in value if isinstance(atom, Obj))
    classes = (cls for each in objects for cls in run.names.ancestry(each.cls))
    spaces = {tuple(each.qualified.split("::")[:-1]) for each in classes}
    return [each for each in listed if each.scope in spaces and not each.owner and each not in found]


def _made_or_unknown(run: Machine, name: str, qualified: str, site: CallSite) -> Value:
    """Evaluate ``Foo(...)``, ``Foo::make_shared(...)``, ``Foo::f(...)``, else a variable, else nobody knows what."""
    frame, (head, _, last) = site.frame, qualified.rpartition("::")
    if last in ("make_shared", "make_unique", "create") and head:
        made_value = _static_maker(run, head, last, site)
        if made_value is not None:
            return made_value
    kind = run.type_of(text(site.callee), frame)
    known = kind.name in LIBRARY_CLASSES or is_plain_type(kind.name) or kind.last.endswith("Options")
    if known or run.class_of(kind, frame) is not None:
        return made(run, site.node, kind, site.given, frame)
    found = _static_method(run, name.rpartition("::")[0] or head, last, site) if head else None
    if found is not None:
        return found
    values = site.values
    held = variable(run, name, frame)
    if any(isinstance(atom, Lambda | Bound) for atom in held):
        return site.call_value(held)
    if writes_elements(run, qualified, values):
        changed_by_standard(run, qualified, site.given, frame)
    return unknown_call(run, qualified, values, site.node, site.given, frame)


def _qualified(run: Machine, name: str, frame: Frame) -> str:
    head, separator, last = name.rpartition("::")
    if separator:
        return f"{run.type_of(head, frame).name}::{last}"
    alias = run.names.alias(name, frame.scope, frame.file)
    if alias is not None and "::" in alias.target:
        return alias.target.lstrip(":")
    whole = f"std::{name}"
    if name in ("to_string", "make_shared", "make_unique", "move", "bind", "ref"):
        return whole
    if (whole in STANDARD or name in STANDARD_TYPES) and run.names.is_standard(name, frame.scope, frame.file):
        return whole
    return f"rclcpp::{name}" if name in _FOUND_BY_THE_NODE else name


_FOUND_BY_THE_NODE = ("spin", "spin_some", "spin_until_future_complete")
"""Functions of rclcpp found through their argument, a node, where the program has none ([basic.lookup.argdep])."""


def _static_maker(run: Machine, head: str, last: str, site: CallSite) -> Value | None:
    """Evaluate ``rclcpp::Node::make_shared(...)`` as ``std::make_shared<rclcpp::Node>(...)``."""
    kind = run.type_of(head, site.frame)
    own = run.names.find_methods(run.class_of(kind, site.frame), last)
    if own or (last == "create" and kind.name not in LIBRARY_CLASSES):
        return None
    return construct(run, kind._replace(pointer=False), site.values, site.node, site.frame, heap=True)


def _static_method(run: Machine, head: str, last: str, site: CallSite) -> Value | None:
    kind = run.type_of(head, site.frame)
    cls, this = run.class_of(kind, site.frame), current_object(site.frame)
    methods = run.names.find_methods(cls, last)
    if cls is None or not methods:
        return only_declared(run, cls, last, site, None)
    inside = this is not None and cls in run.names.ancestry(this.cls)
    bindings = run.names.bindings(cls, kind)
    return site.call_methods(methods, this if inside else None, exactly=True, bindings=bindings)


# --- methods ----------------------------------------------------------------------------------------------------


def method_call(run: Machine, site: CallSite) -> Value:
    """Call ``x.f(...)`` for each thing that ``x`` may be; join the results, ``BOTTOM`` if ``x`` holds nothing."""
    callee, frame, subject = site.callee, site.frame, site.receiver
    field = unwrapped(field_of(callee, "field"))
    name = callee_name(field) if field is not None else ""
    if field is not None and field.type == "qualified_identifier":
        name = name.rpartition("::")[2]
    receiver = run.evaluate(subject, frame)
    if text(field_of(callee, "operator")) == "->":
        receiver = join(*(_shown(atom) for atom in pointed_to(run, receiver, "operator->", callee, frame)))
    is_inner = name in GIVES_INNER and not site.given and any(isinstance(atom, Obj) for atom in receiver)
    if is_inner and not any(run.methods_of(atom, name) for atom in receiver):
        return receiver
    if name == "reset" and (_declared_pointer(run, subject, frame) or _is_pointer(run, site, receiver)):
        value = run.evaluate(site.given[0], frame) if site.given else BOTTOM
        called_unseen(run, [run.evaluate(each, frame) for each in site.given[1:]])  # a deleter
        assign(run, subject, value, frame)  # pointer.reset(new Foo(...))
        return BOTTOM
    if name == "emplace" and _declared_pointer(run, subject, frame):  # of an optional
        kind, _ = declared_type(run, subject, frame)
        made = construct(run, kind._replace(pointer=False), site.values, site.node, frame)
        assign(run, subject, made, frame)
        return made
    if not receiver:
        run.later(site.values, frame)
        run.resolve(site.node, frame)
        if _could_make(run, subject, name, frame):
            found_at = (frame.file.file, site.node.start_byte)
            run.unset[found_at] = (run.place(site.node, frame), text(subject)[:40], name)
        return BOTTOM
    if name in FILLS and (REFERRED_TO in receiver or points_to_plain(run, subject, frame, TEXTS)):
        through(run, subject, frame)
    elif name in FILLS and any(isinstance(atom, Unknown | int | Const) for atom in receiver):
        forget(run, subject, frame, told=False)
    found: list[Value] = []
    before = run.store.mark()
    alternatives = []
    for atom in receiver:
        # Runs its arguments anew.
        found.append(_on_atom(run, atom, name, CallSite(run, site.node, callee, frame)))
        if len(receiver) > 1:
            alternatives.append(run.store.changes(before))
            run.store.undo(before)
    if alternatives:
        run.store.merge(alternatives)
        run.left = False
    return join(*found)


def _shown(atom: Atom) -> Value:
    """Return the objects that an iterator may show; anything else, also an iterator over texts, as it is."""
    items = atom.items if isinstance(atom, Seq) and atom.place else ()
    shown = join(*(items if isinstance(atom, Seq) and atom.open else items[:1]))
    return shown if any(isinstance(each, Obj) for each in shown) else (atom,)


def _could_make(run: Machine, receiver: Node, name: str, frame: Frame) -> bool:
    """Return whether the method, of an object that was not seen to be made, would make interfaces."""
    kind, _ = declared_type(run, receiver, frame)
    cls = run.class_of(kind, frame)
    if cls is not None:
        return any(map(run.makes_interfaces, run.names.find_methods(cls, name)))
    if CREATES.fullmatch(name):
        return True
    if kind.name not in ("", "auto"):
        return False
    return any(run.makes_interfaces(f) for table in run.names.methods.values() for f in table.get(name, ()))


def _declared_pointer(run: Machine, node: Node, frame: Frame) -> bool:
    if node.parent is not None and "->" in text(node.parent)[len(text(node)) : len(text(node)) + 3]:
        return False
    return declared_type(run, node, frame)[1]


def _is_pointer(run: Machine, site: CallSite, held: Value) -> bool:
    """Return whether ``auto x`` is a pointer to what it holds: the objects have no ``reset()`` of their own."""
    is_auto = declared_type(run, site.receiver, site.frame)[0].name == "auto"
    objects = all(isinstance(atom, Obj) and not run.methods_of(atom, "reset") for atom in held)
    return is_auto and bool(held) and objects and text(field_of(site.callee, "operator")) == "."


_OF_PAIR = ("first", "second")


def _on_atom(run: Machine, atom: object, name: str, site: CallSite) -> Value:
    if isinstance(atom, Obj):
        return on_object(run, atom, name, site)
    if isinstance(atom, Lambda | Bound):
        values = site.values
        return call_values(run, (atom,), values, site.node, site.frame) if name == "operator()" else BOTTOM
    if isinstance(atom, Group) and name in _OF_PAIR and len(atom.items) == 2:
        return site.call_value(atom.items[name == "second"])
    if CREATES.fullmatch(name) and not isinstance(atom, Unknown):
        atom = Unknown("an object that is not a node")
    if not isinstance(atom, Unknown) or name in CONTAINER_METHODS:
        return container_call(run, atom, name, site)
    return _on_unknown(run, atom, name, site)


_ITSELF = ("shared_from_this", "weak_from_this")
"""Of ``std::enable_shared_from_this``."""


def on_object(run: Machine, atom: Obj, name: str, site: CallSite) -> Value:
    """Call a method of one object: its source, else a closure in a member, else the tables, else unknown code."""
    callee, frame = site.callee, site.frame
    if atom.cls is not None:
        argument = field_of(callee, "argument")
        own = argument is not None and argument.type == "this" and "::" not in text(field_of(callee, "field"))
        seen = None if own else class_of_member(run, atom, callee, frame)
        if seen is None:
            methods = of_this(run, atom, name, site.node, frame)
        elif seen is atom.cls and argument is not None:
            methods = methods_meant(run, seen, name, argument, site.node, frame)
        else:
            methods = run.names.find_methods(seen, name)
        if methods:
            return site.call_methods(methods, atom)
        field = member(run, atom, name, seen)
        if field is not None and name not in NODE_METHODS:
            return site.call_value(field)
    if atom.cls is None and atom.type.name:
        run.resolve(site.node, frame)
    found = by_model(run, atom, name, site)
    if found is None:
        found = only_declared(run, atom.cls, name, site, atom)
    if found is not None:
        return found
    if atom.node is not None and not atom.is_node and not name.startswith("create"):
        run.later(site.values, frame)
        return unknown(f"the result of {name}()")
    whole = f"{atom.type.name}::{name}"
    return unknown_call(run, whole, site.values, site.node, site.given, frame, receiver=atom)


def only_declared(
    run: Machine, cls: Class | None, name: str, site: CallSite, receiver: Obj | None
) -> Value | None:
    """Return a method that the class or a base declares without a body in reach; ``None`` if none does."""
    if cls is None or not run.names.declarations(cls, name):
        return None
    return without_source(run, f"{cls.name}::{name}", site.values, site.node, site.frame, receiver)


def of_this(run: Machine, this: Obj, name: str, node: Node, frame: Frame) -> list[Function]:
    """Return what ``name()`` calls inside of a class: its own while it is made as a base."""
    cls = this.building or this.cls
    methods = methods_meant(run, cls, name, None, node, frame) if cls is not None else []
    return methods or run.names.find_methods(this.cls, name)


def model_of(this: Obj, name: str) -> FunctionModel | None:
    """Return what the tables have of a method: by the object's class, its library base, or for it as a node."""
    found = LIBRARY_METHODS.get((this.type.name, name)) or LIBRARY_METHODS.get((this.foreign_base, name))
    return found or (NODE_METHODS.get(name) if this.is_node else None)


def by_model(run: Machine, atom: Obj, name: str, site: CallSite) -> Value | None:
    """Return what the tables know of a method; ``None`` if they do not know it."""
    model = model_of(atom, name)
    if model is None and name in _ITSELF:
        run.resolve(site.node, site.frame)
        return (atom,)
    if model is None:
        return None
    call = site.call(atom)
    run.handle(site.node, site.frame)
    return model(run, call)


def _on_unknown(run: Machine, atom: Unknown, name: str, site: CallSite) -> Value:
    values, node, frame, subject = site.values, site.node, site.frame, site.receiver
    if CREATES.fullmatch(name):
        run.handle(node, frame)
        what = f"{text(subject)[:60]}->{name}()"
        run.gap(node, frame, f"the node that {what} makes an interface on is not known: {atom.why}")
        return unknown(f"the result of {name}()")
    kind, _ = declared_type(run, subject, frame)
    is_own = kind.last in run.names.classes  # in whatever namespace
    if kind.name not in ("", "auto") or not is_standard(name):
        run.resolve(node, frame)
    if (kind.name in ("", "auto") or is_own) and not is_standard(name):
        every = [f for table in run.names.methods.values() for f in table.get(name, ())]
        possible = [f for f in every if len(values) <= len(f.parameters) + (9 if f.variadic else 0)]
        owner = frame.owner_of(text(subject))
        for each in possible if owner is not None and leads_into(owner.initial.get(text(subject))) else ():
            forget_writes(run, each)
        makes = next((f for f in possible if run.makes_interfaces(f)), None)
        if makes is not None:
            which = f"which {name}() is called here is not known ({atom.why})"
            run.gap(node, frame, f"{which}; {makes} makes interfaces")
    handed_over(run, f"{text(subject)[:40]}->{name}()", values, node, frame)
    # The methods of nodes only read their first argument, a name.
    may_be_written(run, name, [], site.given[name in NODE_METHODS :], frame)
    return unknown(f"the result of {name}()")
