"""Python's own library, built-in functions included, where it makes names, keeps callables or changes control flow."""

from __future__ import annotations

import ast
import functools
import itertools
import os.path
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from enclave_addons.inference.interpreter.conditions import is_instance, is_of_launch, truth
from enclave_addons.inference.interpreter.define import expect_methods, new_instance, program_classes
from enclave_addons.inference.interpreter.elements import (
    copy_dictionary,
    elements,
    store_attribute,
    store_item,
)
from enclave_addons.inference.interpreter.formatting import as_texts, text_value
from enclave_addons.inference.interpreter.imports import import_module
from enclave_addons.inference.interpreter.run import Arguments, Call, Model, Run
from enclave_addons.inference.models import options
from enclave_addons.inference.models.copies import copied
from enclave_addons.inference.start import NO_LAUNCH
from enclave_addons.inference.text import Input, concatenations, constant_text
from enclave_addons.inference.values import (
    ABSENT,
    ANY,
    BOOLEAN,
    BOTTOM,
    COMMAND_LINE,
    LAZY,
    NONE,
    OF_A_NODE,
    OF_LAUNCH,
    OTHER,
    ClassValue,
    Dictionary,
    External,
    HeapObject,
    Instance,
    Items,
    Key,
    ModuleValue,
    Partial,
    Sequence,
    Value,
    boolean,
    constant_strings,
    external,
    join,
    join_all,
    mixed_with_unknown,
    present,
    result_of,
    sole,
    unknown,
)

MAX_RANGE = 64
MAX_ROWS = 4096


# --- texts and numbers --------------------------------------------------------------------------------------


def _str(run: Run, call: Call) -> Value:
    value = call.args.at(0)
    return ("",) if value is None else text_value(as_texts(value))


def _int(run: Run, call: Call) -> Value:
    return OF_LAUNCH if is_of_launch(sole(call.args.at(0))) else _number(int, run, call)


def _number(kind: Callable[[Any], object], run: Run, call: Call) -> Value:
    """Return a number made of a number, or in a launch of a text: there it is what the command line says.

    Where that ends in an error, or takes long, nothing is known.
    """
    atom = constant_text(sole(call.args.at(0)))
    readable = isinstance(atom, int | float) or (isinstance(atom, str) and run.launch is not NO_LAUNCH)
    if not readable or len(call.args.positional) != 1 or len(str(atom)) > _LONGEST_NUMBER:
        return ANY
    try:
        return (kind(atom),)
    except (ValueError, OverflowError):
        return ANY


_LONGEST_NUMBER = 40


def _bool(run: Run, call: Call) -> Value:
    value = call.args.at(0) or (False,)
    known = truth(value)
    return OF_LAUNCH if known is None and any(map(is_of_launch, value)) else boolean(known)


def _len(run: Run, call: Call) -> Value:
    """Return the number of letters, or of elements where all are known."""
    atom = constant_text(sole(call.args.at(0)))
    if isinstance(atom, str):
        return (len(atom),)
    if is_of_launch(atom):
        return OF_LAUNCH
    if not isinstance(atom, Sequence | Dictionary) or (isinstance(atom, Sequence) and atom.kind == "set"):
        return ANY
    exact = elements(run, (atom,), call.node, call.frame).exact
    return ANY if exact is None else (len(exact),)


# --- containers ---------------------------------------------------------------------------------------------


def _items(run: Run, call: Call, index: int = 0) -> Items:
    """Return the elements of the argument at ``index``; an empty sequence when it is not given."""
    value = call.args.at(index)
    return Items(()) if value is None else elements(run, value, call.node, call.frame)


def _range(run: Run, call: Call) -> Value:
    """Return the numbers if they are known and few; else any number."""
    bounds = [sole(value) for value in call.args.positional]
    items = Items(None, unknown("a number of a loop"))
    if not bounds or call.args.more:  # range(*bounds)
        return run.sequence(call.node, "tuple", items)
    integers = [bound for bound in bounds if isinstance(bound, int)]
    if len(integers) == len(bounds) and (len(bounds) in (1, 2) or (len(bounds) == 3 and integers[2])):
        numbers = range(*integers)
        if len(numbers) <= MAX_RANGE:
            items = Items(tuple((number,) for number in numbers))
    return run.sequence(call.node, "tuple", items)


def _made(kind: str) -> Model:
    return lambda run, call: run.sequence(call.node, kind, _items(run, call))


def _iter(run: Run, call: Call) -> Value:
    """Return an iterator; one that calls a function is unknown."""
    if len(call.args.positional) > 1:
        run.escape(call.args)
        return ANY
    return run.sequence(call.node, LAZY, _items(run, call))


def _enumerate(run: Run, call: Call) -> Value:
    """Return a list of pairs; one pair stands for all if the length or the start is not known."""
    items = _items(run, call)
    start = sole(call.args.at(1, "start") or (0,))
    if items.exact is not None and type(start) is int:
        pairs = tuple(run.tuple_of(((start + index,), element)) for index, element in enumerate(items.exact))
        return run.sequence(call.node, LAZY, Items(pairs))
    pair = run.tuple_of((unknown("a number of a loop"), items.any_element() or ANY))
    return run.sequence(call.node, LAZY, Items(None, pair))


def _rows(run: Run, call: Call, combine: Callable[..., Iterable[tuple[Value, ...]]]) -> Value:
    """Return the rows of lists that are all known; unknown otherwise, since nobody knows what goes with what."""
    columns = [elements(run, value, call.node, call.frame) for value in call.args.positional]
    known = [column.exact for column in columns if column.exact is not None]
    if call.args.more or call.args.keywords.keys() - {"strict"} or len(known) < len(columns):
        return ANY
    rows = tuple(run.tuple_of(row) for row in itertools.islice(combine(*known), MAX_ROWS + 1))
    if len(rows) > MAX_ROWS:
        return ANY
    return run.sequence(call.node, LAZY, Items(rows))


def _sorted(run: Run, call: Call) -> Value:
    """Return a list of any of the elements, in any order."""
    element = _items(run, call).any_element()
    run.escape_value(call.args.keywords.get("key", NONE))
    return run.sequence(call.node, "list", Items(None, element))


def _set(run: Run, call: Call) -> Value:
    return run.sequence(call.node, "set", Items(None, _items(run, call).any_element()))


def _map(run: Run, call: Call) -> Value:
    """Call the function for any of the elements."""
    given = [_items(run, call, index).any_element() or ANY for index in range(1, len(call.args.positional))]
    arguments = Arguments(given, more=call.args.more)
    mark = run.state.mark()
    element = run.call(call.args.at(0) or ANY, arguments, call.node, call.frame)
    run.changes_at_any_time(run.state.seen(mark), certainly=True)
    run.state.join_seen(mark, mixed=True)
    return run.sequence(call.node, LAZY, Items(None, element))


def _dict(run: Run, call: Call) -> Value:
    """Make a dictionary of dictionaries, pairs and keywords; keys that are not constant go under ``OTHER``."""
    obj = run.allocate(call.node, "dict", Dictionary)
    fill(run, obj, call)
    return (obj,)


def fill(run: Run, obj: Dictionary, call: Call) -> None:
    """Add what ``dict`` and ``dict.update`` are given to ``obj``."""
    given = call.args.at(0) or BOTTOM
    pairs = _pairs(run, given, call)
    for key, value in pairs or ():
        store_item(run, obj, key, value)
    for atom in given if pairs is None else BOTTOM:
        copy_dictionary(run, obj, (atom,))
    for name, value in call.args.keywords.items():
        run.state.store(obj, Key(name), value)
    if call.args.more_keywords:
        run.state.store(obj, OTHER, join(obj.cells.get(OTHER, BOTTOM), call.args.more_keywords))


def _pairs(run: Run, given: Value, call: Call) -> list[tuple[Value, Value]] | None:
    """Return the pairs of a list that is known in full, ``None`` if it is none."""
    if not isinstance(sole(given), Sequence):
        return None
    rows = elements(run, given, call.node, call.frame).exact
    known = [elements(run, row, call.node, call.frame).exact for row in rows or ()]
    pairs = [(row[0], row[1]) for row in known if row is not None and len(row) == 2]
    return pairs if rows is not None and len(pairs) == len(known) else None


def chosen(run: Run, call: Call) -> Value:
    """Model ``next``, ``random.choice``: one of the elements."""
    if len(call.args.positional) > 1 and not call.args.more:
        return join_all((*call.args.positional, _items(run, call).any_element())) or ANY
    return _items(run, call).any_element() or ANY


# --- attributes and classes ---------------------------------------------------------------------------------


def _getattr(run: Run, call: Call) -> Value:
    """Return the attribute, the default or either."""
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    known = constant_strings(names)
    looks = (partial(run.attribute, owner, name, call.node, call.frame) for name in known)
    found = join_all(map(run.swallowed, looks))
    if len(known) < len(names):
        expect_methods(run, owner)
        for atom in owner:
            if isinstance(atom, Instance):
                for held in list(atom.cells.values()):
                    run.escape_value(held, opened=False, objects=False)
        if any(isinstance(atom, (ModuleValue, ClassValue)) for atom in owner):
            run.gap(
                call.node,
                call.frame,
                "something of a module or class is looked up by a name made at run time",
            )
        is_node = any(atom in run.findings.node_of for atom in owner)
        found = join(found, unknown(OF_A_NODE if is_node else "an attribute whose name is made at run time"))
    default = call.args.at(2)
    certain = default is None or all(_has_attribute(atom, name) for atom in owner for name in names)
    return found if certain else join(found, default or BOTTOM)


def _has_attribute(atom: object, name: object) -> bool:
    """Return True if an object certainly has the attribute: a field that is set, or a method of its class."""
    if not isinstance(atom, Instance) or not isinstance(atom.cls, ClassValue):
        return False
    held = atom.cells.get(name)
    if held and ABSENT[0] not in held and not atom.summary:
        return True
    body = [statement for cls in program_classes(atom.cls) for statement in cls.node.body]
    methods = (each for each in body if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef))
    return any(method.name == name for method in methods)


def _hasattr(run: Run, call: Call) -> Value:
    """Look the attribute up, which may run a property; whether there is one stays open."""
    for name in constant_strings(call.args.at(1) or ANY):
        look = partial(run.attribute, call.args.at(0) or ANY, name, call.node, call.frame)
        run.state.perhaps(partial(run.swallowed, look))
    return BOOLEAN


def _setattr(run: Run, call: Call) -> Value:
    """Set one of the named attributes; one that may be another one is a gap, unless a library holds the object."""
    owner, names = call.args.at(0) or ANY, call.args.at(1) or ANY
    value = call.args.at(2) or ANY
    known = constant_strings(names)
    for name in known:
        if len(names) > 1:
            value = join(value, run.attribute(owner, name, call.node, call.frame))
        store_attribute(run, owner, name, value, call.node, call.frame)
    if len(known) < len(names):
        run.escape_value(value)
        for atom in owner:
            if isinstance(atom, HeapObject):
                run.gap(call.node, call.frame, "an attribute whose name is made at run time is set")
    return NONE


def _type(run: Run, call: Call) -> Value:
    """Return the class of an object, else unknown; with three arguments, a class that is not followed.

    It is no gap if ``object`` alone is its base.
    """
    if len(call.args.positional) == 3:
        bases = sole(call.args.at(1))
        listed = bases.items.exact if isinstance(bases, Sequence) else None
        if listed is None or any(each != external("builtins.object") for each in listed):
            run.gap(call.node, call.frame, "a class is made at run time (type)")
        run.escape(call.args)
        return unknown("a class made at run time")
    atom = sole(call.args.at(0))
    return (atom.cls,) if isinstance(atom, Instance) else ANY


def _isinstance(run: Run, call: Call) -> Value:
    value = call.args.at(0) or ANY
    outcome = is_instance(value, call.args.at(1) or ANY)
    return OF_LAUNCH if outcome is None and any(map(is_of_launch, value)) else boolean(outcome)


def _dynamic_code(run: Run, call: Call) -> Value:
    run.gap(call.node, call.frame, "code made at run time (eval, exec) is not analysed")
    return unknown("the result of code made at run time")


def import_dynamic(run: Run, call: Call) -> Value:
    """Model ``import_module(name)`` and ``__import__``: the module; a gap if its name is not known."""
    name = sole(call.args.at(0))
    if isinstance(name, str) and not name.startswith("."):
        return import_module(run, name, call.frame)
    run.gap(call.node, call.frame, "a module whose name is made at run time is not analysed")
    return unknown("a module whose name is made at run time")


def _variables(run: Run, call: Call) -> Value:
    """Model ``vars``, ``globals``, ``locals``."""
    given = sole(call.args.at(0))
    if options.is_namespace(given) and call.node in _spread(call.frame.module.source.tree):
        return options.as_dictionary(run, given, call)
    return run.variables_of(call.node, call.frame)


@functools.lru_cache(maxsize=64)
def _spread(tree: ast.Module) -> frozenset[ast.AST]:
    """Return the expressions passed as ``**``. The call copies such a mapping, so that it cannot be changed."""
    keywords = (node for node in ast.walk(tree) if isinstance(node, ast.keyword))
    return frozenset(node.value for node in keywords if node.arg is None)


def _object_new(run: Run, call: Call) -> Value:
    """Model ``object.__new__(cls)``: an object whose constructor has not run."""
    made: list[object] = []
    for atom in call.args.at(0) or ANY:
        if isinstance(atom, ClassValue):
            for base in program_classes(atom):
                run.instantiated.setdefault(base.node)
            made.append(new_instance(run, atom, call))
        else:
            made.append(unknown("an object of a class that is not known")[0])
    return tuple(made)


_BUILT_IN: dict[str, Callable[[Run, Call], Value]] = {
    f"builtins.{name}": model
    for name, model in {
        "str": _str,
        "int": _int,
        "float": lambda run, call: _number(float, run, call),
        "bool": _bool,
        "len": _len,
        "range": _range,
        "list": _made("list"),
        "tuple": _made("tuple"),
        **dict.fromkeys(("set", "frozenset"), _set),
        "iter": _iter,
        "reversed": lambda run, call: run.sequence(
            call.node, LAZY, Items(None, _items(run, call).any_element())
        ),
        "sorted": _sorted,
        "enumerate": _enumerate,
        "zip": lambda run, call: _rows(run, call, zip),
        "map": _map,
        "dict": _dict,
        "next": lambda run, call: mixed_with_unknown(chosen(run, call)),
        "getattr": _getattr,
        "setattr": _setattr,
        "type": _type,
        **dict.fromkeys(("any", "all", "callable"), lambda run, call: BOOLEAN),
        "hasattr": _hasattr,
        "isinstance": _isinstance,
        **dict.fromkeys(("eval", "exec", "compile"), _dynamic_code),
        "__import__": import_dynamic,
        **dict.fromkeys(("vars", "globals", "locals"), _variables),
        "input": lambda run, call: unknown("text that the user types"),
        "object": lambda run, call: ANY,
        "object.__new__": _object_new,
        "object.__init_subclass__": lambda run, call: NONE,
    }.items()
}


Method = Callable[[Run, Instance, Call], Value]


# --- environment, paths ---------------------------------------------------------------------------------------


def _environment(run: Run, call: Call, otherwise: Value = NONE) -> Value:
    default = call.args.at(1, "default") or otherwise
    names = call.args.at(0) or ANY
    known = constant_strings(names)
    result: Value = unknown("an environment variable") if len(known) < len(names) else BOTTOM
    for name in known:
        held = run.environment.get(name, ABSENT)
        result = join(result, present(held))
        if ABSENT[0] not in held:
            continue
        run.options.declare("$" + name, tuple(atom for atom in default if atom is not None))
        settled = run.launch.inputs.get("$" + name)
        if settled is not None or ("$" + name in run.launch.inputs and default):
            result = join(result, default if settled is None else (settled,))
            continue
        result = join(result, run.of_launch(Input("$" + name, run.options)))
    return result


def _set_default_environment(run: Run, call: Call) -> Value:
    found = _environment(run, call)
    names = call.args.at(0) or ANY
    if len(constant_strings(names)) < len(names):
        return _change_environment(run, call)
    for name in constant_strings(names):
        run.state.write(run.environment, name, found)
    return found


def _change_environment(run: Run, call: Call) -> Value:
    run.gap(call.node, call.frame, "environment variables are changed in a way that is not modelled")
    return ANY


def _path_join(run: Run, call: Call) -> Value:
    parts = [sole(value) for value in call.args.positional]
    if parts and not call.args.more and all(isinstance(part, str) for part in parts):
        return (os.path.join(*(str(part) for part in parts)),)
    operands = [as_texts(value) for value in call.args.positional]
    separated = [texts for operand in operands for texts in (operand, ["/"])][:-1]
    return text_value(concatenations(separated)) if separated else ANY


def _base_name(run: Run, call: Call) -> Value:
    path = constant_text(sole(call.args.at(0)))
    if isinstance(path, str):
        return (os.path.basename(path),)
    return OF_LAUNCH if is_of_launch(path) else unknown("the last part of a path")


# --- callables ----------------------------------------------------------------------------------------------


def _partial(run: Run, call: Call) -> Value:
    function = call.args.at(0) or ANY
    keywords = tuple(call.args.keywords.items())
    return (Partial(function, tuple(call.args.positional[1:]), keywords),)


def _thread(run: Run, call: Call) -> Value:
    """Model ``Thread(target=f, args=(...))``: it calls ``f`` with these arguments, some time later."""
    target = call.args.at(1, "target") or NONE
    _register_with(run, target, call.args.keywords.get("args"), call.args.keywords.get("kwargs"), call)
    return (run.library_object(call, "threading.Thread"),)


def _register_with(run: Run, target: Value, args: Value | None, kwargs: Value | None, call: Call) -> None:
    keywords: list[tuple[str, Value]] = []
    for atom in kwargs or BOTTOM:
        if isinstance(atom, Dictionary):
            for cell, value, _ in atom.entries():
                if isinstance(cell.constant, str):
                    keywords.append((cell.constant, value))
    items = Items(()) if args is None else elements(run, args, call.node, call.frame)
    if items.exact is None:
        run.register_callback(target, None, run.state.mark())
    elif target != NONE:
        run.register_callback((Partial(target, items.exact, tuple(keywords)),), 0, run.state.mark())


LOCKS = result_of("threading")  # locks and events: they give nothing of the program back


def _lock(run: Run, call: Call) -> Value:
    return LOCKS


def _thread_init(run: Run, thread: Instance, call: Call) -> Value:
    _thread(run, call)
    return NONE


# --- containers ---------------------------------------------------------------------------------------------


def _patched(run: Run, call: Call) -> Value:
    run.gap(call.node, call.frame, "unittest.mock replaces something while the program runs")
    return ANY


FUNCTIONS: dict[str, Model] = {
    **_BUILT_IN,
    **{f"unittest.mock.patch{method}": _patched for method in ("", ".object", ".dict", ".multiple")},
    "argparse.ArgumentParser": options.made_parser,
    "os.getenv": _environment,
    "os.environ.get": _environment,
    "os.environ.__getitem__": partial(_environment, otherwise=BOTTOM),
    "os.environ.setdefault": _set_default_environment,
    **dict.fromkeys(("os.environ.update", "os.environ.pop", "os.putenv"), _change_environment),
    "os.path.join": _path_join,
    "os.path.basename": _base_name,
    "functools.partial": _partial,
    "itertools.product": lambda run, call: _rows(run, call, itertools.product),
    **{f"threading.{name}": _lock for name in ("Lock", "RLock", "Condition", "Semaphore", "Event")},
    "threading.Thread": _thread,
    "multiprocessing.Process": _thread,
    "collections.OrderedDict": _BUILT_IN["builtins.dict"],
    "collections.deque": _BUILT_IN["builtins.list"],
    "copy.copy": partial(copied, deep=False),
    "copy.deepcopy": partial(copied, deep=True),
    "random.choice": _BUILT_IN["builtins.next"],
    **dict.fromkeys(("importlib.import_module", "importlib.reload"), import_dynamic),
}


def _object_setattr(run: Run, receiver: Instance, call: Call) -> Value:
    """Set an attribute past the class's own ``__setattr__``, as a frozen dataclass does in ``__post_init__``."""
    return _setattr(run, Call(call.args.preceded((receiver,)), call.node, call.frame))


METHODS: dict[tuple[str, str], Method] = {
    **options.METHODS,
    ("builtins.object", "__setattr__"): _object_setattr,
    ("threading.Thread", "__init__"): _thread_init,
    ("multiprocessing.Process", "__init__"): _thread_init,
}


OPEN_ATTRIBUTES: dict[str, Callable[[Run, Instance, str], Value]] = {
    options.NAMESPACE: options.namespace_attribute,
}

# Methods of a subclass that the base class calls.
HOOKS: dict[str, frozenset[str]] = {
    **{
        f"builtins.{name}": frozenset()
        for name in ("object", "dict", "list", "tuple", "str", "int", "Exception")
    },
    **{f"enum.{name}": frozenset() for name in ("Enum", "IntEnum", "StrEnum", "Flag")},
    **{f"typing.{name}": frozenset() for name in ("NamedTuple", "Generic", "Protocol")},
    "abc.ABC": frozenset(),
    "threading.Thread": frozenset({"run"}),
    "multiprocessing.Process": frozenset({"run"}),
}

CONSTANTS: dict[str, Value] = {
    "sys.argv": unknown(COMMAND_LINE),
    "sys.platform": ("linux",),
    "os.sep": ("/",),
    "os.name": ("posix",),
    "typing.TYPE_CHECKING": (False,),
    "rclpy.action.client.ActionClient": (External("rclpy.action.ActionClient"),),
}
