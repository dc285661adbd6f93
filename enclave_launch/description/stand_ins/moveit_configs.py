"""``MoveItConfigsBuilder`` of ``moveit_configs_utils``: the parameters of MoveIt from the files of a robot's package.

It is used if the real package is not installed. The planning pipelines of a package are in the order of their names;
MoveIt has them in the order in which the folder lists them.
Source: what the package (https://github.com/moveit/moveit2, moveit_configs_utils) gives for the same files.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_launch.description.ament_index import get_package_share_directory
from enclave_launch.description.parameters.descriptions import ParameterValue
from enclave_launch.description.stand_ins.launch_param_builder import (
    ParameterBuilder,
    ParameterBuilderFileNotFoundError,
    load_xacro,
    load_yaml,
)
from enclave_launch.description.stand_ins.moveit_defaults import default_pipelines, ompl_planner_configs
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Distro

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext

_Mappings = Mapping[Any, Any]  # texts, or what becomes a text when the launch file is visited
_CONFIG = Path("config")


class Xacro(Substitution):
    """The description that xacro makes of a file. ``mappings``: argument -> value."""

    def __init__(self, file_path: SomeSubstitutionsType, *, mappings: _Mappings | None = None) -> None:
        self.__file_path = normalize_to_list_of_substitutions(file_path)
        self.__mappings = mappings or {}

    @property
    def file_path(self) -> list[Substitution]:
        return self.__file_path

    @property
    def mappings(self) -> _Mappings:
        return self.__mappings

    def describe(self) -> str:
        return f"Xacro(file_path = {self.__file_path}, mappings = {', '.join(map(str, self.__mappings))})"

    def perform(self, context: LaunchContext) -> str:
        def text(value: SomeSubstitutionsType) -> str:
            return perform_substitutions(context, normalize_to_list_of_substitutions(value))

        mappings = {text(name): text(value) for name, value in self.__mappings.items()}
        return load_xacro(Path(perform_substitutions(context, self.__file_path)), mappings=mappings)


@dataclass(slots=True)
class MoveItConfigs:
    """The parameters of MoveIt, by subject."""

    package_path: Path | None = None
    robot_description: dict[str, Any] = field(default_factory=dict)
    robot_description_semantic: dict[str, Any] = field(default_factory=dict)
    robot_description_kinematics: dict[str, Any] = field(default_factory=dict)
    planning_pipelines: dict[str, Any] = field(default_factory=dict)
    trajectory_execution: dict[str, Any] = field(default_factory=dict)
    planning_scene_monitor: dict[str, Any] = field(default_factory=dict)
    sensors_3d: dict[str, Any] = field(default_factory=dict)
    move_group_capabilities: dict[str, Any] = field(
        default_factory=lambda: {"capabilities": "", "disable_capabilities": ""}
    )
    joint_limits: dict[str, Any] = field(default_factory=dict)
    moveit_cpp: dict[str, Any] = field(default_factory=dict)
    pilz_cartesian_limits: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return all parameters but the capabilities of move_group."""
        parameters = {
            **self.robot_description,
            **self.robot_description_semantic,
            **self.robot_description_kinematics,
            **self.planning_pipelines,
            **self.trajectory_execution,
            **self.planning_scene_monitor,
            **self.sensors_3d,
            **self.joint_limits,
            **self.moveit_cpp,
        }
        if self.pilz_cartesian_limits:
            limits = self.pilz_cartesian_limits["robot_description_planning"]
            parameters["robot_description_planning"].update(limits)
        return parameters


class MoveItConfigsBuilder(ParameterBuilder):
    """Read the files of a robot's MoveIt package. What no method was called for is read from its usual place.

    Args:
        robot_name: Prefix of the package's name, and of the names of its files.
        robot_description: Name of the parameter with the URDF, and prefix of those that belong to it.
        package_name: Name of the package; by default ``ROBOT_moveit_config``.
    """

    def __init__(
        self, robot_name: str, robot_description: str = "robot_description", package_name: str | None = None
    ) -> None:
        super().__init__(package_name or f"{robot_name}_moveit_config")
        self.__moveit_configs = MoveItConfigs(package_path=self._package_path)
        self.__robot_name = robot_name
        self.__robot_description = robot_description
        self.__urdf: Path | None = None
        self.__urdf_arguments: dict[str, str] | None = None
        self.__srdf: Path | None = None
        modified_urdf = self._package_path / _CONFIG / f"{robot_name}.urdf.xacro"
        if modified_urdf.exists():
            self.__urdf = modified_urdf
        assistant = self._package_path / ".setup_assistant"
        if assistant.exists():
            self.__read_setup_assistant(load_yaml(assistant).get("moveit_setup_assistant_config", {}))
        if self.__urdf is None:
            self.__urdf = self.__guess("URDF", ".urdf")
        if self.__srdf is None:
            self.__srdf = self.__guess("SRDF", ".srdf")

    def __read_setup_assistant(self, config: Mapping[str, Any]) -> None:
        if urdf := config.get("urdf", config.get("URDF")):
            if self.__urdf is None:
                self.__urdf = Path(get_package_share_directory(urdf["package"])) / urdf["relative_path"]
            if arguments := urdf.get("xacro_args"):
                self.__urdf_arguments = dict(word.split(":=") for word in arguments.split(" ") if word)
        if srdf := config.get("srdf", config.get("SRDF")):
            self.__srdf = Path(srdf["relative_path"])

    def __guess(self, what: str, ending: str) -> Path:
        guess = _CONFIG / f"{self.__robot_name}{ending}"
        logging.warning("Cannot infer %s from `%s`. -- using %s", what, self._package_path, guess)
        return self._package_path / guess if what == "URDF" else guess

    def robot_description(
        self, file_path: str | None = None, mappings: _Mappings | None = None
    ) -> MoveItConfigsBuilder:
        """Read the URDF, through xacro. One that does not exist is expected on a topic."""
        assert self.__urdf is not None
        path = self.__urdf if file_path is None else self._package_path / file_path
        if not _are_texts(mappings):
            self.__moveit_configs.robot_description = {self.__robot_description: _later(path, mappings)}
            return self
        try:
            text = load_xacro(path, mappings=mappings or self.__urdf_arguments)
        except ParameterBuilderFileNotFoundError as error:
            logging.warning("%s", error)
            logging.warning("The robot description will be loaded from /robot_description topic")
        else:
            self.__moveit_configs.robot_description = {self.__robot_description: text}
        return self

    def robot_description_semantic(
        self, file_path: str | None = None, mappings: _Mappings | None = None
    ) -> MoveItConfigsBuilder:
        """Read the SRDF, through xacro."""
        assert self.__srdf is not None
        path = self._package_path / (file_path or self.__srdf)
        name = f"{self.__robot_description}_semantic"
        value = load_xacro(path, mappings=mappings) if _are_texts(mappings) else _later(path, mappings)
        self.__moveit_configs.robot_description_semantic = {name: value}
        return self

    def robot_description_kinematics(self, file_path: str | None = None) -> MoveItConfigsBuilder:
        """Read the parameters of the IK solvers."""
        values = self.__yaml(file_path, "kinematics.yaml")
        self.__moveit_configs.robot_description_kinematics = {
            f"{self.__robot_description}_kinematics": values
        }
        return self

    def joint_limits(self, file_path: str | None = None) -> MoveItConfigsBuilder:
        """Read the limits of position, velocity and acceleration that replace those of the URDF."""
        values = self.__yaml(file_path, "joint_limits.yaml")
        self.__moveit_configs.joint_limits = {f"{self.__robot_description}_planning": values}
        return self

    def moveit_cpp(self, file_path: str | None = None) -> MoveItConfigsBuilder:
        self.__moveit_configs.moveit_cpp = self.__yaml(file_path, "moveit_cpp.yaml")
        return self

    def trajectory_execution(
        self, file_path: str | None = None, moveit_manage_controllers: bool = True
    ) -> MoveItConfigsBuilder:
        """Read the parameters of the controllers; without a path those of the likeliest ``*_controllers.yaml``."""
        self.__moveit_configs.trajectory_execution = {"moveit_manage_controllers": moveit_manage_controllers}
        path = self._package_path / file_path if file_path is not None else self.__controllers_file()
        if path is not None:
            self.__moveit_configs.trajectory_execution.update(load_yaml(path))
        return self

    def __controllers_file(self) -> Path | None:
        folder = self._package_path / _CONFIG
        names = _prefixes_before(folder, "_controllers.yaml")
        if not names:
            logging.warning(
                "trajectory_execution: `Parameter file_path is undefined and no matches for %s/*_controllers.yaml",
                folder,
            )
            return None
        usual = [name for name in ("moveit", "moveit2", self.__robot_name) if name in names]
        if len(names) > 1 and not usual:
            options = "\n - ".join(f"{name}_controllers.yaml" for name in names)
            raise RuntimeError(
                f"trajectory_execution: Unable to guess which parameter file to load. Options:\n - {options}"
            )
        return folder / f"{names[0] if len(names) == 1 else usual[0]}_controllers.yaml"

    def planning_scene_monitor(
        self,
        publish_planning_scene: bool = True,
        publish_geometry_updates: bool = True,
        publish_state_updates: bool = True,
        publish_transforms_updates: bool = True,
        publish_robot_description: bool = False,
        publish_robot_description_semantic: bool = False,
    ) -> MoveItConfigsBuilder:
        self.__moveit_configs.planning_scene_monitor = {
            "publish_planning_scene": publish_planning_scene,
            "publish_geometry_updates": publish_geometry_updates,
            "publish_state_updates": publish_state_updates,
            "publish_transforms_updates": publish_transforms_updates,
            "publish_robot_description": publish_robot_description,
            "publish_robot_description_semantic": publish_robot_description_semantic,
        }
        return self

    def sensors_3d(self, file_path: str | None = None) -> MoveItConfigsBuilder:
        """Read the parameters of 3D sensors, if there is such a file and it lists a sensor."""
        path = self._package_path / (file_path or _CONFIG / "sensors_3d.yaml")
        if path.exists():
            values = load_yaml(path)
            if len(values["sensors"]) > 0 and values["sensors"][0]:
                self.__moveit_configs.sensors_3d = values
        return self

    def planning_pipelines(
        self,
        default_planning_pipeline: str | None = None,
        pipelines: list[str] | None = None,
        load_all: bool = True,
    ) -> MoveItConfigsBuilder:
        """Read the parameters of planning pipelines.

        Args:
            default_planning_pipeline: The pipeline to use by default: ``ompl``, or the first.
            pipelines: Names of the pipelines; by default those with a file in the package.
            load_all: Whether MoveIt's own pipelines are added to those of the package.
        """
        defaults = default_pipelines(is_humble=current_release().distro is Distro.HUMBLE)
        folder = self._package_path / _CONFIG
        if pipelines is None:
            pipelines = _prefixes_before(folder, "_planning.yaml")
            pipelines += [name for name in defaults if load_all and name not in pipelines]
        default = default_planning_pipeline or ("ompl" if "ompl" in pipelines else pipelines[0])
        if default not in pipelines:
            raise RuntimeError(
                f"default_planning_pipeline: `{default}` doesn't name any of the input pipelines "
                f"`{','.join(pipelines)}`"
            )
        values: dict[str, Any] = {"planning_pipelines": pipelines, "default_planning_pipeline": default}
        for name in pipelines:
            path = folder / f"{name}_planning.yaml"
            values[name] = defaults[name] if name in defaults and not path.exists() else load_yaml(path)
        if "ompl" in values and "planner_configs" not in values["ompl"]:
            values["ompl"].update(ompl_planner_configs())
        self.__moveit_configs.planning_pipelines = values
        return self

    def pilz_cartesian_limits(self, file_path: str | None = None) -> MoveItConfigsBuilder:
        if (self._package_path / _CONFIG / "cartesian_limits.yaml").exists():
            logging.warning(
                "cartesian_limits.yaml is deprecated, please rename to pilz_cartesian_limits.yaml"
            )
        values = self.__yaml(file_path, "pilz_cartesian_limits.yaml")
        self.__moveit_configs.pilz_cartesian_limits = {f"{self.__robot_description}_planning": values}
        return self

    def __yaml(self, file_path: str | None, usual: str) -> Any:
        return load_yaml(self._package_path / (file_path or _CONFIG / usual))

    def to_moveit_configs(self) -> MoveItConfigs:
        """Return the parameters, after reading from their usual places what was not read yet."""
        configs = self.__moveit_configs
        for is_read, read in (
            (configs.robot_description, self.robot_description),
            (configs.robot_description_semantic, self.robot_description_semantic),
            (configs.robot_description_kinematics, self.robot_description_kinematics),
            (configs.planning_pipelines, self.planning_pipelines),
            (configs.trajectory_execution, self.trajectory_execution),
            (configs.planning_scene_monitor, self.planning_scene_monitor),
            (configs.sensors_3d, self.sensors_3d),
            (configs.joint_limits, self.joint_limits),
        ):
            if not is_read:
                read()
        if (
            "pilz_industrial_motion_planner" in configs.planning_pipelines
            and not configs.pilz_cartesian_limits
        ):
            self.pilz_cartesian_limits()
        return configs

    def to_dict(self, include_moveit_configs: bool = True) -> dict[str, Any]:
        """Return what ``ParameterBuilder`` collected, with the parameters of MoveIt unless they are not wanted."""
        if include_moveit_configs:
            self._parameters.update(self.to_moveit_configs().to_dict())
        return self._parameters


def get_pattern_matches(folder: Path, pattern: re.Pattern[str]) -> list[Any]:
    """Return the files of a folder that match, or the first group of each match if the pattern has groups."""
    files = sorted(child for child in folder.iterdir() if child.is_file()) if folder.exists() else []
    matches = [(child, pattern.search(child.name)) for child in files]
    return [match.group(1) if match.groups() else child for child, match in matches if match]


def _prefixes_before(folder: Path, ending: str) -> list[str]:
    return get_pattern_matches(folder, re.compile(f"^(.*){ending}$"))


def _are_texts(mappings: _Mappings | None) -> bool:
    return all(isinstance(text, str) for pair in (mappings or {}).items() for text in pair)


def _later(path: Path, mappings: _Mappings | None) -> ParameterValue:
    return ParameterValue(Xacro(str(path), mappings=mappings), value_type=str)
