"""Plugins: ``pluginlib::ClassLoader<Base>`` makes classes by names that come from parameters.

The name is looked up in the plugin description files of the workspace; the class is made from its source, so that
what its host hands to it is followed. Source: pluginlib/class_loader.hpp, class_loader_imp.hpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodl.infer.cpp.libraries import Call, library_class, library_method
from nodl.infer.cpp.models.parameters import parameter_names
from nodl.infer.cpp.reading.type_names import Type
from nodl.infer.cpp.running.constructors import construct
from nodl.infer.cpp.running.frames import Frame
from nodl.infer.cpp.running.machine import Machine
from nodl.infer.cpp.running.values import BOTTOM, Obj, Param, Value, join, unknown

if TYPE_CHECKING:
    from tree_sitter import Node


@library_class("pluginlib::ClassLoader")
def _loader(run: Machine, this: Obj, arguments: list[Value], node: Node, frame: Frame) -> Value | None:
    return None


@library_method(
    "pluginlib::ClassLoader", "createSharedInstance", "createUniqueInstance", "createUnmanagedInstance"
)
def _instance(run: Machine, call: Call) -> Value:
    loader = call.receiver
    base = loader.type.arguments[0] if loader is not None and loader.type.arguments else Type("")
    found: list[Value] = []
    for name, atom in zip(parameter_names(run, call.value(0)), call.value(0), strict=True):
        if name == "" and not (run.settings.start is None and isinstance(atom, Param)):
            continue  # pluginlib throws
        if not name:
            run.gap(
                call.node,
                call.frame,
                f"which {base} plugin is loaded is not known: its name is made at run time",
            )
            continue
        found.append(_made(run, name, base, call))
    return join(*found) if found else unknown("a plugin")


def _made(run: Machine, name: str, base: Type, call: Call) -> Value:
    entry = run.names.plugin(name)
    kind = run.names.plugin_type(entry or name, call.frame.file)
    cls = run.names.class_of(kind, (), call.frame.file)
    run.plugins_used.setdefault(entry or name)
    if cls is None:
        run.gap(
            call.node,
            call.frame,
            f"the source of plugin {name} ({base}) is not in reach; it may make interfaces",
        )
        return unknown(f"the plugin {name}")
    return construct(run, kind, [], call.node, call.frame, heap=True)


@library_method(
    "pluginlib::ClassLoader",
    "isClassAvailable",
    "getDeclaredClasses",
    "getClassType",
    "getName",
    "getBaseClassType",
    "getClassDescription",
    "getClassPackage",
    "loadLibraryForClass",
    "unloadLibraryForClass",
    "isClassLoaded",
    "getPluginXmlPaths",
    "refreshDeclaredClasses",
    "getRegisteredLibraries",
    "getClassLibraryPath",
    "getPluginManifestPath",
)
def _asks(run: Machine, call: Call) -> Value:
    names = parameter_names(run, call.value(0)) if call.value(0) else []
    if len(names) == 1 and names[0] is not None and len(call.values) == 1:
        entry = run.names.plugin(names[0])
        from nodl.infer.cpp.syntax import text

        asked = text(call.node.child_by_field_name("function"))
        if asked.endswith("getClassType") and entry is not None:
            return unknown("the class of a plugin") if entry is None else _text(entry)
        if asked.endswith("getName"):
            return _text(names[0].rpartition("::")[2].rpartition("/")[2])
    return unknown("what pluginlib knows")


def _text(value: str) -> Value:
    from nodl.infer.cpp.running.values import literal

    return literal(value)


__all__ = ["BOTTOM"]
