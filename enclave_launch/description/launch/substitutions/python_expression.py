"""``$(eval expression [modules])``."""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType


_DEFAULT_MODULES = ("math",)


@expose_substitution("eval")
class PythonExpression(Substitution):
    """The value of a Python expression, as text. It sees the builtins and the modules given.

    Names are those of the modules, and what module ``math`` holds; humble knows only the latter.
    """

    def __init__(
        self, expression: SomeSubstitutionsType, python_modules: SomeSubstitutionsType = _DEFAULT_MODULES
    ) -> None:
        if python_modules is not _DEFAULT_MODULES and not current_release().has(Feature.EVAL_MODULES):
            raise TypeError("PythonExpression.__init__() got an unexpected keyword argument 'python_modules'")
        self.__expression = normalize_to_list_of_substitutions(expression)
        self.__python_modules = normalize_to_list_of_substitutions(python_modules)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not current_release().has(Feature.EVAL_MODULES):
            if len(data) != 1:
                raise TypeError("eval substitution expects 1 argument")
        elif not 1 <= len(data) <= 2:
            raise TypeError("eval substitution expects 1 or 2 arguments")
        if len(data) == 1:
            return cls, {"expression": data[0]}
        return cls, {"expression": data[0], "python_modules": _literal_names(data[1])}

    @property
    def expression(self) -> list[Substitution]:
        return self.__expression

    @property
    def python_modules(self) -> list[Substitution]:
        return self.__python_modules

    def describe(self) -> str:
        expression = " + ".join(sub.describe() for sub in self.__expression)
        return f"PythonExpr({expression}, [{', '.join(sub.describe() for sub in self.__python_modules)}])"

    def perform(self, context: LaunchContext) -> str:
        if context.host.release.has(Feature.EVAL_MODULES):
            names = _names([sub.perform(context) for sub in self.__python_modules])
        else:
            names = dict(math.__dict__)
        # A launch file may compute anything here: that is the substitution's purpose.
        return str(eval(perform_substitutions(context, self.__expression), {}, names))


def _literal_names(modules: Any) -> list[str]:
    """The comma-separated names; only literal text counts."""
    parts = list(modules)
    if not parts:
        return []
    return [name.strip() for name in parts[0].perform(None).split(",")]


def _names(modules: list[str]) -> dict[str, Any]:
    names: dict[str, Any] = {}
    for module in map(importlib.import_module, modules):
        if module.__name__ == "math":
            names.update(vars(module))
        names[module.__name__] = module
    return names
