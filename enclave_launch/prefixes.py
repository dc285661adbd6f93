"""Install prefixes named by the user: they come before ``AMENT_PREFIX_PATH``, for us and for what we start."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from enclave_common.environment import environment_with
from nodl.ament_index import PREFIX_VARIABLE


def ament_prefixes(prefixes: Sequence[Path | str]) -> AbstractContextManager[None]:
    """Put ``prefixes`` before the rest of ``AMENT_PREFIX_PATH`` within the block, for us and for what we start."""
    return environment_with(_prepended(prefixes))


def prepend_prefixes(prefixes: Sequence[Path | str]) -> None:
    """Put ``prefixes`` before the rest of ``AMENT_PREFIX_PATH``, for good."""
    os.environ.update(_prepended(prefixes))


def _prepended(prefixes: Sequence[Path | str]) -> dict[str, str]:
    present = os.environ.get(PREFIX_VARIABLE)
    listed = [*map(os.path.abspath, prefixes), *([present] if present else [])]
    return {PREFIX_VARIABLE: os.pathsep.join(listed)} if listed else {}
