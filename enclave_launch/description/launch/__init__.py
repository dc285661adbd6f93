"""``launch``: descriptions, actions, substitutions, conditions, events.

API of upstream's package of this name; see ``enclave_launch.description``.
"""

from enclave_launch.description.lazy import lazy_names
from enclave_launch.ros_rules.distro import Feature

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Action": "action",
        "Condition": "condition",
        "Event": "event",
        "EventHandler": "event_handler",
        "InvalidLaunchFileError": "invalid_launch_file_error",
        "LaunchContext": "launch_context",
        "LaunchDescription": "launch_description",
        "LaunchDescriptionEntity": "launch_description_entity",
        "LaunchDescriptionSource": "launch_description_source",
        "LaunchIntrospector": "launch_introspector",
        "LaunchService": "launch_service",
        "SomeActionsType": "some_actions_type",
        "SomeActionsType_types_tuple": "some_actions_type",
        "SomeEntitiesType": "some_entities_type",
        "SomeEntitiesType_types_tuple": "some_entities_type",
        "SomeSubstitutionsType": "some_substitutions_type",
        "SomeSubstitutionsType_types_tuple": "some_substitutions_type",
        "Substitution": "substitution",
    },
    submodules=(
        "actions",
        "conditions",
        "descriptions",
        "event_handlers",
        "events",
        "frontend",
        "launch_description_sources",
        "logging",
        "substitutions",
        "utilities",
    ),
    gates={
        "SomeEntitiesType": Feature.SOME_ENTITIES_TYPE,
        "SomeEntitiesType_types_tuple": Feature.SOME_ENTITIES_TYPE,
    },
)
