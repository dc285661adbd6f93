"""``launch_ros``: nodes, components, lifecycle, names, remaps and parameters.

API of upstream's package of this name, plus what the Security Enclaves article adds: the keyword
``enclave=`` and the action ``PushRosEnclave``.
"""

from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {},
    submodules=(
        "actions",
        "descriptions",
        "event_handlers",
        "events",
        "parameter_descriptions",
        "parameters_type",
        "remap_rule_type",
        "ros_adapters",
        "substitutions",
        "utilities",
    ),
)
