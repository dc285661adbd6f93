"""Which middlewares read enclaves. rcl hands every one the path; what it does with it is its own business.

Sources: rmw_cyclonedds_cpp ``rmw_node.cpp``, rmw_fastrtps_shared_cpp ``participant.cpp``, rmw_connextdds
``rmw_context.cpp`` (all three set DDS-Security properties from the enclave); rmw_zenoh_cpp reads none and is
secured by a configuration that the keystore has for the enclave, and by its router. Pure.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from enum import Enum

VARIABLE = "RMW_IMPLEMENTATION"
DEFAULT = "rmw_fastrtps_cpp"
_DEFAULT_OF = {"galactic": "rmw_cyclonedds_cpp"}


class Vendor(Enum):
    """Whose DDS speaks; decides who can authenticate whom."""

    CYCLONE = "Cyclone DDS"
    FAST = "Fast DDS"
    CONNEXT = "RTI Connext"


HONOURS_ENCLAVES: dict[str, Vendor] = {
    "rmw_cyclonedds_cpp": Vendor.CYCLONE,
    "rmw_fastrtps_cpp": Vendor.FAST,
    "rmw_fastrtps_dynamic_cpp": Vendor.FAST,
    "rmw_connextdds": Vendor.CONNEXT,
}
ZENOH = "rmw_zenoh_cpp"
_NO_ENCLAVES = {
    "rmw_iceoryx_cpp": "it reads no enclaves and has no security of its own",
    "rmw_email_cpp": "it reads no enclaves and has no security of its own",
}


def middleware_of(environment: Mapping[str, str], distro: str) -> str:
    """The name of the middleware that a process with this environment loads (rmw_implementation functions.cpp:
    an empty variable counts as none)."""
    return environment.get(VARIABLE) or _DEFAULT_OF.get(distro, DEFAULT)


def vendor_of(middleware: str) -> Vendor | None:
    """Whose DDS is behind an ``RMW_IMPLEMENTATION`` that honours enclaves; ``None`` for any other middleware."""
    return HONOURS_ENCLAVES.get(middleware)


def why_not(middleware: str, accepted: Collection[str] = ()) -> str | None:
    """Why a process with ``middleware`` must not start in an enclave; None when it may."""
    if middleware in HONOURS_ENCLAVES or middleware == ZENOH:
        return None
    if middleware in _NO_ENCLAVES:
        return _NO_ENCLAVES[middleware]
    return None if middleware in accepted else "it is not known to read enclaves"
