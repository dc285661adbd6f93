"""Where analysed code meets foreign code: calls, methods and attributes that only models can answer.

What no model knows gives an unknown result, may call every callable it was handed, and may fill every
container it was handed. A node handed to unknown code is a gap: it may create endpoints there.
"""

from __future__ import annotations

import sys

from nodl.infer.interpreter.run import Call, Run
from nodl.infer.models import builtin, native, ros, stdlib
from nodl.infer.models.library_nodes import library_node
from nodl.infer.models.signatures import COMMON_CALLBACKS, LIFECYCLE_HOOKS, NODE_ENDPOINTS
from nodl.infer.values import (
    ANY,
    External,
    ForeignMethod,
    Instance,
    NativeMethod,
    Unknown,
    Value,
    external,
    unknown,
)

NODE_METHODS = frozenset(NODE_ENDPOINTS) | frozenset(COMMON_CALLBACKS)

# Libraries that create no endpoints on a node they are given and keep their hands off names.
_TRUSTED = frozenset(sys.stdlib_module_names) | {
    "builtins", "rclpy", "numpy", "cv2", "cv_bridge", "tf2_ros", "tf2_geometry_msgs", "tf_transformations",
    "tf2_py", "message_filters", "transforms3d", "scipy", "yaml", "ament_index_python", "rosidl_runtime_py",
    "rcl_interfaces", "rosidl_parser", "launch", "launch_ros", "std_msgs", "PIL", "torch", "matplotlib",
    "pandas", "serial", "requests", "setuptools", "pytest", "tqdm", "sensor_msgs_py", "psutil", "colorama",
}  # fmt: skip


def call_external(run: Run, atom: External, call: Call) -> Value:
    path = atom.path
    model = builtin.FUNCTIONS.get(path) or stdlib.FUNCTIONS.get(path)
    if model is not None:
        return model(run, call)
    found = ros.call_library(run, path, call)
    if found is not None:
        return found
    owner, _, name = path.rpartition(".")
    if is_node_class(owner):
        return _unbound_method(run, owner, name, call)
    _hand_over(run, path, call)
    return external(path + "()") if ros.interface_type(path) else unknown(f"the result of {path}()")


def is_node_class(path: str) -> bool:
    if path.startswith("rclpy."):
        return path.endswith(("Node", ".LifecycleNode"))
    return library_node(path) is not None


def _unbound_method(run: Run, path: str, name: str, call: Call) -> Value:
    """``Node.__init__(self, 'name')``."""
    result: Value = ANY
    for receiver in call.args.positional[0] if call.args.positional else ():
        if isinstance(receiver, Instance):
            shifted = Call(call.args.shifted(), call.node, call.frame)
            result = call_foreign_method(run, ForeignMethod(path, receiver, name), shifted)
    return result


def _hand_over(run: Run, path: str, call: Call) -> None:
    root = path.partition(".")[0]
    trusted = root in _TRUSTED or bool(ros.interface_type(path))
    run.escape(call.args, opened=not trusted)
    if trusted or path.endswith(".ParamListener"):  # of generate_parameter_library: only declares parameters
        return
    for value in call.args.all_values():
        for atom in value:
            if isinstance(atom, Instance) and atom.node is not None and atom.node.created:
                why = f"the node is handed to {path}, which is not analysed and may create endpoints on it"
                atom.node.gaps.setdefault((call.source, why))


def call_foreign_method(run: Run, method: ForeignMethod, call: Call) -> Value:
    receiver, path, name = method.receiver, method.path, method.name
    assert isinstance(receiver, Instance)
    if is_node_class(path):
        return _call_node_method(run, receiver, path, name, call)
    if path.startswith("image_transport_py.") and receiver.node is not None:
        return ros.image_transport_method(run, receiver.node, name, call)
    model = stdlib.METHODS.get((path, name))
    if model is not None:
        return model(run, receiver, call)
    if path == ros.PARAMETER_CLASS:
        return (receiver,) if name == "get_parameter_value" else ANY
    if name == "__init__":
        _initialise_other_bases(run, receiver, path, call)
        return ANY
    if name in NODE_ENDPOINTS and len(call.args.positional) + len(call.args.keywords) >= 2:
        record = ros.record_of_instance(run, receiver, call)
        if not record.created:
            why = f"the class derives from {path or 'a class that is not known'}, which is not analysed"
            record.gaps.setdefault((call.source, why))
        return ros.NODE_METHODS[name](run, record, call)
    if name in COMMON_CALLBACKS:
        _common_callback(run, name, call)
        return ANY
    run.escape(call.args, opened=path.partition(".")[0] not in _TRUSTED)
    return unknown(f"the result of {path.rpartition('.')[2] or 'an unknown class'}.{name}()")


def _call_node_method(run: Run, receiver: Instance, path: str, name: str, call: Call) -> Value:
    if name == "__init__":
        ros.initialise_node(run, receiver, path, call)
        return ANY
    model = ros.NODE_METHODS.get(name)
    if model is not None:
        return model(run, ros.record_of_instance(run, receiver, call), call)
    run.escape(call.args, opened=False)
    return unknown(f"the result of Node.{name}()")


def _initialise_other_bases(run: Run, receiver: Instance, path: str, call: Call) -> None:
    """An unknown base class may pass the call on to the next one in the method resolution order."""
    run.escape(call.args, opened=path.partition(".")[0] not in _TRUSTED)
    order = getattr(receiver.cls, "linear", None) or ()
    foreign = [base for base in order if isinstance(base, External)]
    paths = [base.path for base in foreign]
    after = paths[paths.index(path) + 1 :] if path in paths else []
    for other in after:
        if is_node_class(other):
            ros.initialise_node(run, receiver, other, call)
            return


def _common_callback(run: Run, name: str, call: Call) -> None:
    callback = COMMON_CALLBACKS[name]
    value = ros.argument(call, callback.argument)
    if value:
        run.register_callback(value, callback.arity)


def call_native(run: Run, method: NativeMethod, call: Call) -> Value:
    receiver, name = method.receiver, method.name
    if isinstance(receiver, Unknown):
        if name in COMMON_CALLBACKS:
            _common_callback(run, name, call)
            return ANY
        if len(call.args.positional) + len(call.args.keywords) >= 2:
            record = ros.records_of(run, (receiver,), call)[0]
            return ros.NODE_METHODS[name](run, record, call)
        return ANY
    return native.call_method(run, receiver, name, call)


# --- attributes ---------------------------------------------------------------------------------------------

_PARAMETER_VALUES = frozenset(
    {
        "value", "string_value", "bool_value", "integer_value", "double_value", "string_array_value",
        "integer_array_value", "double_array_value", "bool_array_value", "byte_array_value",
    }
)  # fmt: skip


def instance_attribute(run: Run, obj: Instance, path: str, name: str) -> Value:
    """An attribute of an object whose class is foreign."""
    if path == ros.PARAMETER_CLASS and name in _PARAMETER_VALUES:
        return obj.cells.get("value", ANY)
    if path in stdlib.OPEN_ATTRIBUTES:
        return stdlib.OPEN_ATTRIBUTES[path](run, obj, name)
    return (ForeignMethod(path, obj, name),)


def inherited(obj: Instance, path: str, name: str) -> Value | None:
    """What an analysed class inherits from the foreign class ``path``; ``None``: ask the next one."""
    if is_node_class(path):
        return (ForeignMethod(path, obj, name),)
    if (path, name) in stdlib.METHODS or name == "__init__":
        return (ForeignMethod(path, obj, name),)
    others = [base for base in getattr(obj.cls, "linear", ()) or () if isinstance(base, External)]
    if any(is_node_class(base.path) for base in others):
        return None
    return (ForeignMethod(path, obj, name),)


def hooks_of(base: object) -> frozenset[str] | None:
    """The methods that a foreign base class may call on its own; ``None``: any of them."""
    if not isinstance(base, External):
        return None
    if is_node_class(base.path):
        return LIFECYCLE_HOOKS if ros.is_lifecycle(base.path) else frozenset()
    if base.path in stdlib.HOOKS:
        return stdlib.HOOKS[base.path]
    return None


def constant(path: str) -> Value | None:
    """Constants of foreign modules that matter for names."""
    return stdlib.CONSTANTS.get(path)
