"""Variables of a process that decide whether its enclave is used: those we set, those that could undo them, its domain.

The runtime lays its own values over ``ROS_SECURITY_*``, so a launch file cannot take the enclave away through them; a
warning says that they have no effect. Security properties in a configuration of a DDS lose to ours (measured on Cyclone
DDS 0.10.2 and Fast DDS 2.9.1), so such a file can silence a process; a discovery server leads past the enclave. Both
are refused, and what cannot be read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from enclave_common.environment import domain_id
from enclave_common.files import text_or_nothing
from enclave_common.terminal import quoted
from enclave_launch.errors import UsageError
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
_ENVIRONMENT_FILE = "FASTDDS_ENVIRONMENT_FILE"
_DEFAULT_PROFILES, _SKIP_DEFAULT = "DEFAULT_FASTRTPS_PROFILES.xml", "SKIP_DEFAULT_XML_FILE"
_DISCOVERY_SERVER = "ROS_DISCOVERY_SERVER"
_NAMES_SERVER = re.compile(
    r"ROS_DISCOVERY_SERVER|discoveryServersList|<\s*discoveryProtocol\s*>\s*(?:SUPER_)?(?:CLIENT|SERVER|BACKUP)"
)
_NO_DISCOVERY = re.compile(r"<\s*discoveryProtocol\s*>\s*(NONE|STATIC)\b")
_SECURITY = re.compile(r"<\s*(?:DDS)?Security\b|dds\.sec\.", re.IGNORECASE)
_REFERENCE = re.compile(r"\$\{(\w+)(?::-([^}]*))?\}")
"""As Cyclone DDS takes parts of a document from the environment."""
_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
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


@dataclass(frozen=True)
class Foreign:
    """A configuration of a DDS that a secured process must not have, and why.

    ``is_discovery``: it silences the process, or leads past its enclave, by the way in which it finds others.
    """

    variable: str
    value: str
    why: str
    is_discovery: bool = False


def foreign_configurations(environment: Mapping[str, str], cwd: Path, *, on_fast: bool) -> Iterator[Foreign]:
    """Find configurations with security settings, with a discovery server, or that cannot be read; reads the files as
    the middleware does, relative ones from ``cwd``.

    A discovery server is the one known way past an enclave: with it there is no handshake. ``on_fast``: the process
    runs on Fast DDS, the only one that reads ``ROS_DISCOVERY_SERVER``.
    """
    if on_fast and environment.get(_DISCOVERY_SERVER):
        yield Foreign(_DISCOVERY_SERVER, environment[_DISCOVERY_SERVER], _SERVER, is_discovery=True)
    for name in _CONFIGURATIONS:
        for part in _parts(environment.get(name, "")):
            text = part if "<" in part else text_or_nothing(cwd / part.removeprefix("file://"))
            yield from _judged(name, part, text, environment)
    others = {_ENVIRONMENT_FILE: environment.get(_ENVIRONMENT_FILE), _DEFAULT_PROFILES: None}
    if environment.get(_SKIP_DEFAULT) != "1" and (cwd / _DEFAULT_PROFILES).exists():
        others[_DEFAULT_PROFILES] = _DEFAULT_PROFILES
    for name, file in others.items():
        if file:
            yield from _judged(name, str(cwd / file), text_or_nothing(cwd / file), environment)


def _parts(value: str) -> Iterator[str]:
    """Yield the documents in a value as one text, and each file: Cyclone DDS separates them by commas, Connext by
    semicolons."""
    documents = value[value.find("<") : value.rfind(">") + 1] if "<" in value else ""
    between = re.findall(r">\s*[,;]([^<]+)[,;]\s*<", documents)
    files = re.split("[,;]", ",".join((value.replace(documents, ",") if documents else value, *between)))
    yield from filter(None, (documents, *map(str.strip, files)))


_SERVER = "names a discovery server of Fast DDS, through which secured processes never meet"


def _judged(variable: str, value: str, text: str, environment: Mapping[str, str]) -> Iterator[Foreign]:
    """Report the first thing in ``text`` that a secured process must not have."""
    if not text.strip():
        yield Foreign(variable, value, "cannot be read, so its settings are unknown")
        return
    written = _REFERENCE.sub(lambda found: environment.get(found[1]) or found[2] or "", text)
    if _SECURITY.search(written):
        yield Foreign(variable, value, "has security settings of its own, beside those of its enclave")
    elif _NAMES_SERVER.search(written):
        yield Foreign(variable, value, _SERVER, is_discovery=True)
    elif found := _NO_DISCOVERY.search(written):
        yield Foreign(
            variable, value, f"has discoveryProtocol {found[1]}: it discovers no others", is_discovery=True
        )


def discovery_is_off(environment: Mapping[str, str]) -> bool:
    """Return whether rcl keeps the process from finding others (discovery_options.c)."""
    return environment.get(_RANGE, "").upper() == "OFF"


def domain_of(environment: Mapping[str, str]) -> int:
    """Return the DDS domain of a process; raises UsageError for one that rcl, or Cyclone DDS, would refuse."""
    text = environment.get(DOMAIN, "")
    domain = domain_id(text)
    if domain is None or domain > HIGHEST_ID:
        raise UsageError(f"{DOMAIN} is {quoted(text)}, not a domain id from 0 to {HIGHEST_ID}")
    return domain
