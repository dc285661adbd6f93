"""The mask of a costmap filter of nav2: a server of the launch publishes the mask's topic in the filter info.

Source: ros-navigation/navigation2 jazzy f4108e5, nav2_costmap_2d/plugins/costmap_filters/keepout_filter.cpp and its
siblings. The filter subscribes to the topic in that message, on its own node.
"""

from __future__ import annotations

from enclave_addons.library.configuration.configured import Configured, collected, endpoint_named
from enclave_common.source_location import SourceLocation
from nodl.dependence import Situation
from nodl.names import InvalidNameError
from nodl.node_interface import EndpointKind, Gap

_MASK = "nav_msgs/msg/OccupancyGrid"


def of_filter_info(topic: str, situation: Situation, place: SourceLocation) -> Configured:
    """Return the masks that servers of the launch publish on the filter info ``topic``, or a gap if none does."""
    try:
        info = situation.remap(topic)
    except InvalidNameError as error:
        return Configured(gaps=(Gap(place, str(error)),))
    masks = [mask for published_on, mask in situation.launched.masks if published_on == info]
    if not masks:
        why = f"no costmap_filter_info_server of this launch tells the mask on {info}; name its topic with --policy"
        return Configured(gaps=(Gap(place, why),))
    note = f"published on {info}"
    return collected(endpoint_named(EndpointKind.SUBSCRIPTION, mask, _MASK, place, note) for mask in masks)
