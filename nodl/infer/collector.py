"""Python's garbage collector during an analysis."""

from __future__ import annotations

import gc
import itertools
from collections.abc import Iterator
from contextlib import contextmanager

_ANALYSES_A_COLLECTION = 100
_analyses = itertools.count(1)


@contextmanager
def without_collector() -> Iterator[None]:
    """Analysis makes many small objects that stay alive to its end; looking for garbage finds none.

    What is left then counts as old, or the next new object would have all of it searched; now and then it is searched.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled and next(_analyses) % _ANALYSES_A_COLLECTION:
            gc.freeze()
            gc.unfreeze()  # puts everything into the oldest generation
            gc.enable()
        elif enabled:
            gc.enable()
            gc.collect()
