"""Install prefixes named by the user: they come before ``AMENT_PREFIX_PATH``, for us and for what we start."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from enclave_launch.boundary.light import TYPE_CHECKING
from nodl.ament_index import PREFIX_VARIABLE

if TYPE_CHECKING:
    from pathlib import Path


@contextmanager
def ament_prefixes(prefixes: Sequence[Path | str]) -> Iterator[None]:
    """Within the block ``prefixes`` come before the rest of ``AMENT_PREFIX_PATH``, for us and for what we start."""
    previous = os.environ.get(PREFIX_VARIABLE)
    prepend_prefixes(prefixes)
    try:
        yield
    finally:
        if previous is not None:
            os.environ[PREFIX_VARIABLE] = previous
        elif prefixes:
            del os.environ[PREFIX_VARIABLE]


def prepend_prefixes(prefixes: Sequence[Path | str]) -> None:
    """Put ``prefixes`` before the rest of ``AMENT_PREFIX_PATH``, for good."""
    if prefixes:
        previous = os.environ.get(PREFIX_VARIABLE)
        listed = [os.path.abspath(prefix) for prefix in prefixes]
        os.environ[PREFIX_VARIABLE] = os.pathsep.join([*listed, *([previous] if previous else [])])
