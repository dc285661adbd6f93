"""``collections.namedtuple`` and ``typing.NamedTuple``: a class written out in Python, as the standard library does.

The text below is ours; it is followed like the program's own classes. Fields that are not known make the class unknown.
"""

from __future__ import annotations

import ast
import keyword
from collections.abc import Sequence

from nodl.infer.interpreter.define import define_class
from nodl.infer.interpreter.frames import Call, Frame
from nodl.infer.interpreter.iterate import elements
from nodl.infer.interpreter.run import Model, Run
from nodl.infer.values import BOTTOM, ClassValue, Instance, LocalCells, Value, external, sole, unknown

_UNKNOWN = "the class made by namedtuple()"
_TEXT = """
class {name}(_tuple):
    _fields = __match_args__ = {names!r}
    _field_defaults = {{}}
    def __init__(self{parameters}):
        {settings}
    def __getitem__(self, index):
        return ({values})[index]
    def __iter__(self):
        return ({values})
    def __len__(self):
        return {count}
    def __eq__(self, other):
        return ({values}) == _tuple(other)
    def __add__(self, other):
        return ({values}) + _tuple(other)
    def _asdict(self):
        return {{{entries}}}
    def _replace(self, **changes):
        return _type(self)(**{{**{{{entries}}}, **changes}})
    @_classmethod
    def _make(cls, iterable):
        return cls(*iterable)
"""
_METHODS = (
    "__getitem__", "__iter__", "__len__", "__eq__", "__add__", "_asdict", "_replace", "_make", "_fields",
)  # fmt: skip


def made(run: Run, call: Call) -> Value:
    """``namedtuple('P', 'x y', defaults=...)`` and ``NamedTuple('P', [('x', int), ('y', str)])``."""
    name = sole(call.args.at(0, "typename"))
    fields = _field_names(run, call)
    defaults = _defaults(run, call)
    if not isinstance(name, str) or not name.isidentifier() or fields is None or defaults is None:
        return unknown(_UNKNOWN)
    if len(defaults) > len(fields) or "rename" in call.args.keywords or call.args.more:
        return unknown(_UNKNOWN)
    return _defined(run, name, fields, defaults, call.node, call.frame)


def complete(run: Run, cls: ClassValue, node: ast.AST, frame: Frame) -> None:
    """Give a class statement with base ``typing.NamedTuple`` what such classes have."""
    names = [name for name, _ in cls.fields or ()]
    if not all(_is_field(name) for name in names):
        return
    for atom in _defined(run, cls.name, names, (), node, frame):
        if isinstance(atom, ClassValue):
            for method in _METHODS:
                cls.cells.setdefault(method, atom.cells.get(method, BOTTOM))


def _field_names(run: Run, call: Call) -> list[str] | None:
    given = call.args.at(1, "field_names") or call.args.at(1, "fields") or BOTTOM
    text = sole(given)
    if isinstance(text, str):
        names: Sequence[object] = text.replace(",", " ").split()
    else:
        listed = elements(run, given, call.node, call.frame).exact
        if listed is None:
            return None
        names = [_first(run, each, call) for each in listed]
    found = [name for name in names if isinstance(name, str) and _is_field(name)]
    return found if len(found) == len(names) == len(set(found)) else None


def _first(run: Run, value: Value, call: Call) -> object:
    """A name, or the name of a pair of name and type."""
    atom = sole(value)
    if isinstance(atom, str) or atom is None or isinstance(atom, Instance):
        return atom
    pair = elements(run, value, call.node, call.frame).exact
    return sole(pair[0]) if pair else None


def _is_field(name: str) -> bool:
    return name.isidentifier() and not keyword.iskeyword(name) and not name.startswith("_")


def _defaults(run: Run, call: Call) -> tuple[Value, ...] | None:
    given = call.args.keywords.get("defaults", (None,))
    return () if given == (None,) else elements(run, given, call.node, call.frame).exact


def _defined(
    run: Run, name: str, fields: Sequence[str], defaults: tuple[Value, ...], node: ast.AST, frame: Frame
) -> Value:
    key = (id(node), name, *fields, len(defaults))
    tree = run.templates.get(key)
    if tree is None:
        tree = run.templates[key] = _tree(name, fields, len(defaults), getattr(node, "lineno", 1))
    cells = LocalCells()
    for local, path in (("_tuple", "tuple"), ("_type", "type"), ("_classmethod", "classmethod")):
        cells[local] = external(f"builtins.{path}")
    cells.update({f"_default{index}": value for index, value in enumerate(defaults)})
    around = Frame(frame.module, cells, None, run.state.depth)
    define_class(run, tree, around)
    return around.cells.get(name, BOTTOM) or unknown(_UNKNOWN)


def _tree(name: str, fields: Sequence[str], defaults: int, line: int) -> ast.ClassDef:
    first = len(fields) - defaults
    parameters = [f", {each}" + (f"=_default{i - first}" * (i >= first)) for i, each in enumerate(fields)]
    values = "".join(f"self.{each}, " for each in fields)
    text = _TEXT.format(
        name=name,
        names=tuple(fields),
        parameters="".join(parameters),
        settings="; ".join(f"self.{each} = {each}" for each in fields) or "pass",
        values=values,
        count=len(fields),
        entries=", ".join(f"{each!r}: self.{each}" for each in fields),
    )
    tree = ast.parse(text).body[0]
    assert isinstance(tree, ast.ClassDef)
    for part in ast.walk(tree):
        if isinstance(part, ast.stmt | ast.expr | ast.arg | ast.keyword):
            part.lineno = part.end_lineno = line
    return tree


FUNCTIONS: dict[str, Model] = {"collections.namedtuple": made, "typing.NamedTuple": made}
