"""Where the program meets code of others: calls and methods that only models can answer.

What no model knows gives an unknown result and may call every callable that it is handed. A node that is handed to
unknown code is a gap.
"""

from __future__ import annotations

import ast
import itertools
import os.path
import sys
from collections.abc import Callable
from typing import Any

from enclave_addons.inference.kernel.texts import Input, Text, concatenations
from enclave_addons.inference.kernel.values import (
    ABSENT,
    ANY,
    BOOLEAN,
    BOTTOM,
    CONSTANTS,
    NONE,
    OF_LAUNCH,
    RANDOM,
    External,
    Items,
    Key,
    Obj,
    Unknown,
    Value,
    boolean,
    external,
    join,
    join_all,
    sole,
    strings,
    unknown,
)
from enclave_addons.inference.models.rclpy import (
    COMMON_CALLBACKS,
    NODE_ENDPOINTS,
    may_make_nodes,
)
from enclave_addons.inference.python import arguments, rclpy_models
from enclave_addons.inference.python.classes import new_instance
from enclave_addons.inference.python.conditions import classes_in, is_instance, read_truth
from enclave_addons.inference.python.containers import (
    call_container,
    elements,
    from_dictionary,
    iterate_call,
    new_dictionary,
)
from enclave_addons.inference.python.formatting import as_texts, text_value
from enclave_addons.inference.python.objects import (
    Arguments,
    Bound,
    Call,
    Class,
    ForeignMethod,
    Function,
    Method,
    Partial,
    Property,
)
from enclave_addons.inference.python.run import CALLS, COMMAND_LINE, MAX_EXACT, Model, Run
from enclave_addons.inference.python.run import CONSTANTS as LIBRARY_CONSTANTS

# --- Python's own library -----------------------------------------------------------------------------------


def _items(run: Run, call: Call, index: int = 0) -> Items:
    value = call.at(index)
    return Items(()) if value is None else elements(run, value)


def _str(run: Run, call: Call) -> Value:
    value = call.at(0)
    if value is None:
        return ("",)
    atom = sole(value)
    if isinstance(atom, Obj) and isinstance(atom.cls, Class):
        own = [each for each in run.class_attribute(atom.cls, "__str__") if isinstance(each, Function)]
        if own:
            return run.call((Bound(own[0], atom),), Arguments(), call.node, call.frame)
    return text_value(as_texts(value))


def _number(kind: Callable[[Any], object]) -> Model:
    def model(run: Run, call: Call) -> Value:
        atom = sole(call.at(0))
        if isinstance(atom, Text):
            return OF_LAUNCH
        if isinstance(atom, Unknown) and atom.why == RANDOM:
            return (atom,)
        if not isinstance(atom, (int, float, str)) or len(str(atom)) > 40 or len(call.args.positional) != 1:
            return ANY
        try:
            return (kind(atom),)
        except (ValueError, OverflowError):
            return ANY

    return model


def _bool(run: Run, call: Call) -> Value:
    return boolean(read_truth(run, call.at(0) or (False,)))


def _len(run: Run, call: Call) -> Value:
    atom = sole(call.at(0))
    if isinstance(atom, str):
        return (len(atom),)
    if isinstance(atom, Text):
        return OF_LAUNCH
    exact = elements(run, (atom,)).exact if isinstance(atom, Obj) and atom.kind != "instance" else None
    return ANY if exact is None else (len(exact),)


def _range(run: Run, call: Call) -> Value:
    bounds = [sole(value) for value in call.args.positional]
    integers = [bound for bound in bounds if isinstance(bound, int)]
    if (
        integers
        and len(integers) == len(bounds)
        and (len(integers) < 3 or integers[2])
        and not call.args.more
    ):
        numbers = range(*integers)
        if len(numbers) <= MAX_EXACT:
            return run.tuple_of(*((number,) for number in numbers))
    return run.sequence(call.node, "list", Items(None, unknown("a number of a loop")), "range")


def _made(kind: str) -> Model:
    return lambda run, call: run.sequence(call.node, kind, _items(run, call))


def _set(run: Run, call: Call) -> Value:
    items = _items(run, call)
    exact = items.exact
    if exact is not None:
        distinct = dict.fromkeys(exact)
        items = (
            Items(tuple(distinct))
            if all(isinstance(sole(each), CONSTANTS) for each in exact)
            else Items(exact)
        )
    return run.sequence(call.node, "set", items)


def _sorted(run: Run, call: Call) -> Value:
    items = _items(run, call)
    words = [sole(each) for each in items.exact or ()]
    if items.exact is not None and all(isinstance(each, str) for each in words) and not call.args.keywords:
        return run.sequence(call.node, "list", Items(tuple((word,) for word in sorted(map(str, words)))))
    return run.sequence(call.node, "set", items)  # the same elements, in an order that is not known


def _reversed(run: Run, call: Call) -> Value:
    items = _items(run, call)
    return run.sequence(
        call.node, "lazy", items._replace(exact=items.exact[::-1] if items.exact is not None else None)
    )


def _enumerate(run: Run, call: Call) -> Value:
    items, start = _items(run, call), sole(call.at(1, "start") or (0,))
    if items.exact is not None and isinstance(start, int):
        return run.tuple_of(*(run.tuple_of((start + i,), each) for i, each in enumerate(items.exact)))
    row = run.tuple_of(unknown("a number of a loop"), items.any_element() or ANY)
    return run.sequence(call.node, "list", Items(None, row), "enumerate")


def _rows(combine: Callable[..., Any]) -> Model:
    def model(run: Run, call: Call) -> Value:
        columns = [elements(run, value) for value in call.args.positional]
        known = [column.exact for column in columns if column.exact is not None]
        if call.args.more or call.args.keywords.keys() - {"strict"} or len(known) < len(columns):
            row = run.tuple_of(*(column.any_element() or ANY for column in columns))
            return run.sequence(call.node, "list", Items(None, row), "rows") if len(columns) == 1 else ANY
        rows = [run.tuple_of(*row) for _, row in zip(range(MAX_EXACT + 1), combine(*known), strict=False)]
        return run.tuple_of(*rows) if len(rows) <= MAX_EXACT else ANY

    return model


def _chain(run: Run, call: Call) -> Value:
    lists = [elements(run, value) for value in call.args.positional]
    exact = [each.exact for each in lists if each.exact is not None]
    if len(exact) == len(lists):
        return run.tuple_of(*(element for each in exact for element in each))
    return run.sequence(
        call.node, "list", Items(None, join_all(each.any_element() for each in lists)), "chain"
    )


def _map(run: Run, call: Call) -> Value:
    if len(call.args.positional) != 2:
        return ANY
    return run.sequence(
        call.node, "lazy", iterate_call(run, call.at(0) or ANY, call.at(1) or ANY, call), "map"
    )


def _filter(run: Run, call: Call) -> Value:
    items = _items(run, call, 1)
    kept: list[Value] = []
    for element in items.exact or ():
        test = (
            element
            if call.at(0) == NONE
            else run.call(call.at(0) or ANY, Arguments([element]), call.node, call.frame)
        )
        outcome = read_truth(run, test)
        if outcome is None:
            return run.sequence(call.node, "list", Items(None, items.any_element()), "filter")
        kept += [element] if outcome else []
    known = items.exact is not None
    return run.sequence(call.node, "list", Items(tuple(kept)) if known else Items(None, items.rest), "filter")


def _dict(run: Run, call: Call) -> Value:
    return new_dictionary(run, call, call.at(0) or BOTTOM, call.args.keywords, call.args.more_keywords)


def _default_dict(run: Run, call: Call) -> Value:
    obj = run.allocate(call.node, "dict")
    return (obj,)


def _chosen(run: Run, call: Call) -> Value:
    found = _items(run, call).any_element() or ANY
    return join(found, call.at(1) or BOTTOM)


def _getattr(run: Run, call: Call) -> Value:
    owner, names, default = call.at(0) or ANY, call.at(1) or ANY, call.at(2)
    found: Value = BOTTOM
    for name in strings(names):
        value = run.attribute(owner, name, call.node, call.frame)
        if default is not None and not all(_has(run, atom, name) for atom in owner):
            value = join(tuple(a for a in value if not isinstance(a, (Unknown, ForeignMethod))), default)
        found = join(found, value)
    if len(strings(names)) < len(names):
        _methods_by_unknown_name(run, owner, call)
        found = join(found, unknown("an attribute whose name is made at run time"))
    return found


def _has(run: Run, atom: object, name: str) -> bool:
    """Return whether an object certainly has the attribute."""
    if not isinstance(atom, Obj):
        return False
    classes = atom.cls.classes() if isinstance(atom.cls, Class) else []
    held = [run.store.read(each.cells, name) for each in (atom, *classes)]
    return any(each and ABSENT[0] not in each for each in held)


def _methods_by_unknown_name(run: Run, owner: Value, call: Call) -> None:
    """Expect that any method is called whose name a text may give."""
    for atom in owner:
        cls = atom.cls if isinstance(atom, Obj) else None
        for base in cls.classes() if isinstance(cls, Class) else ():
            for name, value in list(base.cells.items()):
                for each in value:
                    if (
                        isinstance(each, Function)
                        and name != "__init__"
                        and run.creates(base.module.source, each.node)
                    ):
                        run.call_later((Bound(each, atom),), Arguments(more=ANY), call)


def _hasattr(run: Run, call: Call) -> Value:
    names = strings(call.at(1) or ANY)
    return (True,) if names and all(_has(run, a, n) for a in call.at(0) or ANY for n in names) else BOOLEAN


def _setattr(run: Run, call: Call) -> Value:
    owner, names, value = call.at(0) or ANY, call.at(1) or ANY, call.at(2) or ANY
    for name in strings(names):
        kept = run.attribute(owner, name, call.node, call.frame) if len(names) > 1 else BOTTOM
        run.set_attribute(owner, name, join(value, kept), call.node, call.frame)
    if len(strings(names)) < len(names) and any(isinstance(atom, (Function, Bound)) for atom in value):
        run.gap(call.source, "a function is set as an attribute whose name is made at run time")
    return NONE


def _type(run: Run, call: Call) -> Value:
    if len(call.args.positional) == 3:
        bases = elements(run, call.at(1) or ANY).exact
        if bases is None or any(each != external("builtins.object") for each in bases):
            run.gap(call.source, "a class is made at run time (type)")
        return unknown("a class made at run time")
    atom = sole(call.at(0))
    return (atom.cls,) if isinstance(atom, Obj) and isinstance(atom.cls, Class) else ANY


def _isinstance(run: Run, call: Call) -> Value:
    kinds = classes_in(run, call.at(1) or ANY)
    if kinds is None:
        return BOOLEAN
    outcomes = {is_instance(atom, kinds) for atom in call.at(0) or ANY}
    return boolean(outcomes.pop()) if len(outcomes) == 1 else BOOLEAN


def _dynamic_code(run: Run, call: Call) -> Value:
    run.gap(call.source, "code made at run time (eval, exec) is not analysed")
    return unknown("the result of code made at run time")


def _import_dynamic(run: Run, call: Call) -> Value:
    name = sole(call.at(0))
    if isinstance(name, str) and not name.startswith("."):
        return run.import_module(name, call.frame)
    last = name.pieces[-1] if isinstance(name, Text) else ""
    if not (isinstance(last, str) and last.endswith((".msg", ".srv", ".action"))):
        run.gap(call.source, "a module whose name is made at run time is not analysed")
    return unknown("a module whose name is made at run time")


def _object_new(run: Run, call: Call) -> Value:
    made = [new_instance(run, atom, call) for atom in call.at(0) or ANY if isinstance(atom, Class)]
    return tuple(made) or ANY


_SET_BY_ROS: dict[str, Value] = {"ROS_VERSION": ("2",), "ROS_PYTHON_VERSION": ("3",)}


def _environment(run: Run, call: Call) -> Value:
    """Return what a variable holds; ``os.environ[...]``, ``.get`` and ``getenv`` with a default."""
    names, default = call.at(0) or ANY, call.at(1, "default") or NONE
    result: Value = BOTTOM if len(strings(names)) == len(names) else unknown("an environment variable")
    for name in strings(names):
        held = run.store.read(run.environment, name) or _SET_BY_ROS.get(name)
        if held:
            result = join(result, held)
            continue
        options, given = run.findings.options, run.launch.inputs
        options.declare("$" + name, tuple(atom for atom in default if atom is not None))
        if "$" + name in given:
            value = given["$" + name]
            result = join(result, default if value is None else (value,))
        else:
            result = join(result, run.of_launch(Input("$" + name, options)))
    return result


def _set_environment(run: Run, call: Call) -> Value:
    for name in strings(call.at(0) or ANY):
        run.store.write(run.environment, name, call.at(1) or ANY)
    return NONE


def _path_join(run: Run, call: Call) -> Value:
    parts = [sole(value) for value in call.args.positional]
    if parts and not call.args.more and all(isinstance(part, str) for part in parts):
        return (os.path.join(*map(str, parts)),)
    operands = [texts for value in call.args.positional for texts in (as_texts(value), ["/"])][:-1]
    return text_value(concatenations(operands)) if operands else ANY


def _base_name(run: Run, call: Call) -> Value:
    path = sole(call.at(0))
    return (os.path.basename(path),) if isinstance(path, str) else ANY


def _split_extension(run: Run, call: Call) -> Value:
    path = sole(call.at(0))
    return run.tuple_of(*((part,) for part in os.path.splitext(path))) if isinstance(path, str) else ANY


def _named_tuple(run: Run, call: Call) -> Value:
    """``namedtuple('P', 'a b')``: a class whose objects have these fields."""
    fields = sole(call.at(1, "field_names"))
    names = (
        str(fields).replace(",", " ").split()
        if isinstance(fields, str)
        else strings(_items(run, call, 1).any_element())
    )
    annotated = "\n".join(f" {name}: object" for name in names if name.isidentifier()) or " pass"
    tree = (
        ast.parse(f"class {sole(call.at(0))}:\n{annotated}")
        if isinstance(sole(call.at(0)), str)
        else ast.parse("")
    )
    if not tree.body or not isinstance(tree.body[0], ast.ClassDef):
        return ANY

    def make() -> Class:
        made = Class(tree.body[0], call.frame.module)  # type: ignore[arg-type]
        made.is_dataclass = True
        return made

    return (run.remembered(call.node, "namedtuple", make),)


def _partial(run: Run, call: Call) -> Value:
    return (Partial(call.at(0) or ANY, tuple(call.args.positional[1:]), tuple(call.args.keywords.items())),)


def _thread(run: Run, call: Call) -> Value:
    """``Thread(target=f, args=(...))`` calls ``f`` some time later."""
    target = call.at(1, "target") or call.at(1, "function") or BOTTOM
    given = call.at(-1, "args") or (call.at(2) if len(call.args.positional) > 2 else None)
    items = Items(()) if given is None else elements(run, given)
    args = Arguments(list(items.exact)) if items.exact is not None else Arguments(more=items.rest or ANY)
    kwargs = sole(call.at(-1, "kwargs"))
    if isinstance(kwargs, Obj) and kwargs.kind == "dict":
        from_dictionary(run, kwargs, args)
    run.call_later(target, args, call)
    return (run.library_object(call, "threading.Thread"),)


def _copy(run: Run, call: Call) -> Value:
    found: Value = BOTTOM
    for atom in call.at(0) or ANY:
        if isinstance(atom, Obj) and atom.kind in ("list", "set", "dict"):
            found = join(found, call_container(run, atom, "copy", call))
        elif isinstance(atom, Obj) and atom.kind == "instance":
            made = run.allocate(call.node, "instance", atom.cls, f"copy of {id(atom)}")
            for key, value in list(atom.cells.items()):
                run.store.store(made, key, value)
            found = join(found, (made,))
        else:
            found = join(found, (atom,))
    return found


def _exit(run: Run, call: Call) -> Value:
    run.ended = True
    return BOTTOM


def _vars(run: Run, call: Call) -> Value:
    given = sole(call.at(0))
    if isinstance(given, Obj) and isinstance(given.cls, External) and given.cls.path == arguments.NAMESPACE:
        return arguments.as_dictionary(run, given, call)
    return unknown("variables as a mapping")


def _globals(run: Run, call: Call) -> Value:
    made = run.allocate(call.node, "dict", tag="globals")
    for name, value in list(call.frame.module.cells.items()):
        run.store.store(made, Key(name), value)
    return (made,)


def _random(run: Run, call: Call) -> Value:
    return unknown(RANDOM)


def _callable(run: Run, call: Call) -> Value:
    atom = sole(call.at(0))
    return (True,) if isinstance(atom, (Function, Bound, Class, Partial)) else BOOLEAN


FUNCTIONS: dict[str, Model] = {
    **{
        f"builtins.{name}": model
        for name, model in {
            "str": _str, "int": _number(int), "float": _number(float), "bool": _bool, "len": _len, "range": _range,
            "list": _made("list"), "tuple": _made("tuple"), "set": _set,
            "frozenset": _set, "sorted": _sorted, "iter": _made("lazy"),
"reversed": _reversed,
            "enumerate": _enumerate, "zip": _rows(zip), "map": _map, "filter": _filter, "dict": _dict,
            "next": _chosen, "getattr": _getattr, "hasattr": _hasattr, "setattr": _setattr, "type": _type,
            "isinstance": _isinstance, "eval": _dynamic_code, "exec": _dynamic_code, "__import__": _import_dynamic,
            "object.__new__": _object_new, "vars": _vars, "globals": _globals, "locals": _vars, "callable": _callable,
            "exit": _exit, "quit": _exit,
            "property": lambda run, call: (Property(call.at(0) or ANY, call.at(1) or BOTTOM),),
        }.items()
    },
    **dict.fromkeys(("sys.exit", "os._exit"), _exit),
    **dict.fromkeys(("os.getenv", "os.environ.get", "os.environ.__getitem__"), _environment),
    **dict.fromkeys(("os.putenv", "os.environ.setdefault"), _set_environment),
    "os.path.join": _path_join, "os.path.basename": _base_name, "os.path.splitext": _split_extension,
    "collections.namedtuple": _named_tuple,
    "functools.partial": _partial, "functools.partialmethod": _partial,
    **dict.fromkeys(("threading.Thread", "threading.Timer", "multiprocessing.Process"), _thread),
    "collections.OrderedDict": _dict, "collections.defaultdict": _default_dict, "collections.deque": _made("list"),
    **dict.fromkeys(("queue.Queue", "queue.SimpleQueue", "queue.LifoQueue"), lambda run, call: run.sequence(
        call.node, "list", Items(None, BOTTOM), "queue")),
    "itertools.product": _rows(itertools.product),
    "itertools.chain": _chain,
    "random.choice": _chosen, "copy.copy": _copy, "copy.deepcopy": _copy,
    **dict.fromkeys(("importlib.import_module", "importlib.reload"), _import_dynamic),
    **dict.fromkeys(
        ("uuid.uuid1", "uuid.uuid4", "os.getpid", "time.time", "time.time_ns", "time.monotonic", "random.random",
         "random.randint", "random.randrange", "random.getrandbits", "secrets.token_hex"), _random),
    "argparse.ArgumentParser": arguments.made_parser,
}  # fmt: skip

LIBRARY_CONSTANTS.update({
    "sys.argv": unknown(COMMAND_LINE),
    "sys.platform": ("linux",),
    "os.sep": ("/",),
    "os.name": ("posix",),
    "typing.TYPE_CHECKING": (False,),
})  # fmt: skip

# --- libraries ----------------------------------------------------------------------------------------------

# Libraries that make no interface on a node that they are given, and call nothing that they are handed.
_HARMLESS = frozenset({
    "rclpy", "numpy", "cv2", "cv_bridge", "tf2_ros", "tf2_geometry_msgs", "tf2_sensor_msgs", "tf_transformations",
    "tf2_py", "message_filters", "transforms3d", "scipy", "yaml", "ament_index_python", "rosidl_runtime_py",
    "rcl_interfaces", "launch", "launch_ros", "PIL", "torch", "matplotlib", "pandas", "serial", "requests",
    "setuptools", "pytest", "tqdm", "sensor_msgs_py", "psutil", "colorama", "generate_parameter_library_py",
    "diagnostic_updater", "rosidl_parser", "ament_copyright", "ament_flake8", "ament_pep257", "unittest",
})  # fmt: skip
_STANDARD = frozenset(sys.stdlib_module_names) | {"builtins"}
_CALLS_NOTHING = frozenset({
    "print", "repr", "id", "hash", "issubclass", "abs", "round", "sum", "divmod", "pow", "bytes", "debug", "info",
    "warn", "warning", "error", "exception", "critical", "log", "sleep", "pprint", "pformat", "dumps", "isinstance",
})  # fmt: skip
_WAITS = frozenset({
    "spin", "spin_once", "spin_until_future_complete", "spin_once_until_future_complete", "sleep", "wait_for_message",
    "join", "wait", "result", "run", "run_forever", "run_until_complete", "serve_forever", "mainloop", "exec_", "exec",
})  # fmt: skip


def is_harmless(path: str) -> bool:
    """Return whether the library of ``path`` makes no interfaces on what it is given."""
    return path.partition(".")[0] in _HARMLESS | _STANDARD


def call_external(run: Run, atom: External, call: Call) -> Value:
    """Call into a library: as its model says, else the result is unknown and may have called what it was handed."""
    path = atom.path
    owner, _, name = path.rpartition(".")
    model = FUNCTIONS.get(path)
    if model is not None:
        return model(run, call)
    found = rclpy_models.call_library(run, path, call)
    if found is not None:
        return found
    if rclpy_models.is_node_class(owner) or owner == "builtins.object":
        return _unbound_method(run, owner, name, call)
    if "(" in path and name in NODE_ENDPOINTS and len(call.args.positional) + len(call.args.keywords) >= 2:
        return _on_unknown(run, unknown(f"the result of {owner}"), name, call)
    if name in COMMON_CALLBACKS:
        rclpy_models.register(run, COMMON_CALLBACKS[name], call)
        return external("rclpy.()")
    _wait(run, name)
    if rclpy_models.interface_type(path):
        return external(path + "()")
    if path.startswith("rospy."):
        run.gap(call.source, "this program calls rospy of ROS 1, which is not analysed")
    elif not is_harmless(path) and may_make_nodes(path, run.dependencies):
        run.gap(
            call.source,
            f"{path}() is of a ROS package that is not analysed, and may make a node or interfaces",
        )
    hand_over(run, path, call)
    return external(path.partition("(")[0] + "()") if "." in path else unknown(f"the result of {path}()")


def _is_parameter_listener(path: str) -> bool:
    """Return whether ``path`` is a class that generate_parameter_library makes, which only declares parameters."""
    return path.endswith(".ParamListener") and "_parameters." in path


def hand_over(run: Run, path: str, call: Call) -> None:
    """Hand the arguments to code of others: it may call them, and may make interfaces on a node."""
    name = path.rpartition(".")[2]
    if name in _CALLS_NOTHING:
        return
    for value in call.args.all_values():
        for atom in value:
            _escape(run, atom, path, call)


def _escape(run: Run, atom: object, path: str, call: Call) -> None:
    if isinstance(atom, Class) and is_harmless(path) and not run.creates(atom.module.source, atom.node):
        return
    if isinstance(atom, (Function, Bound, Partial, Class, ForeignMethod)):
        run.call_later((atom,), Arguments(more=ANY), call)
        return
    if not isinstance(atom, Obj):
        return
    if atom.kind in ("list", "tuple", "dict") and atom not in run.handed:
        run.handed.add(atom)
        for value in list(atom.cells.values()):
            for each in value:
                for inner in join_all(each.exact or (each.rest,)) if isinstance(each, Items) else (each,):
                    _escape(run, inner, path, call)
    if is_harmless(path) or _is_parameter_listener(path):
        return
    if rclpy_models.is_node(run, atom):
        node = run.findings.nodes[atom]
        node.gaps.add(
            call.source, f"the node is handed to {path.partition('(')[0]}, which may create interfaces on it"
        )
    elif isinstance(atom.cls, Class) and atom not in run.handed:
        run.handed.add(atom)
        for base in atom.cls.classes():
            for name, value in list(base.cells.items()):
                for each in value:
                    if (
                        isinstance(each, Function)
                        and name != "__init__"
                        and run.creates(base.module.source, each.node)
                    ):
                        run.call_later((Bound(each, atom),), Arguments(more=ANY), call)


def _wait(run: Run, name: str) -> None:
    """Run the callbacks where the program waits for them."""
    if name in _WAITS and run.callbacks:
        run.settle(at_end=False)


def _unbound_method(run: Run, path: str, name: str, call: Call) -> Value:
    """``Node.__init__(self, 'name')``."""
    result: Value = BOTTOM
    for receiver in call.args.positional[0] if call.args.positional else ():
        if isinstance(receiver, Obj):
            args = Arguments(
                call.args.positional[1:], call.args.keywords, call.args.more, call.args.more_keywords
            )
            method = ForeignMethod(path, receiver, name)
            result = join(result, call_foreign(run, method, Call(args, call.node, call.frame)))
    return result or ANY


def call_foreign(run: Run, method: ForeignMethod, call: Call) -> Value:
    """Call a method that an object has from a library's class."""
    receiver, path, name = method.receiver, method.path, method.name
    if path == "builtins.object":
        if name == "__new__":
            return _object_new(run, call)
        if name == "__setattr__" and len(call.args.positional) == 2:
            args = call.args.preceded((receiver,))
            return _setattr(run, Call(args, call.node, call.frame))
        return NONE
    if not isinstance(receiver, Obj):
        return ANY
    if rclpy_models.is_node_class(path):
        return rclpy_models.call_node_method(run, receiver, path, name, call)
    if path in rclpy_models.INTERFACE_CLASSES:
        return rclpy_models.call_interface(run, receiver, name, call)
    if path == rclpy_models.PARAMETER:
        return (receiver,) if name == "get_parameter_value" else ANY
    model = arguments.METHODS.get((path, name))
    if model is not None:
        return model(run, receiver, call)
    if name == "__init__":
        _initialise_base(run, receiver, path, call)
        return NONE
    if name in COMMON_CALLBACKS:
        rclpy_models.register(run, COMMON_CALLBACKS[name], call)
        return external("rclpy.()")
    if name in NODE_ENDPOINTS and len(call.args.positional) + len(call.args.keywords) >= 2:
        node = run.findings.node_of(receiver, call.source)
        if not node.created:
            node.gaps.add(
                call.source, f"the class derives from {path or 'a class that is not known'}, not analysed"
            )
        return rclpy_models.NODE_METHODS[name](run, node, call)
    _wait(run, name)
    if name == "registerCallback":
        run.call_later(call.at(0) or BOTTOM, Arguments(more=ANY), call)
        return ANY
    hand_over(run, path, call)
    return unknown(f"the result of {path.rpartition('.')[2] or 'an unknown class'}.{name}()")


def _initialise_base(run: Run, receiver: Obj, path: str, call: Call) -> None:
    if path in FUNCTIONS:
        FUNCTIONS[path](run, call)
    elif rclpy_models.makes_interfaces(path):
        rclpy_models.call_library(run, path, call)
    else:
        if not is_harmless(path) and may_make_nodes(path, run.dependencies):
            why = "is of a ROS package that is not analysed, and may make a node or interfaces"
            run.gap(call.source, f"{path}() {why}")
        hand_over(run, path, call)
        bases = receiver.cls.foreign() if isinstance(receiver.cls, Class) else []
        node = (
            next((base for base in bases[bases.index(path) + 1 :] if rclpy_models.is_node_class(base)), None)
            if path in bases
            else None
        )
        if node is not None:  # by super() of the library
            rclpy_models.initialise_node(run, receiver, node, call)


def _on_unknown(run: Run, receiver: Value, name: str, call: Call) -> Value:
    """A method of something unknown that is called as one of a node."""
    if name in NODE_ENDPOINTS and len(call.args.positional) + len(call.args.keywords) >= 2:
        node = rclpy_models.nodes_of(run, receiver, call)[0]
        return rclpy_models.NODE_METHODS[name](run, node, call)
    return ANY


def call_method(run: Run, method: Method, call: Call) -> Value:
    """Call a method of a text, of a container, or of something unknown."""
    receiver, name = method
    if isinstance(receiver, Property):
        return (Property(receiver.getter, call.at(0) or ANY),)
    if not isinstance(receiver, Unknown):
        return call_container(run, receiver, name, call)
    if name in NODE_ENDPOINTS:
        return _on_unknown(run, (receiver,), name, call)
    if name in COMMON_CALLBACKS:
        rclpy_models.register(run, COMMON_CALLBACKS[name], call)
        return ANY
    _wait(run, name)
    hand_over(run, "something that is not known", call)
    return (receiver,)


def _call_unknown(run: Run, atom: Unknown, call: Call) -> Value:
    hand_over(run, "something that is not known", call)
    return (atom,)


def _call_instance(run: Run, obj: Obj, call: Call) -> Value:
    if obj.kind == "instance" and isinstance(obj.cls, Class):
        own = run.class_attribute(obj.cls, "__call__")
        bound = tuple(Bound(each, obj) for each in own if isinstance(each, Function))
        return run.call(bound, call.args, call.node, call.frame) if bound else ANY
    return ANY


CALLS.update({
    External: call_external,
    ForeignMethod: call_foreign,
    Method: call_method,
    Unknown: _call_unknown,
    Obj: _call_instance,
})  # fmt: skip
