"""Python's standard library where it makes names, keeps callables or changes control flow."""

from __future__ import annotations

import os.path
from collections.abc import Callable

from nodl.infer.interpreter.elements import elements
from nodl.infer.interpreter.formatting import as_texts, text_value
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Model, Run
from nodl.infer.models import builtin, options
from nodl.infer.text import Input, concatenations, make_text
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOTTOM,
    COMMAND_LINE,
    NONE,
    ClassValue,
    Dictionary,
    External,
    Instance,
    Items,
    Partial,
    Value,
    constant_strings,
    join,
    present,
    result_of,
    sole,
    unknown,
)

Method = Callable[[Run, Instance, Call], Value]
CONTENTS = "the contents of a file, read when the program runs"


# --- environment, paths ---------------------------------------------------------------------------------------


def _environment(run: Run, call: Call) -> Value:
    default = call.args.at(1, "default") or BOTTOM
    result: Value = BOTTOM
    for name in constant_strings(call.args.at(0) or ANY):
        held = run.environment.get(name, ABSENT)
        result = join(result, present(held))
        if ABSENT[0] not in held:
            continue
        run.options.declare("$" + name, tuple(atom for atom in default if atom is not None))
        result = join(result, (make_text((Input("$" + name, run.options),)),))
    return result or unknown("an environment variable")


def _set_default_environment(run: Run, call: Call) -> Value:
    found = _environment(run, call)
    for name in constant_strings(call.args.at(0) or ANY):
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
        run.register_callback(target, None)
    elif target != NONE:
        run.register_callback((Partial(target, items.exact, tuple(keywords)),), 0)


def _lock(run: Run, call: Call) -> Value:
    return result_of("threading")


def _timer(run: Run, call: Call) -> Value:
    _register_with(run, call.args.at(1, "function") or NONE, call.args.at(2, "args"), None, call)
    return ANY


def _thread_init(run: Run, thread: Instance, call: Call) -> Value:
    _thread(run, call)
    return NONE


# --- containers ---------------------------------------------------------------------------------------------


def _default_dict(run: Run, call: Call) -> Value:
    obj = run.allocate(call.node, "dict", Dictionary)
    obj.default = join(obj.default, tuple(atom for atom in call.args.at(0) or BOTTOM if atom is not None))
    return (obj,)


def _copy(run: Run, call: Call) -> Value:
    """Model ``copy`` and ``deepcopy``: something unknown; a copy of an object of the program is a gap."""
    given = call.args.at(0) or ANY
    run.escape_value(given, opened=False, objects=False)
    if any(isinstance(atom, Instance) and isinstance(atom.cls, ClassValue) for atom in given):
        run.gap(call.node, call.frame, "an object of the program is copied, which is not followed")
    return unknown("a copy")


def _patched(run: Run, call: Call) -> Value:
    run.gap(call.node, call.frame, "unittest.mock replaces something while the program runs")
    return ANY


FUNCTIONS: dict[str, Model] = {
    **{f"unittest.mock.patch{method}": _patched for method in ("", ".object", ".dict", ".multiple")},
    "argparse.ArgumentParser": options.made_parser,
    "os.getenv": _environment,
    "os.environ.get": _environment,
    "os.environ.setdefault": _set_default_environment,
    **dict.fromkeys(("os.environ.update", "os.environ.pop", "os.putenv"), _change_environment),
    "os.path.join": _path_join,
    "functools.partial": _partial,
    **{f"threading.{name}": _lock for name in ("Lock", "RLock", "Condition", "Semaphore", "Event")},
    "threading.Thread": _thread,
    "threading.Timer": _timer,
    "multiprocessing.Process": _thread,
    "collections.defaultdict": _default_dict,
    "collections.OrderedDict": builtin.FUNCTIONS["builtins.dict"],
    "collections.deque": builtin.FUNCTIONS["builtins.list"],
    **dict.fromkeys(("copy.copy", "copy.deepcopy"), _copy),
    "random.choice": builtin.FUNCTIONS["builtins.next"],
    "importlib.import_module": builtin.import_dynamic,
    **dict.fromkeys(
        ("yaml.safe_load", "yaml.load", "json.load", "json.loads"), lambda run, call: unknown(CONTENTS)
    ),
}

METHODS: dict[tuple[str, str], Method] = {
    **options.METHODS,
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
