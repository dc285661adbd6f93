"""Variables of a process that decide whether its enclave is used: those we set, those that could undo them, its domain.

The runtime lays its own values over ``ROS_SECURITY_*``, so a launch file cannot take the enclave away through them; a
warning says that they have no effect. Configurations of a DDS with security properties of their own are refused: which
of the two would win is a matter of the DDS and its version.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from enclave_common.environment import domain_id
from enclave_common.files import text_or_nothing
from enclave_launch.errors import UsageError
from keystore.errors import printable
from keystore.formats.domains import HIGHEST_ID

DOMAIN = "ROS_DOMAIN_ID"
OURS = (
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_KEYSTORE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_ENCLAVE_OVERRIDE",
)
ZENOH_SESSION = "ZENOH_SESSION_CONFIG_URI"
ZENOH_CLEARED = (
    "ZENOH_CONFIG_OVERRIDE",  # single settings, which win over the file
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "ROS_LOCALHOST_ONLY",
)
"""Variables that could lead a process on Zenoh past its configuration. Set to nothing, which counts as not set
(rcutils_get_env; rmw_zenoh_cpp zenoh_config.cpp, rcl discovery_options.c)."""
_CONFIGURATIONS = (
    "CYCLONEDDS_URI",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "NDDS_QOS_PROFILES",
)
_SECURITY = re.compile(r"<\s*(?:DDS)?Security\b|dds\.sec\.", re.IGNORECASE)
_PRELOAD = ("LD_PRELOAD", "LD_AUDIT")


class Setting(NamedTuple):
    """An environment variable as a launch file sets it."""

    variable: str
    value: str


def overridden(environment: Mapping[str, str], *, on_zenoh: bool = False) -> Iterator[Setting]:
    """Yield the variables that a launch file sets and a secured start overrides."""
    for name in (*OURS, *((ZENOH_SESSION, *ZENOH_CLEARED) if on_zenoh else ())):
        if name in environment:
            yield Setting(name, environment[name])


def preloaded(environment: Mapping[str, str]) -> Iterator[Setting]:
    """Return libraries that a launch file loads into the process before its own: they may do anything in it."""
    for name in _PRELOAD:
        if environment.get(name):
            yield Setting(name, environment[name])


def own_security(environment: Mapping[str, str]) -> Iterator[Setting]:
    """Find configurations of a DDS with security properties of their own; reads the files that they are in."""
    for name in _CONFIGURATIONS:
        # Cyclone DDS takes files and documents in one list, separated by commas, Connext by semicolons.
        for part in re.split("[,;]", environment.get(name, "")):
            text = part if "<" in part else text_or_nothing(part.strip().removeprefix("file://"))
            if _SECURITY.search(text):
                yield Setting(name, part)


def domain_of(environment: Mapping[str, str]) -> int:
    """Return the DDS domain of a process; raises UsageError for one that rcl, or Cyclone DDS, would refuse."""
    text = environment.get(DOMAIN, "")
    domain = domain_id(text)
    if domain is None or domain > HIGHEST_ID:
        raise UsageError(f"{DOMAIN} is {printable(text)}, not a domain id from 0 to {HIGHEST_ID}")
    return domain
