"""Where analysed code meets foreign code: calls, methods and attributes that only models can answer.

What no model knows gives an unknown result, may call every callable it was handed, and may fill every
container it was handed. A node handed to unknown code is a gap: it may create endpoints there.
"""

from __future__ import annotations

import builtins
import functools
import sys

from enclave_addons.inference.findings import NodeRecord
from enclave_addons.inference.interpreter.run import Call, Run
from enclave_addons.inference.models import (
    native,
    ros,
    stdlib,
)
from enclave_addons.inference.models.signatures import (
    COMMON_CALLBACKS,
    GOES_THROUGH,
    LIFECYCLE_HOOKS,
    NODE_ENDPOINTS,
    library_node,
    may_make_nodes,
)
from enclave_addons.inference.text import Input, Text
from enclave_addons.inference.values import (
    ANY,
    RESULT,
    External,
    ForeignMethod,
    Instance,
    NativeMethod,
    Sequence,
    Unknown,
    Value,
    external,
    join,
    present,
    result_of,
    unknown,
)
from nodl.source_ref import SourceRef

NODE_METHODS = frozenset(NODE_ENDPOINTS) | frozenset(COMMON_CALLBACKS)

# Libraries that create no endpoints on a node they are given, keep their hands off names and off the program's
# objects. A call of theirs gives something that does so as well.
_KEEPS_OFF = frozenset({
    "rclpy", "numpy", "cv2", "cv_bridge", "tf2_ros", "tf2_geometry_msgs", "tf2_sensor_msgs", "tf_transformations",
    "tf2_py", "message_filters", "transforms3d", "scipy", "yaml", "ament_index_python", "rosidl_runtime_py",
    "rcl_interfaces", "rosidl_parser", "launch", "launch_ros", "std_msgs", "PIL", "torch", "matplotlib",
    "pandas", "serial", "requests", "setuptools", "pytest", "tqdm", "sensor_msgs_py", "psutil", "colorama",
    "ament_copyright", "ament_flake8", "ament_pep257", "generate_parameter_library_py",
    # of Python's own library
    "unittest",
    "builtins", "logging", "time", "math", "cmath", "random", "datetime", "typing", "abc", "json", "warnings",
    "traceback", "struct", "re", "os", "sys", "statistics", "decimal", "fractions", "hashlib", "uuid", "platform",
    "getpass", "pprint", "collections",
})  # fmt: skip
# The rest of it leaves containers alone, but calls and keeps what it is given.
_TRUSTED = frozenset(sys.stdlib_module_names) | _KEEPS_OFF


# Functions that change the containers they are given, in whichever library.
_CHANGING = frozenset({
    "shuffle", "heapify", "heappush", "heappop", "heappushpop", "heapreplace", "insort", "insort_left", "insort_right",
    "setitem", "delitem", "iadd", "iand", "iconcat", "ifloordiv", "ilshift", "imatmul", "imod", "imul", "ior", "ipow",
    "irshift", "isub", "itruediv", "ixor",
})  # fmt: skip
_CHANGEABLE = ("builtins.list.", "builtins.dict.", "builtins.set.")


# Functions of Python's library that ask an object for nothing but its text, its identity or a number.
_ASKS_FOR_TEXT = frozenset({
    "print", "repr", "ascii", "id", "hash", "issubclass", "abs", "round", "sum", "divmod", "pow", "bytes", "debug",
    "info", "warn", "warning", "error", "exception", "critical", "log", "getLogger", "basicConfig", "sleep", "pprint",
    "pformat", "dumps",
})  # fmt: skip
# While these run, callbacks do.
_WAITS = frozenset({
    "spin", "spin_once", "spin_until_future_complete", "spin_once_until_future_complete", "sleep", "wait_for_message",
})  # fmt: skip
_WAITS_FOR_ONE = frozenset({
    "join", "wait", "result",  # of threads, events and futures
    "run", "run_forever", "run_until_complete", "serve_forever", "mainloop", "exec_",  # of loops of events
})  # fmt: skip
_WAITS_IN_POOLS = frozenset({"get", "shutdown", "__exit__"})
_POOLS = ("the result of queue.", "the result of concurrent.", "the result of multiprocessing.")


def wait(run: Run, name: str, receiver: object = None) -> None:
    """Run the callbacks, and what other threads do, if a method of this name (of ``receiver``) waits for them."""
    for_one = name in _WAITS_FOR_ONE or (name in _WAITS_IN_POOLS and is_pool(receiver))
    if (for_one or name in _WAITS) and run.callbacks:
        mark = run.state.mark()
        run.settle(run)
        if for_one:  # others have run, or not yet
            run.state.join_seen(mark, mixed=True)


def is_pool(atom: object) -> bool:
    """Return True for a queue or a pool of threads, made by Python's own library."""
    return isinstance(atom, Unknown) and atom.why.startswith(_POOLS)


def call_external(run: Run, atom: External, call: Call) -> Value:
    """Return what a call into a library gives: as its model says, else unknown, and the arguments escape."""
    path = atom.path
    if path.endswith(RESULT) and keeps_off(path):
        run.escape(call.args, opened=False, objects=False)
        return (atom,)
    owner, _, name = path.rpartition(".")
    model = stdlib.FUNCTIONS.get(path)
    if model is not None:
        return model(run, call)
    found = ros.call_library(run, path, call)
    if found is not None:
        return found
    if is_node_class(owner) or (owner == "builtins.object" and name.startswith("__")):
        return _unbound_method(run, owner, name, call)
    if owner.rpartition(".")[2] in NODE_ENDPOINTS:
        run.gap(call.node, call.frame, f"{name} of a method that makes interfaces is not analysed")
    if _is_exception(path):
        run.escape(call.args, opened=False, objects=False)
        return (Instance(External(path)),)
    if "(" in path and (name in NODE_METHODS):
        return call_native(run, NativeMethod(unknown(f"the result of {owner}")[0], name), call)
    if (
        "(" not in path or atom in stdlib.LOCKS
    ):  # a library's own, which makes no interfaces, whatever its name
        run.understood.add(call.node)
    wait(run, name)
    if not ros.interface_type(path) and not keeps_off(path):
        _note_unknown_package(run, path, call)
    _hand_over(run, path, call)
    if ros.interface_type(path):
        return external(path + "()")
    if keeps_off(path):
        return result_of(path)
    return unknown(f"the result of {path}()")


def _is_exception(path: str) -> bool:
    """Return True if the path names an exception class of Python itself."""
    found = getattr(builtins, path.removeprefix("builtins."), None) if path.startswith("builtins.") else None
    return isinstance(found, type) and issubclass(found, BaseException)


def is_asked_of(name: str) -> bool:
    """Return True for a method that matters even on an object that a library made."""
    return name in NODE_METHODS or name in _WAITS or name in _WAITS_FOR_ONE


@functools.lru_cache(maxsize=4096)
def keeps_off(path: str) -> bool:
    """Return True if the library of ``path`` leaves the program's classes and objects alone."""
    return path.partition(".")[0] in _KEEPS_OFF


def lets_through(path: str) -> bool:
    """Return True if exceptions pass the context managers of the library of ``path``."""
    return keeps_off(path) or path.partition(".")[0] in ("threading", "multiprocessing", "io")


def creates(atom: object) -> bool:
    """Return True if calling this function, class or method of a library makes a node or an interface."""
    if isinstance(atom, ForeignMethod):
        return atom.name in NODE_ENDPOINTS
    return isinstance(atom, External) and _creates(atom.path)


@functools.lru_cache(maxsize=4096)
def _creates(path: str) -> bool:
    owner, _, leaf = path.rpartition(".")
    return (
        is_node_class(path) or ros.makes_interfaces(path) or (leaf in NODE_ENDPOINTS and is_node_class(owner))
    )


@functools.lru_cache(maxsize=4096)
def is_node_class(path: str) -> bool:
    """Return True if ``path`` is a node class of rclpy or one in the table of library nodes."""
    if path.startswith("rclpy."):
        return path.endswith(("Node", ".LifecycleNode"))
    return library_node(path) is not None


def _unbound_method(run: Run, path: str, name: str, call: Call) -> Value:
    """Call ``Node.__init__(self, 'name')``."""
    result: Value = ANY
    receivers = call.args.positional[0] if call.args.positional else ANY
    if name in NODE_ENDPOINTS and not all(isinstance(each, Instance) for each in receivers):
        run.gap(call.node, call.frame, f"{name}() is called for a node that is not known")
    for receiver in receivers:
        if isinstance(receiver, Instance):
            shifted = Call(call.args.shifted(), call.node, call.frame)
            result = call_foreign_method(run, ForeignMethod(path, receiver, name), shifted)
    return result


def _note_unknown_package(run: Run, path: str, call: Call) -> None:
    """Add a gap for a class or function of a ROS package that cannot be read: it may make a node of its own."""
    if path.startswith("rospy."):
        why = "this program calls rospy of ROS 1, which is not analysed"
        run.findings.gap(SourceRef(run.main.path), why)
    elif may_make_nodes(path, run.dependencies):
        why = f"{path}() is of a ROS package that is not analysed, and may make a node or interfaces"
        run.gap(call.node, call.frame, why)


def _hand_over(run: Run, path: str, call: Call) -> None:
    root = path.partition(".")[0]
    trusted = root in _TRUSTED or bool(ros.interface_type(path))
    leaf = path.rpartition(".")[2]
    opened = not trusted or leaf in _CHANGING or path.startswith(_CHANGEABLE)
    called_back = root in sys.stdlib_module_names and leaf not in _ASKS_FOR_TEXT
    run.escape(call.args, opened=opened, objects=not trusted or root not in _KEEPS_OFF or called_back)
    for keyword in ("cls", "file"):  # json makes an encoder of it, print writes to it
        run.escape_value(call.args.keywords.get(keyword, ()), opened=False)
    if trusted or path.endswith(".ParamListener"):  # of generate_parameter_library: only declares parameters
        return
    for value in call.args.all_values():
        for atom in value:
            record = run.findings.node_of.get(atom) if isinstance(atom, Instance) else None
            if record is not None and record.created:
                why = f"the node is handed to {path}, which is not analysed and may create endpoints on it"
                record.gaps.setdefault((call.source, why))


def call_foreign_method(run: Run, method: ForeignMethod, call: Call) -> Value:
    """Call a method of a library's class: as its model says, else unknown, and the arguments escape."""
    receiver, path, name = method.receiver, method.path, method.name
    assert isinstance(receiver, Instance)
    if name not in NODE_ENDPOINTS:
        run.understood.add(call.node)
    if is_node_class(path) and name != "__getattribute__":
        return _call_node_method(run, receiver, path, name, call)
    model = stdlib.METHODS.get((path, name))
    if model is not None:
        return model(run, receiver, call)
    if path in ros.ENDPOINT_CLASSES:
        return ros.call_endpoint(run, receiver, name, call)
    if path == ros.PARAMETER_CLASS:
        return (receiver,) if name == "get_parameter_value" else ANY
    if name == "__init__":
        if ros.makes_interfaces(path):
            ros.call_library(run, path, call)
        else:
            _initialise_other_bases(run, receiver, path, call)
        return ANY
    if path == "builtins.object" or name in ("__setattr__", "__getattribute__", "__delattr__"):
        run.gap(call.node, call.frame, f"{name} is called by the program, which is not analysed")
        return unknown(f"the result of object.{name}()")
    if name in NODE_ENDPOINTS and len(call.args.positional) + len(call.args.keywords) >= 2:
        record = ros.record_of_instance(run, receiver, call)
        if not record.created:
            why = f"the class derives from {path or 'a class that is not known'}, which is not analysed"
            record.gaps.setdefault((call.source, why))
        return ros.NODE_METHODS[name](run, record, call)
    if name in COMMON_CALLBACKS:
        ros.register(run, COMMON_CALLBACKS[name], call, at_any_time=True)
        return ANY
    wait(run, name)
    _escape_to(run, path, call)
    return unknown(f"the result of {path.rpartition('.')[2] or 'an unknown class'}.{name}()")


def _escape_to(run: Run, path: str, call: Call) -> None:
    """Hand the arguments to the library of ``path``."""
    run.escape(call.args, opened=path.partition(".")[0] not in _TRUSTED, objects=not keeps_off(path))


def _call_node_method(run: Run, receiver: Instance, path: str, name: str, call: Call) -> Value:
    if name == "__init__":
        ros.initialise_node(run, receiver, path, call)
        return ANY
    model = ros.NODE_METHODS.get(name)
    if model is not None:
        found = model(run, ros.record_of_instance(run, receiver, call), call)
        through = (
            run.attribute((receiver,), each, call.node, call.frame) for each in GOES_THROUGH.get(name, ())
        )
        own = any(not isinstance(atom, ForeignMethod) for value in through for atom in value)
        return join(found, unknown("what rclpy finds by a method of the program")) if own else found
    run.escape(call.args, opened=False, objects=name in ("add_waitable", "add_rate"))
    return result_of(path)


def _initialise_other_bases(run: Run, receiver: Instance, path: str, call: Call) -> None:
    """Hand the arguments to an unknown base class, which may call the next one in the method resolution order."""
    _escape_to(run, path, call)
    _note_unknown_package(run, path, call)
    paths = _foreign_bases(receiver)
    after = paths[paths.index(path) + 1 :] if path in paths else []
    node_class = next(filter(is_node_class, after), None)
    if node_class is not None:
        ros.initialise_node(run, receiver, node_class, call)


def _foreign_bases(obj: Instance) -> list[str]:
    order = getattr(obj.cls, "linear", None) or ()
    return [base.path for base in order if isinstance(base, External)]


def call_native(run: Run, method: NativeMethod, call: Call) -> Value:
    """Call a method of a text or container, or of something unknown that may be a node."""
    receiver, name = method.receiver, method.name
    if isinstance(receiver, Unknown):
        if name in COMMON_CALLBACKS:
            ros.register(run, COMMON_CALLBACKS[name], call, at_any_time=True)
            return ANY
        if len(call.args.positional) + len(call.args.keywords) >= 2:
            record = ros.records_of(run, (receiver,), call)[0]
            return ros.NODE_METHODS[name](run, record, call)
        return ANY
    return native.call_method(run, receiver, name, call)


# --- attributes ---------------------------------------------------------------------------------------------

# Fields of a parameter's value, by the type that they hold or whose lists they hold.
_PARAMETER_VALUES = {
    "value": None, "byte_array_value": None,
    **{f"{name}{array}_value": kind for array in ("", "_array")
       for name, kind in (("string", str), ("bool", bool), ("integer", int), ("double", float))},
}  # fmt: skip


def _of_type(value: Value, kind: type | None) -> Value:
    """Return ``value``, unknown where it is of another type: then the field holds its zero, as where there is none."""
    value = tuple(kind() if kind is not None and atom is None else atom for atom in value)
    if kind is None or all(_is_of(atom, kind) for atom in value):
        return value
    return unknown("a field for another type than the parameter has")


def _is_of(atom: object, kind: type) -> bool:
    if isinstance(atom, Sequence):
        return all(_is_of(each, kind) for each in atom.items.any_element())
    if isinstance(atom, Text):
        inputs = ((piece.owner, piece.name) for piece in atom.pieces if isinstance(piece, Input))
        return all(
            _is_of(each, kind)
            for node, name in inputs
            if isinstance(node, NodeRecord)
            for each in node.default(name)
        )
    return isinstance(atom, Unknown) or type(atom) is kind


def instance_attribute(run: Run, obj: Instance, path: str, name: str) -> Value:
    """Return an attribute of an object whose class is foreign."""
    if path == ros.PARAMETER_CLASS and name in _PARAMETER_VALUES:
        return _of_type(present(obj.cells.get("value", ANY)), _PARAMETER_VALUES[name])
    if path in ros.ENDPOINT_CLASSES and name in ros.ENDPOINT_NAMES:
        return obj.cells.get("name", ANY)
    if path in stdlib.OPEN_ATTRIBUTES:
        return stdlib.OPEN_ATTRIBUTES[path](run, obj, name)
    return (ForeignMethod(path, obj, name),)


def inherited(obj: Instance, path: str, name: str) -> Value | None:
    """Return what an analysed class inherits from the foreign class ``path``; ``None``: ask the next one."""
    if path == "builtins.object" and not name.startswith("__"):
        return None
    if is_node_class(path):
        return (ForeignMethod(path, obj, name),)
    if (path, name) in stdlib.METHODS or name == "__init__":
        return (ForeignMethod(path, obj, name),)
    return None if any(map(is_node_class, _foreign_bases(obj))) else (ForeignMethod(path, obj, name),)


def hooks_of(base: object) -> frozenset[str] | None:
    """Return the methods that a foreign base class may call on its own; ``None``: any of them."""
    if not isinstance(base, External):
        return None
    if is_node_class(base.path):
        return LIFECYCLE_HOOKS if ros.is_lifecycle(base.path) else frozenset()
    return stdlib.HOOKS.get(base.path)


@functools.lru_cache(maxsize=4096)
def constant(path: str) -> Value | None:
    """Return constants of foreign modules that matter for names."""
    return stdlib.CONSTANTS.get(path)
