"""The differences of ROS 2 releases, in one table.

A feature belongs to the version of ``launch``, ``launch_ros`` or ``rcl`` that brought it, not to the distribution:
every release gets fixes. Where the ament index holds the installed packages their version decides; else the version
below: the one the rule was checked with (humble, jazzy, rolling) or the newest in the change logs (kilted, lyrical:
not run).

``rolling`` stands for the snapshot that was run (launch 3.7.1). It also accepts later *names* - actions,
substitutions, classes that the snapshot would refuse - because they can change nothing that it accepts.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from nodl.package_xml import read_package_xml

Version = tuple[int, ...]
ALWAYS: Version = (0,)


class Distro(str, Enum):
    """The distributions that are known, oldest first; the last is the default."""

    __str__ = str.__str__

    HUMBLE = "humble"
    JAZZY = "jazzy"
    KILTED = "kilted"
    LYRICAL = "lyrical"
    ROLLING = "rolling"


class Since(NamedTuple):
    """The first version with a feature, per distribution; ``None``: not in that series."""

    what: str
    package: str = "launch"
    humble: Version | None = None
    jazzy: Version | None = ALWAYS
    kilted: Version | None = ALWAYS
    lyrical: Version | None = ALWAYS
    rolling: Version | None = ALWAYS
    source: str = "run: launch 1.0.7 against 3.4.3 and 3.7.1"


_LAUNCH_LOG = "launch/CHANGELOG.rst"
_LAUNCH_ROS_LOG = "launch_ros/CHANGELOG.rst"


class _Table(type):
    """A table of features. ``Enum`` would do, but takes twice as long to define one with so many members."""

    def __iter__(cls) -> Iterator[Since]:
        return (row for row in vars(cls).values() if isinstance(row, Since))


class Feature(metaclass=_Table):
    """Each row: what it switches, since when, and where that is known from."""

    BOOLEAN_DIGITS = Since("typed booleans accept 1 and 0", humble=(1, 0, 9))
    EQUALS_IF = Since("substitutions equals, not-equals, if, any, all", humble=(1, 0, 9))
    FILE_CONTENT = Since("substitution file-content", humble=(1, 0, 11))
    LAUNCH_LOG_DIR = Since("substitution launch_log_dir, class LaunchLogDir")
    PARAMETER_DEFAULT = Since("param substitution takes a default", "launch_ros")
    EVAL_MODULES = Since("eval takes modules, and knows math itself")
    EXIT_AND_TTY_ATTRIBUTES = Since("XML process attributes on_exit, emulate_tty", humble=(1, 0, 9))
    TIMEOUT_ATTRIBUTES = Since("XML process attributes respawn_max_retries, sigterm_timeout, sigkill_timeout")
    SET_ROS_LOG_DIR = Since("action set_ros_log_dir, class SetROSLogDir", "launch_ros")
    LIFECYCLE_TRANSITION = Since("class LifecycleTransition", "launch_ros", humble=(0, 19, 10))
    CAPITAL_ROS_NAMES = Since("classes PushROSNamespace, ROSTimer", "launch_ros")
    LOAD_CONDITIONS = Since("conditions on the nodes of load_composable_node", "launch_ros")
    FLAT_ANONYMOUS_NAMES = Since("anon names are launch configurations of their own")
    SOME_ENTITIES_TYPE = Since("module launch.some_entities_type")
    PARAMETER_NAME_IN_ERRORS = Since("messages about parameter values name the parameter", "launch_ros")
    DEPRECATED_CONFIGURATION_EQUALS = Since("LaunchConfigurationEquals warns")
    ANY_ALL_ARGUMENTS = Since(
        "any and all take their arguments in XML and YAML",
        humble=(1, 0, 11), jazzy=(3, 4, 5), kilted=(3, 8, 1), rolling=(3, 9), source=_LAUNCH_LOG,
    )  # fmt: skip
    PATH_SUBSTITUTION = Since(
        "class PathSubstitution, operator / on paths",
        humble=(1, 0, 11), jazzy=(3, 4, 5), kilted=(3, 8, 1), source=_LAUNCH_LOG,
    )  # fmt: skip
    PATHLIB_IS_TEXT = Since(
        "pathlib.Path where text is expected",
        humble=(1, 0, 14), jazzy=(3, 4, 10), kilted=(3, 8, 6), rolling=(3, 9), source=_LAUNCH_LOG,
    )  # fmt: skip
    TIMER_COPIES_CONFIGURATIONS = Since(
        "timers keep the launch configurations of their position",
        jazzy=(3, 4, 5), kilted=(3, 8, 1), rolling=(3, 9), source=_LAUNCH_LOG,
    )  # fmt: skip
    LET_IN_INCLUDE = Since("let inside include", jazzy=(3, 4, 6), kilted=(3, 8, 1), source=_LAUNCH_LOG)
    NESTED_PATH_JOIN = Since(
        "nested lists in PathJoinSubstitution", jazzy=None, kilted=(3, 8, 1), source=_LAUNCH_LOG
    )
    FOR_EACH = Since("for_each and for-var", jazzy=None, kilted=(3, 8, 0), source=_LAUNCH_LOG)
    FOR_LOOP = Since("for and index", jazzy=None, kilted=(3, 8, 0), source=f"{_LAUNCH_LOG} (for)")
    STRING_JOIN = Since("class StringJoinSubstitution", jazzy=None, kilted=(3, 8, 1), source=_LAUNCH_LOG)
    JOIN_IN_FRONTENDS = Since(
        "substitutions string-join, path-join", jazzy=None, kilted=None, source=_LAUNCH_LOG
    )
    LOG_LEVEL_ACTIONS = Since(
        "log_info and its siblings, level of log", jazzy=None, kilted=None, source=_LAUNCH_LOG
    )
    LOG_NEEDS_LEVEL = Since(
        "log must name its level", jazzy=None, kilted=None, rolling=(3, 9), source=_LAUNCH_LOG
    )
    SCOPED_FILE_LOCALS = Since(
        "dirname and filename end with the include",
        jazzy=None, kilted=None, rolling=(3, 9), source=_LAUNCH_LOG,
    )  # fmt: skip
    TIMER_CAPTURES_ENVIRONMENT = Since(
        "timers keep the environment of their position",
        jazzy=None, kilted=None, rolling=(3, 9), source=_LAUNCH_LOG,
    )  # fmt: skip
    DECLARE_BOOLEAN = Since("class DeclareBooleanLaunchArgument", jazzy=None, kilted=None, source=_LAUNCH_LOG)
    WILDCARD_SECTIONS = Since(
        "wildcard sections in parameter files of components", "launch_ros",
        humble=(0, 19, 10), jazzy=(0, 26, 7), kilted=(0, 28, 1), rolling=(0, 29), source=_LAUNCH_ROS_LOG,
    )  # fmt: skip
    SIM_TIME_IN_FRONTENDS = Since(
        "set_use_sim_time evaluates its value in XML and YAML", "launch_ros",
        humble=(0, 19, 10), jazzy=(0, 26, 7), kilted=(0, 28, 1), rolling=(0, 29), source=_LAUNCH_ROS_LOG,
    )  # fmt: skip
    LIFECYCLE_AUTOSTART = Since(
        "autostart of lifecycle nodes", "launch_ros",
        jazzy=(0, 26, 7), kilted=(0, 28, 1), source=_LAUNCH_ROS_LOG,
    )  # fmt: skip
    QUOTED_TEXT_PARAMETERS = Since(
        "text parameters are always quoted in parameter files", "launch_ros",
        jazzy=None, kilted=(0, 28, 1), rolling=(0, 29), source=_LAUNCH_ROS_LOG,
    )  # fmt: skip
    LIFECYCLE_TAGS = Since(
        "tags lifecycle_node and composable_lifecycle_node", "launch_ros",
        jazzy=None, kilted=None, source=_LAUNCH_ROS_LOG,
    )  # fmt: skip


REMAPS_WHOLE_ACTIONS = frozenset({Distro.KILTED, Distro.LYRICAL, Distro.ROLLING})
"""Where rcl remaps the name of an action as a whole (ros2/rcl pull request 1170); elsewhere its five names apart."""

_VERSIONS: dict[Distro, tuple[Version, Version]] = {
    Distro.HUMBLE: ((1, 0, 7), (0, 19, 8)),
    Distro.JAZZY: ((3, 4, 3), (0, 26, 6)),
    Distro.KILTED: ((3, 8, 6), (0, 28, 4)),
    Distro.LYRICAL: ((3, 9, 5), (0, 29, 6)),
    Distro.ROLLING: ((3, 7, 1), (0, 28, 0)),
}


class Release(NamedTuple):
    """A distribution with the versions of its launch packages; asks the table."""

    distro: Distro
    launch: Version
    launch_ros: Version
    features: frozenset[Since]

    def has(self, feature: Since) -> bool:
        return feature in self.features


@lru_cache(maxsize=32)
def release_of(distro: Distro, launch: Version | None = None, launch_ros: Version | None = None) -> Release:
    """Return the release of ``distro`` with these versions, by default those of the reference snapshots."""
    default_launch, default_ros = _VERSIONS[distro]
    launch, launch_ros = launch or default_launch, launch_ros or default_ros
    features = frozenset(
        feature
        for feature in Feature
        if _has(feature, distro, launch_ros if feature.package == "launch_ros" else launch)
    )
    return Release(distro, launch, launch_ros, features)


def _has(since: Since, distro: Distro, version: Version) -> bool:
    first: Version | None = getattr(since, distro.value)
    return first is not None and version >= first


def choose_release(name: str | None, environment_name: str | None, prefixes: Sequence[str] = ()) -> Release:
    """Return the release of ``--distro``, else ``ROS_DISTRO``, else the newest; an installed launch refines it.

    Raises ValueError for an unknown ``name``; an unknown ``ROS_DISTRO`` counts as the newest."""
    if name:
        distro = Distro(name)
    else:
        known = {distro.value: distro for distro in Distro}
        distro = known.get(environment_name or "", Distro.ROLLING)
    installed = (_installed_version("launch", prefixes), _installed_version("launch_ros", prefixes))
    default = _VERSIONS[distro]
    same_series = installed[0] is not None and installed[0][:2] == default[0][:2]
    return release_of(distro, *installed) if same_series else release_of(distro)


def _installed_version(package: str, prefixes: Sequence[str]) -> Version | None:
    for prefix in prefixes:
        version = read_package_xml(os.path.join(prefix, "share", package)).version
        if version:
            return tuple(map(int, version.split(".")))
    return None
