"""Objects made of the program's classes: constructors, ``__new__``, dataclasses, members of enumerations."""

from __future__ import annotations

from nodl.infer.interpreter.calls import MISSING, call_bound
from nodl.infer.interpreter.define import (
    foreign_bases,
    functions_of,
    is_enumeration,
    linearized,
    methods_in,
    new_instance,
    program_classes,
)
from nodl.infer.interpreter.frames import Arguments, Call
from nodl.infer.interpreter.run import Run
from nodl.infer.models import foreign
from nodl.infer.values import (
    BoundMethod,
    ClassValue,
    External,
    ForeignMethod,
    FunctionValue,
    Instance,
    Value,
    unknown,
)


def instantiate(run: Run, cls: ClassValue, call: Call) -> Value:
    """Return a new object: its constructor is the first one in the method resolution order."""
    for base in program_classes(cls):
        run.instantiated.setdefault(base.node)
    if is_enumeration(cls):
        return unknown("a member of an enumeration that is looked up by its value")
    made = _made_by_new(run, cls, call)
    if made is not None:
        return made
    instance = new_instance(run, cls, call)
    initialise(run, cls, instance, call)
    return (instance,)


def _made_by_new(run: Run, cls: ClassValue, call: Call) -> Value | None:
    """Return what the program's own ``__new__`` gives, initialised where it is an object of the class."""
    for base in program_classes(cls):
        if "__new__" in base.cells:
            constructors = functions_of(base.cells["__new__"])
            made = run.call(constructors, call.args.preceded((cls,)), call.node, call.frame)
            for atom in (each for each in made if isinstance(each, Instance)):
                if isinstance(atom.cls, ClassValue) and cls in linearized(atom.cls):
                    initialise(run, atom.cls, atom, call)
            return made
    return None


def initialise(run: Run, cls: ClassValue, instance: Instance, call: Call) -> None:
    """Call the constructor: the first one in the method resolution order."""
    _expect_callbacks(run, cls, instance)
    _expect_operators(run, cls, instance)
    for base in linearized(cls):
        if isinstance(base, ClassValue):
            if base.fields is not None and "__init__" not in base.cells:
                _fill_fields(run, base, instance, call)
                break
            constructor = base.cells.get("__init__")
            if constructor:
                for atom in constructor:
                    if isinstance(atom, FunctionValue):
                        call_bound(run, BoundMethod(atom, instance), call)
                break
        else:
            if isinstance(base, External) and base.path in ("builtins.object", "typing.Generic", "abc.ABC"):
                continue
            path = base.path if isinstance(base, External) else ""
            run.call_atom(ForeignMethod(path, instance, "__init__"), call)
            break


def _fill_fields(run: Run, cls: ClassValue, instance: Instance, call: Call) -> None:
    for index, (name, default) in enumerate(cls.fields or ()):
        value = call.args.at(index, name)
        run.state.store(instance, name, value if value is not None else default or MISSING)
    after = run.attribute((instance,), "__post_init__", call.node, call.frame)
    if isinstance(after[0], BoundMethod):
        run.call(after, Arguments(), call.node, call.frame)


_FOLLOWED = frozenset({
    "__init__", "__new__", "__call__", "__enter__", "__exit__", "__getattr__", "__post_init__", "__init_subclass__",
    "__name__", "__module__", "__doc__", "__slots__", "__class_getitem__", "__set_name__",
})  # fmt: skip


def _expect_operators(run: Run, cls: ClassValue, instance: Instance) -> None:
    """Expect calls of special methods at any time, by operators, iteration, tests and texts; where is not followed."""
    for base in program_classes(cls):
        for name, value in list(base.cells.items()):
            if (
                isinstance(name, str)
                and name.startswith("__")
                and name.endswith("__")
                and name not in _FOLLOWED
            ):
                run.register_callback(methods_in(value, instance, cls), None)


def _expect_callbacks(run: Run, cls: ClassValue, instance: object) -> None:
    """Expect a foreign base class to call the methods that override its own; which ones, only its model knows."""
    seen: set[object] = set()
    hooks = [foreign.hooks_of(base) for base in foreign_bases(cls)]
    if not hooks:
        return
    every = any(names is None for names in hooks)
    wanted = frozenset().union(*(names for names in hooks if names is not None))
    for base in program_classes(cls):
        for name, value in list(base.cells.items()):
            if (
                name not in seen
                and name != "__init__"
                and isinstance(name, str)
                and (every or name in wanted)
            ):
                seen.add(name)
                run.register_callback(methods_in(value, instance, cls), None)
