"""The DDS domain of each process, from its own environment, and of each enclave. Pure.

Source: rcl ``domain_id.c``: a plain number, and no value for 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from enclave_launch.errors import UsageError
from keystore.errors import printable
from keystore.formats.domains import HIGHEST_ID

DOMAIN = "ROS_DOMAIN_ID"


def domain_of(environment: Mapping[str, str]) -> int:
    """Raises ``UsageError`` for what rcl, or Cyclone DDS in a governance, would refuse."""
    text = environment.get(DOMAIN) or "0"
    if re.fullmatch("[0-9]{1,3}", text) is None or int(text) > HIGHEST_ID:
        raise UsageError(f"{DOMAIN} is {printable(text)}, not a domain id from 0 to {HIGHEST_ID}")
    return int(text)
