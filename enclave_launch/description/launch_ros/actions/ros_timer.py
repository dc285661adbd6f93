"""``ros_timer``: a timer on the ROS clock. What it starts, and in which order, is as for ``timer``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from enclave_launch.description.launch.actions.timer_action import TimerAction
from enclave_launch.description.launch.frontend import expose_action
from enclave_launch.description.launch.launch_description_entity import LaunchDescriptionEntity
from enclave_launch.description.launch.some_substitutions_type import (
    SomeSubstitutionsType,
    SomeSubstitutionsType_types_tuple,
)
from enclave_launch.description.launch.utilities import ensure_argument_type


@expose_action("ros_timer")
class ROSTimer(TimerAction):
    """``period`` is in seconds of ROS time."""

    def __init__(
        self,
        *,
        period: float | SomeSubstitutionsType,
        actions: Iterable[LaunchDescriptionEntity],
        **kwargs: Any,
    ):
        ensure_argument_type(period, (*SomeSubstitutionsType_types_tuple, float), "period", "ROSTimer")
        super().__init__(period=period, actions=actions, **kwargs)


RosTimer = ROSTimer  # the older name, the only one in humble
