"""What a handler accepts as its result: one entity or several."""

from __future__ import annotations

import collections.abc

from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity

SomeEntitiesType = LaunchDescriptionEntity | collections.abc.Iterable[LaunchDescriptionEntity]
SomeEntitiesType_types_tuple = (LaunchDescriptionEntity, collections.abc.Iterable)
