"""Parameters as users describe them: a typed value, a single rule, a file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union, cast

import yaml

from enclave_common.source_location import SourceLocation
from enclave_launch.description import read_only
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.markup.parse_substitution import parse_substitution
from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    SomeSubstitutionsType_types_tuple,
    SubstitutionFailure,
    TextSubstitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.frontend import error_location
from enclave_launch.ros_rules.parameter_file import MAX_BYTES

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.substitution import Substitution


EvaluatedParameterValue = Union[  # noqa: UP007  (evaluated at run time, as upstream's)
    str, int, float, bool, Sequence[str], Sequence[int], Sequence[float], Sequence[bool], bytes
]


@read_only("value_type")
class ParameterValue:
    """A value, or substitutions whose text becomes one, of ``value_type`` (``None``: by YAML's rules)."""

    value_type: Any

    def __init__(self, value: Any, *, value_type: Any = None):
        self.__value = normalize_typed_substitution(value, value_type)
        self.__value_type = value_type
        self.__evaluated: EvaluatedParameterValue | None = None

    @property
    def value(self) -> Any:
        return self.__value if self.__evaluated is None else self.__evaluated

    def __str__(self) -> str:
        return f"launch_ros.description.ParameterValue(value={self.value}, value_type={self.value_type})"

    def evaluate(self, context: LaunchContext) -> EvaluatedParameterValue:
        """Return the typed value, evaluated once. Raises ``ValueError`` if coercion fails."""
        evaluated = perform_typed_substitution(context, self.value, self.__value_type)
        self.__evaluated = cast("EvaluatedParameterValue", evaluated)
        return self.__evaluated


class Parameter:
    """One parameter given as a rule on the command line: ``-p NAME:=YAML``."""

    def __init__(self, name: SomeSubstitutionsType, value: Any, *, value_type: Any = None):
        ensure_argument_type(name, SomeSubstitutionsType_types_tuple, "name")
        self.__name = normalize_to_list_of_substitutions(name)
        self.__value = ParameterValue(value, value_type=value_type)
        self.__evaluated: tuple[str, EvaluatedParameterValue] | None = None

    @property
    def name(self) -> list[Substitution] | str:
        return self.__name if self.__evaluated is None else self.__evaluated[0]

    @property
    def value(self) -> Any:
        return self.__value.value

    @property
    def value_type(self) -> Any:
        return self.__value.value_type

    def __str__(self) -> str:
        return (
            f"launch_ros.description.Parameter(name={self.name}, value={self.value}, "
            f"value_type={self.value_type})"
        )

    def evaluate(self, context: LaunchContext) -> tuple[str, EvaluatedParameterValue]:
        if self.__evaluated is None:
            name = perform_substitutions(context, self.__name)
            self.__evaluated = (name, self.__value.evaluate(context))
        return self.__evaluated


@read_only("allow_substs")
class ParameterFile:
    """A parameter file; with ``allow_substs`` its whole text, comments included, is a template."""

    allow_substs: bool

    def __init__(
        self,
        param_file: SomeSubstitutionsType | os.PathLike[str] | bytes,
        *,
        allow_substs: bool | SomeSubstitutionsType = False,
    ):
        ensure_argument_type(
            param_file,
            (*SomeSubstitutionsType_types_tuple, os.PathLike, bytes),
            "param_file",
            "ParameterFile()",
        )
        ensure_argument_type(allow_substs, bool, "allow_subst", "ParameterFile()")
        self.__param_file: list[Substitution] | os.PathLike[str]
        if isinstance(param_file, SomeSubstitutionsType_types_tuple):
            self.__param_file = normalize_to_list_of_substitutions(cast("SomeSubstitutionsType", param_file))
        else:
            self.__param_file = param_file
        self.__allow_substs = bool(allow_substs)
        self.__evaluated: Path | None = None

    @property
    def param_file(self) -> list[Substitution] | os.PathLike[str]:
        return self.__param_file if self.__evaluated is None else self.__evaluated

    def __str__(self) -> str:
        return (
            f"launch_ros.description.ParameterFile(param_file={self.param_file}, "
            f"allow_substs={self.allow_substs})"
        )

    def evaluate(self, context: LaunchContext) -> Path:
        """Return the path to pass on: the file, or a copy with the substitutions performed.

        Raises ``FileNotFoundError`` for a missing file, ``SubstitutionFailure`` if the copy is not YAML.
        """
        if self.__evaluated is None:
            given = self.__param_file
            path = Path(
                perform_substitutions(context, given) if isinstance(given, list) else os.fsdecode(given)
            )
            self.__evaluated = _substituted(context, path) if self.__allow_substs else path
        return self.__evaluated

    def cleanup(self) -> None:
        """Forget the generated copy; the host removes its files itself."""
        self.__evaluated = None


def _substituted(context: LaunchContext, path: Path) -> Path:
    if context.host.allow_missing_packages and not context.host.has_parameter_file(str(path)):
        return path  # reported where it is used
    text = _performed_file(context, path)
    try:
        yaml_text.load_parameter_file(text)
    except yaml.YAMLError:
        raise SubstitutionFailure("The substituted parameter file is not a valid yaml file") from None
    written = context.host.write_parameter_file(text)
    context.host.parameter_file_sources[written] = str(path)
    return Path(written)


def _performed_file(context: LaunchContext, path: Path) -> str:
    """Perform the substitutions in a file; an error is at the line of the one that raised it."""
    pieces: list[str] = []
    line = 1
    for part in parse_substitution(context.host.read_parameter_file(str(path))):
        try:
            pieces.append(part.perform(context))
        except Exception as error:  # any error of a substitution; it goes on, with its place noted
            error_location.mark_at(error, SourceLocation(str(path), line))
            raise
        line += part.text.count("\n") if isinstance(part, TextSubstitution) else 0
    text = "".join(pieces)
    if len(text) > MAX_BYTES:
        raise SubstitutionFailure(f"substitutions give a text of more than {MAX_BYTES} characters")
    return text
