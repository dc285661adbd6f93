"""The public names of ``launch`` and its companions, as launch files import them, with their parameters.

Works on whichever packages of these names are importable: real launch's in the driver, ours while installed.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path

RECORDED = Path(__file__).with_name("public_api.txt")

MODULES = (
    "launch", "launch.actions", "launch.conditions", "launch.descriptions", "launch.event_handlers", "launch.events",
    "launch.events.process", "launch.frontend", "launch.launch_description_sources", "launch.substitutions",
    "launch.utilities", "launch.utilities.type_utils", "launch.some_substitutions_type", "launch_ros.actions",
    "launch_ros.descriptions", "launch_ros.event_handlers", "launch_ros.events", "launch_ros.events.lifecycle",
    "launch_ros.parameter_descriptions", "launch_ros.parameters_type", "launch_ros.remap_rule_type",
    "launch_ros.ros_adapters", "launch_ros.substitutions", "launch_ros.utilities", "launch_xml", "launch_yaml",
    "launch_xml.launch_description_sources", "launch_yaml.launch_description_sources", "ament_index_python",
    "ament_index_python.packages", "ament_index_python.resources", "ament_index_python.search_paths",
)  # fmt: skip


def describe() -> dict[str, list[str]]:
    """``module.Name`` to its parameters: ``name``, ``*name``, ``**name``, keyword-only ones with a ``*,`` before."""
    found: dict[str, list[str]] = {}
    for module_name in MODULES:
        module = importlib.import_module(module_name)
        for name in _public_names(module):
            value = getattr(module, name, None)
            if inspect.isclass(value) or inspect.isfunction(value):
                found[f"{module_name}.{name}"] = parameters(value)
                if inspect.isclass(value):
                    found.update(_members(f"{module_name}.{name}", value))
    return found


def line(name: str, parameters: list[str]) -> str:
    return f"{name}({', '.join(parameters)})"


def recorded(distro: str) -> Iterator[tuple[str, list[str]]]:
    """What real launch of ``distro`` has."""
    for entry in RECORDED.read_text(encoding="utf-8").splitlines():
        text, _, distros = entry.partition("  @ ")
        if not distros or distro in distros.split():
            name, _, parameters = text.removesuffix(")").partition("(")
            yield name, parameters.split(", ") if parameters else []


def _public_names(module: object) -> list[str]:
    names = getattr(module, "__all__", None)
    if names is not None:
        return sorted(names)
    own = getattr(module, "__name__", "")
    return sorted(
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and getattr(value, "__module__", "").endswith(own)
    )


def _members(qualified: str, value: type) -> dict[str, list[str]]:
    """Properties and methods that the class itself or a base within these packages defines."""
    members: dict[str, list[str]] = {}
    for base in value.__mro__:
        if ".launch" not in f".{base.__module__}":
            continue
        for name, member in vars(base).items():
            if not name.startswith("_") and (isinstance(member, property) or inspect.isfunction(member)):
                members[f"{qualified}.{name}"] = []
    return members


def parameters(value: object) -> list[str]:
    try:
        parameters = inspect.signature(value).parameters.values()  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return []
    marks: dict[object, str] = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    keyword_only = inspect.Parameter.KEYWORD_ONLY
    return [
        f"{marks.get(item.kind, '')}{item.name}{'=' if item.default is not item.empty else ''}"
        + (" (keyword)" if item.kind is keyword_only else "")
        for item in parameters
    ]
