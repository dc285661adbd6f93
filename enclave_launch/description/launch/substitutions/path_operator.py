"""The operator ``/`` of substitutions that give a directory."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitutions.path_join_substitution import PathJoinSubstitution


class PathOperator:
    """Mixed into such a substitution: ``directory / "launch"`` is a ``PathJoinSubstitution``."""

    def __truediv__(self, other: SomeSubstitutionsType) -> PathJoinSubstitution:
        from enclave_launch.description.launch.substitutions.path_join_substitution import (
            PathJoinSubstitution,
        )

        return PathJoinSubstitution([self, other])
