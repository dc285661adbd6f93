"""Plugins of nav2 and rviz, hardware components of ros2_control: what their host calls on them, and with what.

A host hands its node and the name of the instance to the first method that it calls. Bases without a row make no
interface of their own.

Source: ros-navigation/navigation2 jazzy, main: nav2_core/include/nav2_core, nav2_costmap_2d layer.hpp, layer.cpp,
footprint_collision_checker.hpp; ros-controls/ros2_control jazzy: hardware_interface/system_interface.hpp and its
neighbours; ros2/rviz jazzy: rviz_common/panel.hpp, tool.hpp, display.hpp, display_context.hpp.
"""

from __future__ import annotations

from dataclasses import replace

from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.invocation import HOOKS
from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import Bound, Obj, Value, literal, unknown
from enclave_addons.inference.cpp.libraries import Call, library_class, library_method
from enclave_addons.inference.cpp.models.nodes import become_node
from enclave_addons.inference.cpp.reading.declarations import Class, FunctionParameter
from enclave_addons.inference.cpp.reading.type_names import Type
from nodl.dependence import COMPONENT, HOST

_LAYER = "nav2_costmap_2d::Layer"
_LIFECYCLE = "rclcpp_lifecycle::LifecycleNode"
_FIRST = ("configure", "initialize")


@library_class(
    *(
        f"nav2_core::{name}"
        for name in (
            *("Controller", "GlobalPlanner", "Smoother", "Behavior", "GoalChecker", "ProgressChecker"),
            *("WaypointTaskExecutor", "PathHandler"),
        )
    ),
    *(f"nav2_costmap_2d::{name}" for name in ("Costmap2D", "MapLocation", "FootprintCollisionChecker")),
    _LAYER,
)
def _silent_in_nav2(run: Machine, call: Call) -> None:
    """Make nothing: plugins' bases are abstract, a layer keeps what it is given, the others know no node."""


def _base_of_hardware(run: Machine, call: Call) -> Value:
    return unknown("what the base of a hardware component answers")


def _node_of_component(run: Machine, call: Call) -> Value:
    """Return the node of the component itself, which releases have since jazzy."""
    node = run.object((COMPONENT, call.this), Type("rclcpp::Node"))
    if node not in run.nodes:
        become_node(run, replace(call, receiver=node, values=[literal(COMPONENT)]))
    return (node,)


for _hardware in ("System", "Actuator", "Sensor"):
    _base = f"hardware_interface::{_hardware}Interface"
    library_method(_base, "on_init", *HOOKS)(_base_of_hardware)
    library_method(_base, "get_node")(_node_of_component)


_CONTEXT = "rviz_common::DisplayContext"
_NODE_OF_RVIZ = "rviz_common::ros_integration::RosNodeAbstractionIface"
_RVIZ = ("rviz_common::Panel", "rviz_common::Tool", "rviz_common::Display")
_CALLED_BY_RVIZ = (
    *("onInitialize", "load", "save", "onEnable", "onDisable", "update", "reset", "fixedFrameChanged"),
    *("activate", "deactivate", "processMouseEvent", "processKeyEvent"),
)


@library_class(*_RVIZ)
def _silent_in_rviz(run: Machine, call: Call) -> None:
    """Make nothing: the node is that of rviz, which the context has."""


def _context(run: Machine, plugin: Obj) -> Value:
    return (run.object((_CONTEXT, plugin), Type(_CONTEXT)),)


@library_method(_RVIZ[0], "getDisplayContext")
def _context_of_panel(run: Machine, call: Call) -> Value:
    return _context(run, call.this)


@library_method(_CONTEXT, "getRosNodeAbstraction")
@library_method(_NODE_OF_RVIZ, "lock")
def _abstraction(run: Machine, call: Call) -> Value:
    return (run.object((_NODE_OF_RVIZ,), Type(_NODE_OF_RVIZ)),)


@library_method(_NODE_OF_RVIZ, "get_raw_node")
def _node_of_rviz(run: Machine, call: Call) -> Value:
    hosts = [node for node, record in run.nodes.items() if record.names == literal(HOST)]
    return tuple(hosts) or unknown("the node of rviz")


def host_of(run: Machine, cls: Class, frame: Frame) -> Obj:
    """Make the node that loads an object of ``cls``."""
    host = run.object((HOST, cls), Type(_LIFECYCLE))
    become_node(run, Call(cls.node, frame, [literal(HOST)], receiver=host), lifecycle=True)
    return host


def load(run: Machine, made: Value, host: Obj, instance: str) -> None:
    """Let ``host`` call what it calls first on the plugin ``made``, which it loads as ``instance``."""
    for plugin in made:
        if not isinstance(plugin, Obj) or plugin.cls is None:
            continue
        if plugin.foreign_base == _LAYER:
            run.store.set((plugin, "node_"), (host,))
            run.store.set((plugin, "name_"), literal(instance))
        if plugin.foreign_base in _RVIZ:
            run.store.set((plugin, "context_"), _context(run, plugin))
            _expect_calls(run, plugin, plugin.cls, _CALLED_BY_RVIZ)
        for name in _FIRST:
            for method in run.names.find_methods(plugin.cls, name):
                if any(map(_takes_node, method.parameters)):
                    given = tuple(_given(each, host, instance) for each in method.parameters)
                    run.callbacks[Bound(method, plugin, given)] = False


def _expect_calls(run: Machine, plugin: Obj, cls: Class, names: tuple[str, ...]) -> None:
    """Let the host call methods of these names, whenever it likes."""
    for method in (each for name in names for each in run.names.find_methods(cls, name)):
        given = tuple(unknown(f"the argument {each.name}") for each in method.parameters)
        run.callbacks[Bound(method, plugin, given)] = False


def _given(parameter: FunctionParameter, host: Obj, instance: str) -> Value:
    if _takes_node(parameter):
        return (host,)
    return literal(instance) if "string" in parameter.type else unknown(f"the argument {parameter.name}")


def _takes_node(parameter: FunctionParameter) -> bool:
    return "LifecycleNode" in parameter.type
