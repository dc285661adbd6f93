"""Base of everything that stands for a text which is only known when it is performed."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


class Substitution:
    """Performed against a context, gives text. Third parties subclass it; only ``perform`` is required."""

    def describe(self) -> str:
        return repr(self)

    def perform(self, context: LaunchContext) -> str:
        raise NotImplementedError("perform() not implemented for Substitution base class.")
