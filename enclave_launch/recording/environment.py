"""The recorder in the environment of a process, added when everything else has been decided. Pure.

A launch file may set ``LD_PRELOAD`` itself, and what it sets replaces what was inherited: so the recorder is added
last, behind what is there. A program built with the dynamic runtime of AddressSanitizer ends at once unless that
runtime is the first library of all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

RECORD_VARIABLE = "ENCLAVE_LAUNCH_RECORD"
PRELOAD = "LD_PRELOAD"


def with_recorder(
    environment: Mapping[str, str], library: str, record: str, sanitizer: str | None = None
) -> dict[str, str]:
    """``environment`` with the recorder; ``sanitizer`` is the runtime that must come first, if the program has one."""
    present = [name for name in re.split(r"[ :]+", environment.get(PRELOAD, "")) if name]
    first = [sanitizer] if sanitizer and not any("libasan" in name for name in present) else []
    others = [name for name in present if name != library]
    return {**environment, PRELOAD: ":".join([*first, *others, library]), RECORD_VARIABLE: record}
