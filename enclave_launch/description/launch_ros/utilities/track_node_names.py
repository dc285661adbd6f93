"""How often each fully qualified node name was used in this launch, to warn about repeats."""

from __future__ import annotations

from collections import Counter

from enclave_launch.description.launch.launch_context import LaunchContext
from enclave_launch.diagnostics import node_name_repeated

_GLOBAL = "unique_ros_node_names"


def add_node_name(context: LaunchContext, node_name: str) -> None:
    _counts(context)[node_name] += 1


def get_node_name_count(context: LaunchContext, node_name: str) -> int:
    return _counts(context)[node_name]


def warn_about_repeats(context: LaunchContext, node_name: str, started_by: str) -> None:
    """Count one more node of this fully qualified name and warn if it is not the first.

    ``started_by``: the process, or for a component its container.
    """
    add_node_name(context, node_name)
    count = get_node_name_count(context, node_name)
    if count > 1:
        context.host.warn(node_name_repeated(node_name, count, started_by))


def _counts(context: LaunchContext) -> Counter[str]:
    """The table lives in the context's globals, where third-party code may look for it."""
    counts: Counter[str] | None = getattr(context.locals, _GLOBAL, None)
    if counts is None:
        counts = Counter()
        context.extend_globals({_GLOBAL: counts})
    return counts
