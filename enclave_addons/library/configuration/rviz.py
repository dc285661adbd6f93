"""An ``.rviz`` file: its displays and tools, enabled or not, and what each subscribes, publishes and calls.

A display that is switched off counts too: the file offers it, one click of the user starts it. Classes of other
packages are plugins for a document to describe; their properties are the parameters there, blanks written as ``_``.
Classes ``rviz/...``, in files from ROS 1, exist in no package of ROS 2: rviz2 loads nothing for them, nor for what has
no class. Source: ros2/rviz jazzy, rviz_default_plugins (displays, tools), rviz_common (display_group.cpp,
failed_display.cpp, tool_manager.cpp).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from enclave_addons.library.configuration.configured import Configured, ConfiguredPlugin, endpoint_named
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from nodl.node_interface import Endpoint, EndpointKind, Gap
from nodl.yaml_text import YamlMap, YamlScalar, YamlValue

_SUBSCRIBE, _PUBLISH = EndpointKind.SUBSCRIPTION, EndpointKind.PUBLISHER

_DEFAULT = "rviz_default_plugins/"
# Displays of one topic, the property "Topic", and its type.
_DISPLAYS = {
    "AccelStamped": "geometry_msgs/msg/AccelStamped",
    "Camera": "sensor_msgs/msg/Image",
    "CameraInfo": "sensor_msgs/msg/CameraInfo",
    "Effort": "sensor_msgs/msg/JointState",
    "FluidPressure": "sensor_msgs/msg/FluidPressure",
    "GridCells": "nav_msgs/msg/GridCells",
    "Illuminance": "sensor_msgs/msg/Illuminance",
    "Image": "sensor_msgs/msg/Image",
    "LaserScan": "sensor_msgs/msg/LaserScan",
    "Map": "nav_msgs/msg/OccupancyGrid",
    "Marker": "visualization_msgs/msg/Marker",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Odometry": "nav_msgs/msg/Odometry",
    "Path": "nav_msgs/msg/Path",
    "PointCloud": "sensor_msgs/msg/PointCloud",
    "PointCloud2": "sensor_msgs/msg/PointCloud2",
    "PointStamped": "geometry_msgs/msg/PointStamped",
    "Polygon": "geometry_msgs/msg/PolygonStamped",
    "Pose": "geometry_msgs/msg/PoseStamped",
    "PoseArray": "geometry_msgs/msg/PoseArray",
    "PoseWithCovariance": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "Range": "sensor_msgs/msg/Range",
    "RelativeHumidity": "sensor_msgs/msg/RelativeHumidity",
    "Temperature": "sensor_msgs/msg/Temperature",
    "TwistStamped": "geometry_msgs/msg/TwistStamped",
    "Wrench": "geometry_msgs/msg/WrenchStamped",
}
# Tools that publish, with the topic that they have when the file names none.
_TOOLS = {
    "PublishPoint": ("/clicked_point", "geometry_msgs/msg/PointStamped"),
    "SetGoal": ("goal_pose", "geometry_msgs/msg/PoseStamped"),
    "SetInitialPose": ("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
}
_TOPICS_OF_DEFAULT = {f"/{name.lstrip('/')}": kind for name, kind in _TOOLS.values()}
_OF_ROS_1 = "rviz/"
_SILENT_DISPLAYS = ("Axes", "Grid", "TF")  # /tf is the listener's, which every rviz2 has
_SILENT_TOOLS = ("FocusCamera", "Interact", "Measure", "MoveCamera", "Select")


def default(place: SourceLocation, *, requested: bool) -> Configured:
    """Return what rviz2 needs for rviz_common/default.rviz, which it loads if its configuration file does not exist.

    ``requested``: the launch names that file, so that the user expects it.
    Source: visualization_frame.cpp, ``loadDisplayConfig``.
    """
    note = f"the default configuration of rviz2, as {place.file} does not exist"
    made = (endpoint_named(_PUBLISH, name, kind, place, note) for name, kind in _TOPICS_OF_DEFAULT.items())
    missing = f"the file {place.file} does not exist: rviz2 loads its default configuration"
    endpoints = tuple(each for each in made if isinstance(each, Endpoint))
    return Configured(endpoints, unused=(missing,) if requested else ())


def of_file(root: YamlValue, distro: str) -> Configured:
    """Return what rviz2 needs for the configuration ``root``."""
    reading = _Reading(distro)
    if isinstance(root, YamlMap):
        manager = root.mapping("Visualization Manager")
        for display in manager.mappings("Displays"):
            reading.display(display)
        for tool in manager.mappings("Tools"):
            reading.tool(tool)
        for panel in root.mappings("Panels"):
            reading.panel(panel)
    endpoints = tuple(dict.fromkeys(reading.endpoints))
    unused = tuple(dict.fromkeys(reading.unused))
    return Configured(endpoints, tuple(reading.gaps), plugins=tuple(reading.plugins), unused=unused)


@dataclass(slots=True)
class _Reading:
    distro: str
    endpoints: list[Endpoint] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    plugins: list[ConfiguredPlugin] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)

    def display(self, display: YamlMap) -> None:
        kind = display.text("Class")
        short = kind.removeprefix(_DEFAULT)
        if kind == "rviz_common/Group":
            for inner in display.mappings("Displays"):
                self.display(inner)
        elif short == kind or (
            short not in _DISPLAYS and short not in _SPECIAL and short not in _SILENT_DISPLAYS
        ):
            self._of_another_package(display, "display", kind)
        elif short in _SPECIAL:
            _SPECIAL[short](self, display)
        elif short in _DISPLAYS:
            self._topic(_SUBSCRIBE, *_topic(display, "Topic"), _DISPLAYS[short], f"display {kind}")
            if short in _MORE:
                _MORE[short](self, display)

    def tool(self, tool: YamlMap) -> None:
        kind = tool.text("Class")
        short = kind.removeprefix(_DEFAULT)
        if short in _TOOLS and short != kind:
            default, type_name = _TOOLS[short]
            name, place = _topic(tool, "Topic")
            self._topic(_PUBLISH, name or default, place, type_name, f"tool {kind}")
        elif short == kind or short not in _SILENT_TOOLS:
            self._of_another_package(tool, "tool", kind)

    def panel(self, panel: YamlMap) -> None:
        kind = panel.text("Class")
        if not kind.startswith("rviz_common/"):
            self._of_another_package(panel, "panel", kind)

    def robot_model(self, display: YamlMap) -> None:
        if display.text("Description Source") != "File":
            name, place = _topic(display, "Description Topic")
            self._topic(_SUBSCRIBE, name, place, "std_msgs/msg/String", "display of a robot model")

    def depth_cloud(self, display: YamlMap) -> None:
        name, place = _topic(display, "Depth Map Topic")
        self._topic(_SUBSCRIBE, name, place, "sensor_msgs/msg/Image", "display of a depth cloud")
        self._camera_info(name, place)
        name, place = _topic(display, "Color Image Topic")
        self._topic(_SUBSCRIBE, name, place, "sensor_msgs/msg/Image", "display of a depth cloud")

    def interactive_markers(self, display: YamlMap) -> None:
        name, place = _topic(display, "Interactive Markers Namespace")
        if not name:
            return
        why = "display of interactive markers"
        self._topic(
            _SUBSCRIBE, f"{name}/update", place, "visualization_msgs/msg/InteractiveMarkerUpdate", why
        )
        self._topic(
            _PUBLISH, f"{name}/feedback", place, "visualization_msgs/msg/InteractiveMarkerFeedback", why
        )
        type_name = "visualization_msgs/srv/GetInteractiveMarkers"
        self._topic(EndpointKind.SERVICE_CLIENT, f"{name}/get_interactive_markers", place, type_name, why)

    def camera(self, display: YamlMap) -> None:
        self._camera_info(*_topic(display, "Topic"))

    def map(self, display: YamlMap) -> None:
        name, place = _topic(display, "Update Topic")
        if not name:
            name, place = _topic(display, "Topic")
            name = name and f"{name}_updates"
        self._topic(_SUBSCRIBE, name, place, "map_msgs/msg/OccupancyGridUpdate", "display of a map")

    def marker(self, display: YamlMap) -> None:
        name, place = _topic(display, "Topic")
        type_name = "visualization_msgs/msg/MarkerArray"
        self._topic(_SUBSCRIBE, name and f"{name}_array", place, type_name, "display of markers")

    def effort(self, display: YamlMap) -> None:
        name = display.text("Robot Description") or "robot_description"
        self._topic(_SUBSCRIBE, name, display.source, "std_msgs/msg/String", "display of efforts")

    def _camera_info(self, image: str, place: SourceLocation) -> None:
        """Add the name beside the image, as ``image_transport::getCameraInfoTopic`` does."""
        if image:
            beside = f"{image.rpartition('/')[0]}/camera_info" if "/" in image else "camera_info"
            self._topic(_SUBSCRIBE, beside, place, "sensor_msgs/msg/CameraInfo", "camera of a display")

    def _topic(self, kind: EndpointKind, name: str, place: SourceLocation, type_name: str, why: str) -> None:
        if not name:
            return  # rviz subscribes nothing until the user chooses a topic
        made = endpoint_named(kind, name, type_name, place, why)
        if isinstance(made, Endpoint):
            self.endpoints.append(made)
        else:
            self.gaps.append(made)

    def _of_another_package(self, item: YamlMap, what: str, kind: str) -> None:
        if not kind:
            self.unused.append(f"{item.source}: rviz2 loads nothing for a {what} without Class")
        elif not kind.startswith(_OF_ROS_1):
            shown_as = f"{what} of class {quoted(kind)}"
            self.plugins.append(ConfiguredPlugin(shown_as, kind, item.source, dict(_properties(item, ""))))


_SPECIAL = {
    "DepthCloud": _Reading.depth_cloud,
    "InteractiveMarkers": _Reading.interactive_markers,
    "RobotModel": _Reading.robot_model,
}
_MORE = {"Camera": _Reading.camera, "Effort": _Reading.effort, "Map": _Reading.map, "Marker": _Reading.marker}


def _properties(item: YamlMap, prefix: str) -> Iterator[tuple[str, object]]:
    """Yield each property and those below it, ``Planned_Path.Trajectory_Topic``; a topic by its ``Value``."""
    for key, value in item.items.items():
        name = f"{prefix}{key.replace(' ', '_')}"
        if isinstance(value, YamlScalar):
            yield name, value.value
        elif isinstance(value, YamlMap):
            if "Value" in value.items:
                yield name, value.text("Value")
            yield from _properties(value, f"{name}.")


def _topic(display: YamlMap, key: str) -> tuple[str, SourceLocation]:
    """Return the name in a topic property: a mapping with ``Value`` (and QoS), or in older files the name itself."""
    found = display.items.get(key)
    if isinstance(found, YamlMap):
        return found.text("Value"), found.source
    return display.text(key), display.source
