"""Model ``copy.copy`` and ``copy.deepcopy``: new containers and objects that hold the same contents, or copies."""

from __future__ import annotations

from enclave_addons.inference.interpreter.define import (
    expect_operators,
    foreign_bases,
    is_enumeration,
    program_classes,
)
from enclave_addons.inference.interpreter.run import Call, Run
from enclave_addons.inference.text import Text
from enclave_addons.inference.values import (
    ANY,
    EVERY_FIELD,
    LAZY,
    Absent,
    BoundMethod,
    ClassValue,
    Dictionary,
    External,
    FunctionValue,
    HeapObject,
    Instance,
    Items,
    ModuleValue,
    Sequence,
    Unknown,
    Value,
    join_all,
    unknown,
)

# What a class may define so that its objects are copied in another way (documentation of ``copy`` and ``pickle``).
_HOOKS = frozenset({
    "__copy__", "__deepcopy__", "__reduce__", "__reduce_ex__", "__getstate__", "__setstate__", "__getnewargs__",
    "__getnewargs_ex__", "__new__", "__slots__", "__getattr__", "__getattribute__",
})  # fmt: skip
# A copy of these is the same.
_SAME = (
    str, int, float, bool, bytes, type(None), Text, Unknown, Absent, FunctionValue, ClassValue, ModuleValue, External,
)  # fmt: skip


def copied(run: Run, call: Call, *, deep: bool) -> Value:
    """Copy the first argument; a gap for an object of the program whose copy is not followed."""
    return _Copying(run, call, deep).copy(call.args.at(0) or ANY)


class _Copying:
    """One call of ``copy`` or ``deepcopy``: what it meets twice is copied once."""

    def __init__(self, run: Run, call: Call, deep: bool) -> None:
        self._run = run
        self._call = call
        self._deep = deep
        self._made: dict[HeapObject, HeapObject] = {}

    def copy(self, value: Value) -> Value:
        self._run.spend(len(value))
        return join_all(map(self._copy_atom, value))

    def _copy_atom(self, atom: object) -> Value:
        if isinstance(atom, _SAME):
            return (atom,)
        if isinstance(atom, Items):
            exact = None if atom.exact is None else tuple(map(self.copy, atom.exact))
            return (Items(exact, self.copy(atom.rest)),)
        if isinstance(atom, BoundMethod):
            return tuple(BoundMethod(atom.function, each) for each in self._copy_atom(atom.receiver))
        if isinstance(atom, Sequence) and atom.kind == "tuple":
            items = self.copy((atom.items,))[0] if self._deep else atom.items
            assert isinstance(items, Items)
            return self._run.sequence(self._call.node, "tuple", items)
        if isinstance(atom, Dictionary) or (isinstance(atom, Sequence) and atom.kind != LAZY):
            return (self._copy_cells(atom),)
        if isinstance(atom, Instance) and isinstance(atom.cls, ClassValue):
            return self._copy_instance(atom, atom.cls)
        self._run.escape_value((atom,), opened=False, objects=False)
        return unknown("a copy")

    def _copy_instance(self, atom: Instance, cls: ClassValue) -> Value:
        if is_enumeration(cls):
            return (atom,)
        names = {name for base in (*program_classes(cls), atom) for name in base.cells}
        if foreign_bases(cls) or not _HOOKS.isdisjoint(names):
            self._run.gap(
                self._call.node,
                self._call.frame,
                f"an object of class {cls.name} is copied, which is not followed",
            )
            self._run.escape_value((atom,), opened=False, objects=False)
            return unknown("a copy")
        made = self._copy_cells(atom)
        assert isinstance(made, Instance)
        expect_operators(self._run, cls, made)
        return (made,)

    def _copy_cells(self, source: Dictionary | Sequence | Instance) -> HeapObject:
        """Copy a container or object. Copies of a copy that are made in one place stand for each other."""
        if source in self._made:
            return self._made[source]
        origin = self._run.copied_from.get(source, source)
        made = self._run.allocate(self._call.node, f"copy of {id(origin)}", lambda: _like(source))
        self._run.copied_from[made] = origin
        self._made[source] = made
        made.summary = made.summary or source.summary
        HeapObject.looked_into.add(EVERY_FIELD if isinstance(source, Instance) else id(source.cells))
        for key, value in list(source.cells.items()):
            self._run.state.store(made, key, self.copy(value) if self._deep else value)
        if source.escaped and not made.escaped:
            self._run.state.open(made)
        return made


def _like(source: Dictionary | Sequence | Instance) -> Dictionary | Sequence | Instance:
    if isinstance(source, Instance):
        made = Instance(source.cls)
        made.guards = source.guards
        return made
    if isinstance(source, Sequence):
        return Sequence(source.kind, Items(()))
    empty = Dictionary()
    empty.kind = source.kind
    return empty
