"""``$(not-equals a b)``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitutions.equals_substitution import EqualsSubstitution
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext


@expose_substitution("not-equals", feature=Feature.EQUALS_IF)
class NotEqualsSubstitution(EqualsSubstitution):
    """``true`` when ``equals`` is not."""

    def perform(self, context: LaunchContext) -> str:
        return "false" if super().perform(context) == "true" else "true"
