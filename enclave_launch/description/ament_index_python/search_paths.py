"""Which prefixes are searched: those of the evaluation in progress."""

from __future__ import annotations

from enclave_launch.host.current import current_host
from nodl.ament_index import PREFIX_VARIABLE


def get_search_paths() -> list[str]:
    """Existing prefixes, the first has precedence. Raises ``OSError`` when nothing says where to search."""
    prefixes = current_host().prefixes()
    if not prefixes:
        raise OSError(f"Environment variable '{PREFIX_VARIABLE}' is not set or empty")
    return list(prefixes)
