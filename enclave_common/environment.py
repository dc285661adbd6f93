"""Environment variables: set for what reads them only there, and what one of rcl's says."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def environment_with(variables: Mapping[str, str]) -> Iterator[None]:
    """Set ``variables`` within the block and restore them afterwards."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def domain_id(text: str) -> int | None:
    """Return the number that ``ROS_DOMAIN_ID`` gives; None if rcl would reject it. No text is 0.

    Read by ``strtoul`` with base 0 (rcl ``domain_id.c``): ``010`` is 8, ``0x1F`` is 31.
    """
    number = re.fullmatch("0(?P<octal>[0-7]*)|0[xX](?P<hex>[0-9a-fA-F]+)|[1-9][0-9]*", text or "0")
    return number and int(number[0], 8 if number["octal"] else 16 if number["hex"] else 10)
