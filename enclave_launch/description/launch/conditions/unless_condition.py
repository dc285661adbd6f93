"""``unless``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.conditions.if_condition import IfCondition

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class UnlessCondition(IfCondition):
    """Holds when the expression performs to ``false`` or ``0``."""

    def _predicate_func(self, context: LaunchContext) -> bool:
        return not super()._predicate_func(context)
