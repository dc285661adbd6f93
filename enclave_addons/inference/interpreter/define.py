"""Definitions: functions with their decorators, classes with their bodies, method resolution order."""

from __future__ import annotations

import ast

from enclave_addons.inference.interpreter.run import Arguments, Call, Run
from enclave_addons.inference.text import constant_text
from enclave_addons.inference.values import (
    ABSENT,
    BoundMethod,
    ClassMethod,
    ClassValue,
    DataField,
    External,
    Frame,
    FunctionValue,
    Instance,
    PropertyValue,
    Unknown,
    Value,
    external,
    join,
    present,
    sole,
    unknown,
)

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda

# Decorators that leave the function what it is, as far as names are concerned.
_CACHES = ("functools.cache", "functools.lru_cache")
_TRANSPARENT = frozenset({
    *_CACHES, "abc.abstractmethod", "contextlib.contextmanager",
    "contextlib.asynccontextmanager",
    "typing.override", "typing.overload", "typing_extensions.override", "typing.final", "pytest.fixture",
    "asyncio.coroutine",
})  # fmt: skip
_PROPERTIES = frozenset({"builtins.property", "abc.abstractproperty"})
_PLAIN_METACLASSES = frozenset({"abc.ABCMeta", "enum.EnumMeta", "enum.EnumType", "builtins.type"})
_OPEN_NAMES = frozenset({"[class]", "__doc__", "__module__", "__qualname__", "__getattr__"})
_PLAIN_DECORATORS = frozenset(
    {"functools.total_ordering", "typing.final", "typing.runtime_checkable", "enum.unique"}
)
_DATACLASSES = frozenset(
    {"dataclasses.dataclass", "attr.s", "attrs.define", "attr.dataclass", "attrs.frozen"}
)
_FIELDS = frozenset({"dataclasses.field", "attr.ib", "attrs.field"})


def make_function(run: Run, node: FunctionNode, name: str, frame: Frame) -> FunctionValue:
    """Return a ``def`` or ``lambda`` with its defaults; made again in one context it is one value."""
    closure = frame.closure if frame.is_class else frame
    if not frame.is_class:
        frame.capture()
        for changed in run.state.changed_meanwhile & frame.cells.keys():
            run.state.write(frame.cells, changed, frame.cells[changed])
    owner = frame.cells.get("[class]") if frame.is_class else None
    owner_class = owner[0] if owner and isinstance(owner[0], ClassValue) else None
    key = (run.context, id(node), "function")
    known = run.functions.get(key)
    function = known or FunctionValue(node, name, frame.module, closure, owner_class)
    run.functions[key] = function
    arguments = node.args
    defaults = tuple(run.evaluate(default, frame) for default in arguments.defaults)
    kw_defaults = tuple(
        None if default is None else run.evaluate(default, frame) for default in arguments.kw_defaults
    )
    if known is not None and known.closure is closure:  # made again in a loop: one function for all
        defaults = tuple(join(a, b) for a, b in zip(known.defaults, defaults, strict=True))
        kw_defaults = tuple(
            None if a is None or b is None else join(a, b)
            for a, b in zip(known.kw_defaults, kw_defaults, strict=True)
        )
    function.closure = closure
    function.defaults = defaults
    function.kw_defaults = kw_defaults
    return function


def define_function(run: Run, node: ast.FunctionDef | ast.AsyncFunctionDef, frame: Frame) -> bool:
    """Run ``def``: make the function, apply the decorators from the last to the first, bind the name."""
    function = make_function(run, node, node.name, frame)
    value: Value = (function,)
    for decorator in reversed(node.decorator_list):
        value = _decorated(run, value, function, decorator, frame)
    run.assign_name(node.name, value, frame)
    return True


def _decorated(run: Run, value: Value, function: FunctionValue, decorator: ast.expr, frame: Frame) -> Value:
    if isinstance(decorator, ast.Attribute) and decorator.attr in ("setter", "deleter", "getter"):
        found = run.evaluate(decorator.value, frame)
        known = sole(found)
        if decorator.attr == "setter" and isinstance(known, PropertyValue):
            run.has_setters = True
            return (PropertyValue(known.getter, value),)
        if found and all(isinstance(atom, PropertyValue) for atom in found):
            why = f"property {function.name} has a {decorator.attr}, which is not analysed"
            run.gap(decorator, frame, why)
            return found
    callee = run.evaluate(decorator.func if isinstance(decorator, ast.Call) else decorator, frame)
    atom = sole(callee)
    path = atom.path if isinstance(atom, External) else ""
    if path in _PROPERTIES:
        return (PropertyValue(value),)
    if path == "functools.wraps" and isinstance(decorator, ast.Call):
        function.name = ""  # that of the wrapped one
        return value
    if path in ("builtins.staticmethod", "builtins.classmethod"):
        return (ClassMethod(value, path == "builtins.staticmethod"),)
    if path in _TRANSPARENT:
        function.cached = function.cached or path in _CACHES
        return value
    if isinstance(decorator, ast.Call):
        callee = run.evaluate(decorator, frame)
    if isinstance(atom, External):
        run.register_callback(value, None, run.state.mark())
        if path.startswith("functools.single"):
            return unknown(f"what {path} gives")
        return value
    return run.call(callee, Arguments([value]), decorator, frame)


def define_class(run: Run, node: ast.ClassDef, frame: Frame) -> bool:
    """Run ``class``: run the body, complete the class, apply the decorators last to first, bind the name."""
    values = [run.evaluate(base, frame) for base in node.bases if not isinstance(base, ast.Starred)]
    bases = tuple(map(sole, values))
    keywords = {each.arg: run.evaluate(each.value, frame) for each in node.keywords if each.arg is not None}
    if any(isinstance(base, ast.Starred) for base in node.bases) or len(keywords) < len(node.keywords):
        run.gap(node, frame, f"the bases of class {node.name} are made at run time")
    cls = run.allocate(node, "class", lambda: ClassValue(node, node.name, frame.module, bases))
    body = Frame(frame.module, cls.cells, frame.closure if frame.is_class else frame, frame.depth)
    if not frame.is_class:
        frame.capture()
    body.is_class = True
    body.cells["[class]"] = (cls,)
    body.function = frame.function
    body.entry = frame.entry
    run.execute(node.body, body)
    run.classes.setdefault(node, cls)
    if any(isinstance(base, External) and base.path == "typing.NamedTuple" for base in bases):
        cls.fields = _fields(run, cls, frame)
    _made_otherwise(run, cls, keywords, node, frame)
    value: Value = (cls,)
    for decorator in reversed(node.decorator_list):
        value = _decorated_class(run, value, cls, decorator, frame)
    run.assign_name(node.name, value, frame)
    return True


_HOOKS = frozenset({
    "__setattr__", "__getattribute__", "__delattr__", "__get__", "__set__", "__set_name__",
    "__init_subclass__", "__class_getitem__", "__prepare__", "__instancecheck__",
})  # fmt: skip


def _is_plain(metaclass: object) -> bool:
    """Return True if its classes are made as by ``type``: what ``__getattr__`` gives is open, as any attribute that no
    class has."""
    if isinstance(metaclass, ClassValue):
        named = {name for base in program_classes(metaclass) for name in base.cells if isinstance(name, str)}
        return named <= _OPEN_NAMES and all(map(_is_plain, linearized(metaclass)[1:]))
    return isinstance(metaclass, External) and metaclass.path in _PLAIN_METACLASSES


def _made_otherwise(
    run: Run, cls: ClassValue, keywords: dict[str, Value], node: ast.AST, frame: Frame
) -> None:
    """Add a gap for a class whose objects, attributes or subclasses ``type`` and ``object`` do not make."""
    metaclass = sole(keywords.get("metaclass", external("builtins.type")))
    if not _is_plain(metaclass) or any(base.node in run.with_metaclass for base in program_classes(cls)[1:]):
        run.with_metaclass.add(cls.node)
        run.gap(node, frame, f"class {cls.name} has a metaclass, which is not analysed")
        run.escape_value((cls,))
    for name in sorted(name for name in cls.cells if isinstance(name, str) and name.startswith("__")):
        if name in _HOOKS or ABSENT[0] in cls.cells[name]:
            perhaps = "" if name in _HOOKS else " under a condition"
            run.gap(node, frame, f"class {cls.name} defines {name}{perhaps}, which is not analysed")
            run.escape_value((cls,))
    if any(isinstance(base, Unknown) for base in linearized(cls)):
        run.escape_value((cls,))


def functions_of(value: Value) -> Value:
    """Return ``value`` with the functions themselves in place of class and static methods."""
    return tuple(
        each for atom in value for each in (atom.function if isinstance(atom, ClassMethod) else (atom,))
    )


def _decorated_class(run: Run, value: Value, cls: ClassValue, decorator: ast.expr, frame: Frame) -> Value:
    callee = run.evaluate(decorator.func if isinstance(decorator, ast.Call) else decorator, frame)
    atom = sole(callee)
    if isinstance(atom, External) and atom.path in _DATACLASSES:
        cls.fields = _fields(run, cls, frame, decorator)
        return value
    if isinstance(atom, External) and atom.path in _PLAIN_DECORATORS:
        return value
    if isinstance(decorator, ast.Call):
        callee = run.evaluate(decorator, frame)
    if isinstance(atom, External) and run.tables.keeps_off(atom.path):
        return value
    made = run.call(callee, Arguments([value]), decorator, frame)
    if isinstance(atom, (External, Unknown)):
        run.gap(decorator, frame, f"class {cls.name} is handed to a decorator that is not analysed")
        return value
    return made or value


def _fields(
    run: Run, cls: ClassValue, frame: Frame, settings: ast.expr | None = None
) -> dict[str, DataField]:
    """Return the fields of a dataclass, in the order of its constructor but for those that are keywords only.

    ``settings``: its decorator.
    """
    fields: dict[str, DataField] = {}
    for base in reversed(program_classes(cls)[1:]):
        fields.update(base.fields or {})
    by_position = not _says(run, settings, "kw_only", frame)
    for statement in cls.node.body:
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            annotation = ast.dump(statement.annotation)
            if "KW_ONLY" in annotation:
                by_position = False
            elif "ClassVar" not in annotation:
                fields[statement.target.id] = _field(run, statement.value, frame, by_position)
    return fields


def _says(run: Run, call: ast.expr | None, name: str, frame: Frame, otherwise: bool = False) -> bool:
    """Return what a call says to a keyword that is true or false."""
    keywords = call.keywords if isinstance(call, ast.Call) else ()
    given = next((each.value for each in keywords if each.arg == name), None)
    return otherwise if given is None else bool(sole(run.evaluate(given, frame)))


def _field(run: Run, default: ast.expr | None, frame: Frame, by_position: bool) -> DataField:
    if default is None:
        return DataField(by_position=by_position)
    field = sole(run.evaluate(default.func, frame)) if isinstance(default, ast.Call) else None
    if not isinstance(default, ast.Call) or not isinstance(field, External) or field.path not in _FIELDS:
        return DataField(run.evaluate(default, frame), by_position=by_position)
    in_constructor = _says(run, default, "init", frame, True)
    found = DataField(
        by_position=in_constructor and not _says(run, default, "kw_only", frame, not by_position),
        by_keyword=in_constructor,
    )
    for keyword in default.keywords:
        value = run.evaluate(keyword.value, frame)
        if keyword.arg == "default":
            return found._replace(default=value)
        if keyword.arg in ("default_factory", "factory"):
            return found._replace(factory=(value, default, frame))
    return found


def linearized(cls: ClassValue) -> tuple[object, ...]:
    """Return the method resolution order: C3 as in Python, ending in ``External`` or ``Unknown`` bases."""
    if cls.linear is None:
        cls.linear = (cls,)  # guards against a class among its own bases
        orders = [list(linearized(base)) if isinstance(base, ClassValue) else [base] for base in cls.bases]
        cls.linear = (cls, *_merge(orders, list(cls.bases)))
    return cls.linear


def program_classes(cls: ClassValue) -> list[ClassValue]:
    """Return the class and its bases that are analysed, in the method resolution order."""
    return [base for base in linearized(cls) if isinstance(base, ClassValue)]


def is_enumeration(cls: ClassValue) -> bool:
    """Return True if a class of ``enum`` is among its bases."""
    return any(isinstance(base, External) and base.path.startswith("enum.") for base in linearized(cls))


def enumeration_member(run: Run, cls: ClassValue, name: str) -> Instance:
    """Return the one object that stands for a member, with its name and what the class gives it as value.

    A second name of one value is another name of the first member.
    """
    value = present(cls.cells[name])
    if len(value) == 1 and is_constant(value[0]):
        name = next((each for each in _names_of_members(cls) if cls.cells[each] == value), name)
    member = run.members.get((cls, name))
    if member is None:
        member = run.members[cls, name] = Instance(cls)
        member.cells.update({"name": (name,), "value": value})
    return member


def _names_of_members(cls: ClassValue) -> list[str]:
    names = [name for name in cls.cells if isinstance(name, str) and not name.startswith(("_", "["))]
    return [name for name in names if not isinstance(present(cls.cells[name])[0], _NO_MEMBERS)]


_NO_MEMBERS = (FunctionValue, ClassMethod, PropertyValue)


def enumeration_members(run: Run, cls: ClassValue) -> tuple[Instance, ...]:
    """Return the members in the order of the class body."""
    return tuple(dict.fromkeys(enumeration_member(run, cls, name) for name in _names_of_members(cls)))


def member_with_value(run: Run, cls: ClassValue, value: Value) -> Value:
    """Return the member that ``cls(value)`` finds; unknown unless the value and those of all members are constants."""
    wanted = constant_text(value[0]) if len(value) == 1 else None
    members = enumeration_members(run, cls)
    values = [sole(member.cells["value"]) for member in members]
    own = any(name in base.cells for base in program_classes(cls) for name in ("__new__", "__init__"))
    if isinstance(wanted, (str, int)) and wanted in values and not own and all(map(is_constant, values)):
        return (members[values.index(wanted)],)
    return unknown("a member of an enumeration that is looked up by its value")


def member_with_name(run: Run, cls: ClassValue, name: Value) -> Value:
    """Return the member that ``cls[name]`` finds; unknown unless the name is."""
    wanted = constant_text(sole(name))
    if wanted in _names_of_members(cls):
        return (enumeration_member(run, cls, str(wanted)),)
    return unknown("a member of an enumeration that is looked up by its name")


def _merge(orders: list[list[object]], bases: list[object]) -> list[object]:
    sequences = [order for order in (*orders, bases) if order]
    result: list[object] = []
    while sequences:
        behind = [item for order in sequences for item in order[1:]]
        head = next((order[0] for order in sequences if order[0] not in behind), sequences[0][0])
        result.append(head)
        sequences = [[item for item in order if item is not head] for order in sequences]
        sequences = [order for order in sequences if order]
    return result


def methods_in(held: Value, receiver: object, cls: ClassValue) -> Value:
    """Return the functions among what a class holds under one name, bound as a caller gets them."""
    bound: list[object] = []
    for atom in held:
        if isinstance(atom, FunctionValue):
            bound.append(BoundMethod(atom, receiver))
        elif isinstance(atom, ClassMethod):
            functions = [each for each in atom.function if isinstance(each, FunctionValue)]
            bound.extend(functions if atom.static else [BoundMethod(each, cls) for each in functions])
        elif isinstance(atom, PropertyValue):
            bound.extend(methods_in((*atom.getter, *atom.setter), receiver, cls))
    return tuple(bound)


def expect_methods(run: Run, value: Value, since: int | None = None) -> None:
    """Register the methods of the program's objects in ``value``: others may call them, as in ``register_callback``."""
    for instance in value:
        if not isinstance(instance, Instance) or not isinstance(instance.cls, ClassValue):
            continue
        for base in program_classes(instance.cls):
            for name in list(base.cells):
                if isinstance(name, str) and name not in _NOT_CALLED and not name.startswith("["):
                    bound = methods_in(base.cells.get(name, ()), instance, instance.cls)
                    run.register_callback(bound, None, since)


_NOT_CALLED = frozenset({"__init__", "__new__", "__init_subclass__", "__class_getitem__", "__set_name__"})


_FOLLOWED = frozenset({  # special methods that run where the program says so
    "__init__", "__new__", "__call__", "__enter__", "__exit__", "__getattr__", "__post_init__", "__init_subclass__",
    "__name__", "__module__", "__doc__", "__slots__", "__class_getitem__", "__set_name__",
})  # fmt: skip


def expect_operators(run: Run, cls: ClassValue, instance: Instance) -> None:
    """Expect calls of special methods at any time, by operators, iteration, tests and texts; where is not followed."""
    for base in program_classes(cls):
        for name, value in list(base.cells.items()):
            if (
                isinstance(name, str)
                and name.startswith("__")
                and name.endswith("__")
                and name not in _FOLLOWED
            ):
                run.register_callback(methods_in(value, instance, cls), None, run.state.mark())


def setter_of(owner: Instance, name: str) -> Value:
    """Return what sets the attribute, if it is a property with a setter."""
    classes = program_classes(owner.cls) if isinstance(owner.cls, ClassValue) else []
    held = next((each.cells[name] for each in classes if name in each.cells), ())
    return tuple(setter for atom in held if isinstance(atom, PropertyValue) for setter in atom.setter)


def foreign_bases(cls: ClassValue) -> list[object]:
    """Return the bases that are not analysed: ``External`` or ``Unknown``; ``object`` does not count."""
    foreign = (base for base in linearized(cls) if not isinstance(base, ClassValue))
    return [base for base in foreign if not (isinstance(base, External) and base.path in _HARMLESS_BASES)]


_HARMLESS_BASES = frozenset({"builtins.object", "typing.Generic", "abc.ABC", "typing.Protocol"})


def new_instance(run: Run, cls: ClassValue, call: Call) -> Instance:
    """Run ``object.__new__(cls)``."""
    made = run.allocate(call.node, f"instance {id(cls)}", lambda: Instance(cls))
    made.guards = tuple(each for each in run.guards if not made.summary or each in made.guards)
    return made


def is_constant(atom: object) -> bool:
    """Return True if ``atom`` is a constant that a dictionary can have as a key, or a member of an enumeration."""
    if isinstance(atom, Instance):
        return isinstance(atom.cls, ClassValue) and is_enumeration(atom.cls)
    return isinstance(atom, (str, int, float, bool, type(None)))
