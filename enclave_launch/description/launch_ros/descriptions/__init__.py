"""API of ``launch_ros.descriptions``."""

from typing import Any

from enclave_launch.description.lazy import lazy_names
from enclave_launch.ros_rules.distro import Feature

from ..parameter_descriptions import Parameter as Parameter
from ..parameter_descriptions import ParameterFile as ParameterFile
from ..parameter_descriptions import ParameterValue as ParameterValue

_components, __dir__ = lazy_names(
    __name__,
    {"ComposableLifecycleNode": "composable_lifecycle_node", "ComposableNode": "composable_node"},
    submodules=("composable_lifecycle_node", "composable_node"),
    gates={"ComposableLifecycleNode": Feature.LIFECYCLE_TAGS},
)


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return [*_components("__all__"), "Parameter", "ParameterFile", "ParameterValue"]
    return _components(name)
