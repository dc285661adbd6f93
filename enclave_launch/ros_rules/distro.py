"""The differences of ROS 2 releases, in one table.

A feature belongs to the version of ``launch``, ``launch_ros`` or ``rcl`` that brought it, not to the distribution:
every distribution gets patch releases. Where the ament index holds a package of the distribution's series, its version
decides. Else the newest known patch release decides, or the newest one of the date in ``--distro jazzy@2025-03``.

``docs/ros2.md`` shows the table to users.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

from nodl.package_xml import read_package_xml

Version = tuple[int, ...]
ALWAYS: Version = (0,)


class Distro(str, Enum):
    """The distributions that are known, oldest first."""

    __str__ = str.__str__

    HUMBLE = "humble"
    JAZZY = "jazzy"
    KILTED = "kilted"
    LYRICAL = "lyrical"
    ROLLING = "rolling"


DEFAULT = Distro.LYRICAL  # the newest that is released as a distribution; rolling is what comes next


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

    def first_in(self, distro: Distro) -> Version | None:
        """Return the first version with it in the series of ``distro``; ``None`` if the series lacks it."""
        version: Version | None = getattr(self, distro.value)
        return version


_LAUNCH_LOG = "change log of launch: ros2/launch"
_LAUNCH_ROS_LOG = "change log of launch_ros: ros2/launch_ros"


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
    LIFECYCLE_TRANSITION = Since("class LifecycleTransition", "launch_ros", humble=(0, 19, 11))
    CAPITAL_ROS_NAMES = Since("classes PushROSNamespace, ROSTimer", "launch_ros")
    LOAD_CONDITIONS = Since("conditions on the nodes of load_composable_node", "launch_ros")
    FLAT_ANONYMOUS_NAMES = Since("anon names are launch configurations of their own")
    SOME_ENTITIES_TYPE = Since("module launch.some_entities_type")
    PARAMETER_NAME_IN_ERRORS = Since("messages about parameter values name the parameter", "launch_ros")
    DEPRECATED_CONFIGURATION_EQUALS = Since("LaunchConfigurationEquals warns")
    ANY_ALL_ARGUMENTS = Since(
        "any and all take their arguments in XML and YAML",
        humble=(1, 0, 12), jazzy=(3, 4, 8), kilted=(3, 8, 5), rolling=(3, 9, 4), source=f"{_LAUNCH_LOG}#906",
    )  # fmt: skip
    PATH_JOIN_OPERATOR = Since(
        "operator / on PathJoinSubstitution, class PathSubstitution",
        humble=(1, 0, 9), jazzy=(3, 4, 5), kilted=(3, 8, 2), rolling=(3, 9, 1), source=f"{_LAUNCH_LOG}#868",
    )  # fmt: skip
    DIRECTORY_OPERATOR = Since(
        "operator / on ThisLaunchFileDir and LaunchLogDir",
        humble=(1, 0, 13), jazzy=(3, 4, 9), kilted=(3, 8, 6), rolling=(3, 9, 5), source=f"{_LAUNCH_LOG}#914",
    )  # fmt: skip
    PACKAGE_OPERATOR = Since(
        "operator / on FindPackageShare and FindPackagePrefix", "launch_ros",
        humble=(0, 19, 13), jazzy=(0, 26, 10), kilted=(0, 28, 4), rolling=(0, 29, 4),
        source=f"{_LAUNCH_ROS_LOG}#494 (humble, kilted: by date)",
    )  # fmt: skip
    PATHLIB_IS_TEXT = Since(
        "pathlib.Path where text is expected",
        humble=(1, 0, 14), jazzy=(3, 4, 10), kilted=(3, 8, 7), rolling=(3, 9, 1),
        source=f"{_LAUNCH_LOG}#873 (kilted: by date)",
    )  # fmt: skip
    TIMER_COPIES_CONFIGURATIONS = Since(
        "timers keep the namespace and configurations of their position",
        jazzy=(3, 4, 5), kilted=(3, 8, 1), rolling=(3, 8, 1), source=f"{_LAUNCH_LOG}#836",
    )  # fmt: skip
    LET_IN_INCLUDE = Since(
        "let inside include",
        jazzy=(3, 4, 7), kilted=(3, 8, 4), rolling=(3, 9, 3), source=f"{_LAUNCH_LOG}#848",
    )  # fmt: skip
    NESTED_PATH_JOIN = Since(
        "nested lists in PathJoinSubstitution",
        jazzy=None, kilted=(3, 8, 1), rolling=(3, 8, 1), source=f"{_LAUNCH_LOG}#838",
    )  # fmt: skip
    FOR_EACH = Since(
        "for_each and for-var",
        jazzy=None, kilted=(3, 8, 0), rolling=(3, 8, 0), source=f"{_LAUNCH_LOG}#802",
    )  # fmt: skip
    FOR_LOOP = Since(
        "for and index",
        jazzy=None, kilted=(3, 8, 0), rolling=(3, 8, 0),
        source=f"{_LAUNCH_LOG}#802 (that for came with for_each is inferred)",
    )  # fmt: skip
    STRING_JOIN = Since(
        "class StringJoinSubstitution",
        jazzy=None, kilted=(3, 8, 1), rolling=(3, 8, 1), source=f"{_LAUNCH_LOG}#843",
    )  # fmt: skip
    STRING_JOIN_IN_FRONTENDS = Since(
        "substitution string-join",
        jazzy=None, kilted=None, rolling=(3, 9, 5), source=f"{_LAUNCH_LOG}#857",
    )  # fmt: skip
    PATH_JOIN_IN_FRONTENDS = Since(
        "substitution path-join",
        jazzy=None, kilted=None, rolling=(3, 9, 7), source=f"{_LAUNCH_LOG}#943",
    )  # fmt: skip
    LOG_LEVEL_ACTIONS = Since(
        "log_info and its siblings, level of log, a warning for log without level",
        jazzy=None, kilted=None, rolling=(3, 9, 1), source=f"{_LAUNCH_LOG}#866",
    )  # fmt: skip
    SCOPED_FILE_LOCALS = Since(
        "dirname and filename end with the include",
        jazzy=None, kilted=None, rolling=(3, 9, 6), source=f"{_LAUNCH_LOG}#862",
    )  # fmt: skip
    TIMER_CAPTURES_ENVIRONMENT = Since(
        "timers keep the environment of their position",
        jazzy=None, kilted=None, rolling=(3, 9, 6), source=f"{_LAUNCH_LOG}#728",
    )  # fmt: skip
    REPLACE_ENVIRONMENT = Since(
        "action rep_env, class ReplaceEnvironmentVariables",
        jazzy=None, kilted=None, rolling=(3, 9, 6), source=f"{_LAUNCH_LOG}#728 (the version is inferred)",
    )  # fmt: skip
    DECLARE_BOOLEAN = Since(
        "bool_arg, class DeclareBooleanLaunchArgument",
        jazzy=None, kilted=None, rolling=(3, 9, 7), source=f"{_LAUNCH_LOG}#944",
    )  # fmt: skip
    WILDCARD_SECTIONS = Since(
        "wildcard sections in parameter files of components", "launch_ros",
        humble=(0, 19, 10), jazzy=(0, 26, 8), kilted=(0, 28, 2), rolling=(0, 29, 1),
        source=f"{_LAUNCH_ROS_LOG}#460",
    )  # fmt: skip
    SIM_TIME_IN_FRONTENDS = Since(
        "set_use_sim_time evaluates its value in XML and YAML", "launch_ros",
        humble=(0, 19, 12), jazzy=(0, 26, 9), kilted=(0, 28, 3), rolling=(0, 29, 3),
        source=f"{_LAUNCH_ROS_LOG}#488",
    )  # fmt: skip
    LIFECYCLE_AUTOSTART = Since(
        "autostart of lifecycle nodes, class ComposableLifecycleNode", "launch_ros",
        jazzy=(0, 26, 7), kilted=(0, 28, 1), rolling=(0, 28, 1), source=f"{_LAUNCH_ROS_LOG}#430",
    )  # fmt: skip
    QUOTED_TEXT_PARAMETERS = Since(
        "text parameters are always quoted in parameter files", "launch_ros",
        jazzy=None, kilted=(0, 28, 1), rolling=(0, 28, 1), source=f"{_LAUNCH_ROS_LOG}#436",
    )  # fmt: skip
    COMPOSABLE_LIFECYCLE_TAG = Since(
        "tag composable_lifecycle_node", "launch_ros",
        jazzy=None, kilted=None, rolling=(0, 29, 3), source=f"{_LAUNCH_ROS_LOG}#480",
    )  # fmt: skip
    LIFECYCLE_NODE_TAG = Since(
        "tag lifecycle_node, autostart of LifecycleNode as a substitution", "launch_ros",
        jazzy=(0, 26, 12), kilted=(0, 28, 6), rolling=(0, 29, 4),
        source=f"{_LAUNCH_ROS_LOG}#482 (the substitution: inferred)",
    )  # fmt: skip
    WHOLE_ACTIONS = Since(
        "a remap rule for an action's name moves the whole action", "rcl",
        jazzy=(9, 2, 9), source="ros2/rcl#1170, jazzy: #1220; measured: rcl 9.2.8 of jazzy does not",
    )  # fmt: skip


# The releases of each package with the day of its change log, oldest first. Where no change log was seen, the day is
# that of the sibling release, or that on which rosdistro had the version.
_RELEASES: dict[Distro, dict[str, str]] = {
    Distro.HUMBLE: {
        "launch": "1.0.7 2024-11-25, 1.0.8 2025-03-25, 1.0.9 2025-06-06, 1.0.10 2025-07-16, 1.0.11 2025-10-06, "
        "1.0.12 2025-10-17, 1.0.13 2025-11-07, 1.0.14 2026-01-12, 1.0.15 2026-09-07",
        "launch_ros": "0.19.8 2024-11-25, 0.19.9 2025-03-25, 0.19.10 2025-06-23, 0.19.11 2025-09-11, "
        "0.19.12 2025-09-15, 0.19.13 2025-11-07, 0.19.14 2026-07-02",
        "rcl": "5.3.9 2024-07-26, 5.3.13 2026-08-22",
    },
    Distro.JAZZY: {
        "launch": "3.4.2 2024-04-16, 3.4.3 2024-12-18, 3.4.4 2025-04-02, 3.4.5 2025-06-23, 3.4.6 2025-08-06, "
        "3.4.7 2025-10-06, 3.4.8 2025-10-17, 3.4.9 2025-11-07, 3.4.10 2026-01-12, 3.4.12 2026-09-18",
        "launch_ros": "0.26.5 2024-03-28, 0.26.6 2024-12-18, 0.26.7 2025-04-02, 0.26.8 2025-06-23, "
        "0.26.9 2025-09-15, 0.26.10 2025-11-07, 0.26.11 2026-01-12, 0.26.12 2026-07-02, 0.26.13 2026-09-18",
        "rcl": "9.2.4 2024-09-19, 9.2.5 2025-04-02, 9.2.6 2025-04-29, 9.2.7 2025-06-23, 9.2.8 2025-10-21, "
        "9.2.11 2026-08-22",
    },
    Distro.KILTED: {
        "launch": "3.8.1 2025-04-18, 3.8.2 2025-06-23, 3.8.3 2025-09-11, 3.8.4 2025-10-06, 3.8.5 2025-10-17, "
        "3.8.6 2025-11-07, 3.8.7 2026-01-12, 3.8.8 2026-07-14",
        "launch_ros": "0.28.1 2025-04-18, 0.28.2 2025-06-23, 0.28.3 2025-09-15, 0.28.4 2025-11-07, "
        "0.28.5 2026-01-12, 0.28.6 2026-07-02",
        "rcl": "10.1.5 2026-08-22",
    },
    Distro.LYRICAL: {
        "launch": "3.9.7 2026-04-09, 3.9.8 2026-07-14",
        "launch_ros": "0.29.8 2026-04-30, 0.29.9 2026-07-02",
        "rcl": "10.4.4 2026-04-30",
    },
    Distro.ROLLING: {
        "launch": "3.7.1 2024-12-20, 3.8.0 2025-02-27, 3.8.1 2025-04-18, 3.9.0 2025-04-24, 3.9.1 2025-06-19, "
        "3.9.2 2025-07-29, 3.9.3 2025-10-06, 3.9.4 2025-10-17, 3.9.5 2025-11-07, 3.9.6 2026-01-12, "
        "3.9.7 2026-04-09, 3.10.0 2026-05-07",
        "launch_ros": "0.28.0 2024-11-20, 0.28.1 2025-04-18, 0.29.0 2025-04-25, 0.29.1 2025-06-19, "
        "0.29.2 2025-07-29, 0.29.3 2025-10-17, 0.29.4 2025-11-07, 0.29.5 2026-01-12, 0.30.1 2026-07-02",
        "rcl": "10.5.2 2026-08-31",
    },
}
PACKAGES = ("launch", "launch_ros", "rcl")
_DAY = re.compile(r"\d{4}(-\d{2}(-\d{2})?)?")


def version_text(version: Version) -> str:
    """Return a version with points between its numbers."""
    return ".".join(map(str, version))


class Release(NamedTuple):
    """A distribution with the versions of the packages in the table; asks the table.

    ``installed``: the packages whose version was read. ``given``: those whose version a file of versions has. The
    versions of the others are assumed.
    """

    distro: Distro
    launch: Version
    launch_ros: Version
    rcl: Version
    features: frozenset[Since]
    installed: frozenset[str] = frozenset()
    given: frozenset[str] = frozenset()

    def has(self, feature: Since) -> bool:
        return feature in self.features

    @property
    def assumed(self) -> tuple[str, ...]:
        """Return the packages whose version is not known."""
        return tuple(package for package in PACKAGES if package not in self.installed | self.given)

    def hangs_on(self, feature: Since) -> bool:
        """Return True if another version of an assumed package would answer differently, within the distribution."""
        first = feature.first_in(self.distro)
        return feature.package in self.assumed and first is not None and first > self._oldest(feature.package)

    def _oldest(self, package: str) -> Version:
        return _version(_RELEASES[self.distro][package].split()[0])

    @property
    def versions(self) -> dict[str, str]:
        """Return the version of each package as text."""
        return {package: version_text(getattr(self, package)) for package in PACKAGES}

    def __str__(self) -> str:
        """Return the distribution and the versions in words, as for the first line of a plan."""
        groups: dict[str, list[str]] = {}
        for package, version in self.versions.items():
            how = (
                "assumed"
                if package in self.assumed
                else "installed"
                if package in self.installed
                else "given"
            )
            groups.setdefault(how, []).append(f"{package} {version}")
        return "; ".join([self.distro.value, *(f"{how}: {', '.join(of)}" for how, of in groups.items())])


def since_text(feature: Since, release: Release) -> str:
    """Return the version that brought ``feature`` to the distribution of ``release``; empty if none did."""
    first = feature.first_in(release.distro)
    return "" if first is None else version_text(first)


class WatchedRelease(Release):
    """A release that records which features it is asked for."""

    asked: set[Since]

    @classmethod
    def of(cls, release: Release) -> WatchedRelease:
        watched = cls(*release)
        watched.asked = set()
        return watched

    def has(self, feature: Since) -> bool:
        self.asked.add(feature)
        return super().has(feature)

    def uncertain(self) -> tuple[Since, ...]:
        """Return the features among them that other versions of assumed packages would not have, or would have."""
        return tuple(sorted(each for each in self.asked if self.hangs_on(each)))


@lru_cache(maxsize=32)
def release_of(
    distro: Distro,
    launch: Version | None = None,
    launch_ros: Version | None = None,
    rcl: Version | None = None,
    *,
    day: str = "",
    are_given: bool = False,
) -> Release:
    """Return the release of ``distro`` with these versions, by default the newest known until ``day``.

    ``are_given``: the versions are from a file, not from installed packages.

    Raises ``ValueError`` if no version of that time is known.
    """
    given = dict(zip(PACKAGES, (launch, launch_ros, rcl), strict=True))
    versions = {package: given[package] or _newest(distro, package, day) for package in PACKAGES}
    features = frozenset(each for each in Feature if _has(each, distro, versions[each.package]))
    known = frozenset(package for package in PACKAGES if given[package])
    return Release(
        distro,
        versions["launch"],
        versions["launch_ros"],
        versions["rcl"],
        features,
        installed=frozenset() if are_given else known,
        given=known if are_given else frozenset(),
    )


def _newest(distro: Distro, package: str, day: str) -> Version:
    """Return the newest version of a day that is, or begins with, ``day`` or is before it."""
    dated = [entry.split() for entry in _RELEASES[distro][package].split(", ")]
    until = [version for version, released in dated if not day or released[: len(day)] <= day]
    if not until and package != "rcl":
        raise ValueError(f"no version of {package} in {distro} is known from before {dated[0][1]}")
    return _version((until or [dated[0][0]])[-1])


def _has(since: Since, distro: Distro, version: Version) -> bool:
    first = since.first_in(distro)
    return first is not None and version >= first


def moves_whole_actions(distro: str, rcl: Version | None = None) -> bool:
    """Return whether rcl, by default the newest of ``distro``, remaps the name of an action as a whole."""
    return distro in list(Distro) and release_of(Distro(distro), rcl=rcl).has(Feature.WHOLE_ACTIONS)


Versions = tuple[tuple[str, str], ...]
"""Packages with the version of each."""

_PACKAGE_OF_ROS = re.compile(r"(?<![\w-])ros-([a-z]+)-([a-z0-9-]+?)(?::\w+)?\s+(\d+(?:\.\d+)+)")


def read_versions(text: str) -> tuple[Distro, Versions]:
    """Read the versions of a robot: the output of ``dpkg -l`` there, or of ``secure-plan doctor --versions``.

    Raises ``ValueError`` if it names no package of the table, or those of two distributions.
    """
    known = {distro.value: distro for distro in Distro}
    found: dict[Distro, dict[str, str]] = {}
    for name, package, version in _PACKAGE_OF_ROS.findall(text):
        if name in known and (module := package.replace("-", "_")) in PACKAGES:
            found.setdefault(known[name], {})[module] = version
    if len(found) != 1:
        several = f"packages of {' and '.join(found)}" if found else "no package such as ros-jazzy-launch"
        raise ValueError(
            f"it lists {several}; make it with dpkg -l on the robot, or secure-plan doctor --versions"
        )
    ((distro, versions),) = found.items()
    return distro, tuple(versions.items())


def list_versions(release: Release) -> str:
    """Return the installed packages as lines that ``read_versions`` reads."""
    return "".join(
        f"ros-{release.distro.value}-{package.replace('_', '-')} {release.versions[package]}\n"
        for package in PACKAGES
        if package in release.installed
    )


def choose_release(
    name: str | None, environment_name: str | None, prefixes: Sequence[str] = (), versions: Versions = ()
) -> Release:
    """Return the release of ``--distro``, else ``ROS_DISTRO``, else the newest distribution.

    Args:
        name: A distribution, or one with a day, month or year: ``jazzy``, ``jazzy@2025-03``.
        environment_name: The value of ``ROS_DISTRO``. An unknown one counts as the newest.
        prefixes: Where installed packages are looked for. Their versions decide, unless ``name`` has a day.
        versions: Versions that decide in their place.

    Returns:
        The release.

    Raises:
        ValueError: ``name`` is not a distribution, or nothing is known of that day.
    """
    if name:
        word, _, day = name.partition("@")
        if "@" in name and not _DAY.fullmatch(day):
            raise ValueError(f"'{day}' is not a day, month or year such as 2025-03")
        distro = Distro(word)
        if day:
            return release_of(distro, day=day)
    else:
        known = {distro.value: distro for distro in Distro}
        distro = known.get(environment_name or "", DEFAULT)
    if versions:
        texts = dict(versions)
        given = (_version(texts[package]) if package in texts else None for package in PACKAGES)
        return release_of(distro, *given, are_given=True)
    return release_of(distro, *(_installed_version(distro, package, prefixes) for package in PACKAGES))


def _installed_version(distro: Distro, package: str, prefixes: Sequence[str]) -> Version | None:
    """Return the version of an installed package; ``None`` if that is one of another distribution."""
    for prefix in prefixes:
        text = read_package_xml(os.path.join(prefix, "share", package)).version
        if text:
            version = _version(text)
            return version if _is_of_series(version, distro, package) else None
    return None


def _is_of_series(version: Version, distro: Distro, package: str) -> bool:
    first = _version(_RELEASES[distro][package].split()[0])
    if distro is Distro.ROLLING:
        return version >= first
    return version[:2] == first[:2]


def _version(text: str) -> Version:
    return tuple(map(int, text.split(".")))
