"""Plugins: ``pluginlib::ClassLoader<Base>`` makes classes by names that come from parameters.

The name is looked up in the plugin description files of the workspace; the class is made from its source, so that
what its host hands to it is followed. Source: pluginlib/class_loader.hpp, class_loader_imp.hpp.
"""

from __future__ import annotations

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.objects import construct
from enclave_addons.inference.cpp.engine.values import Param, Value, join, unknown
from enclave_addons.inference.cpp.libraries import Call, library_class, library_method
from enclave_addons.inference.cpp.models.parameters import parameter_names
from enclave_addons.inference.cpp.reading.type_names import Type


@library_class("pluginlib::ClassLoader")
def _loader(run: Machine, call: Call) -> None:
    pass


@library_method(
    "pluginlib::ClassLoader", "createSharedInstance", "createUniqueInstance", "createUnmanagedInstance"
)
def _instance(run: Machine, call: Call) -> Value:
    base = call.this.type.arguments[0] if call.this.type.arguments else Type("")
    found: list[Value] = []
    for name, atom in zip(parameter_names(run, call.value(0)), call.value(0), strict=True):
        if name == "" and not (run.start is None and isinstance(atom, Param)):
            continue  # pluginlib throws
        if name:
            found.append(_made(run, name, base, call))
        else:
            why = f"which {base} plugin is loaded is not known: its name is made at run time"
            run.gap(call.node, call.frame, why)
    return join(*found) if found else unknown("the plugin")


def _made(run: Machine, name: str, base: Type, call: Call) -> Value:
    kind = run.names.resolve((run.names.plugins.get(name) or name).replace("/", "::"), (), call.frame.file)
    if run.names.class_of(kind, (), call.frame.file) is None:
        why = f"the source of plugin {name} ({base}) is not in reach; it may make interfaces"
        run.gap(call.node, call.frame, why)
        return unknown(f"the plugin {name}")
    return construct(run, kind, [], call.node, call.frame, heap=True)


@library_method(
    "pluginlib::ClassLoader", "isClassAvailable", "getDeclaredClasses", "getClassType", "getName", "getBaseClassType",
    "getClassDescription", "getClassPackage", "loadLibraryForClass", "unloadLibraryForClass", "isClassLoaded",
    "getPluginXmlPaths", "refreshDeclaredClasses", "getRegisteredLibraries", "getClassLibraryPath",
    "getPluginManifestPath",
)  # fmt: skip
def _asks(run: Machine, call: Call) -> Value:
    return unknown("what pluginlib knows")
