"""Substitutions that look a value up: ``var``, ``env``, ``param``, ``for-var``, ``index``, ``anon`` and locals."""

from __future__ import annotations

import collections.abc
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateSubstitution, described, template
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext


def _as_text(default: Any) -> list[Substitution]:
    items = default if isinstance(default, collections.abc.Iterable) else (default,)
    return normalize_to_list_of_substitutions(
        [item if isinstance(item, (str, Substitution)) else str(item) for item in items]
    )


@expose_substitution("var")
class LaunchConfiguration(TemplateSubstitution):
    """The value of a launch configuration; the default, turned to text, is performed only if it is not set."""

    variable_name = template()
    default = template(default=None, keyword_only=True, read=_as_text)
    refusal = (TypeError, "var substitution expects 1 or 2 arguments")

    def describe(self) -> str:
        return f"LaunchConfig({described(self.variable_name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.variable_name)
        configurations = context.launch_configurations
        if name in configurations:
            value: str = configurations[name]
            return value
        if self.default is None:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return perform_substitutions(context, self.default)


@expose_substitution("env")
class EnvironmentVariable(TemplateSubstitution):
    """The value of an environment variable. The default is performed in any case."""

    name = template()
    default_value = template(default=None, keyword_only=True)
    refusal = (TypeError, "env substitution expects 1 or 2 arguments")

    def describe(self) -> str:
        return f"EnvVar({described(self.name)})"

    def perform(self, context: LaunchContext) -> str:
        default = None if self.default_value is None else perform_substitutions(context, self.default_value)
        name = perform_substitutions(context, self.name)
        value = context.environment.get(name, default)
        if value is None:
            raise SubstitutionFailure(f"environment variable '{name}' does not exist")
        return value


@expose_substitution("param")
class Parameter(TemplateSubstitution):
    """The first parameter of that name that ``set_parameter`` set, as ``str``. Parameter files are not searched."""

    name = template()
    default = template(default=None, keyword_only=True, read=_as_text)

    def __init__(self, name: SomeSubstitutionsType, *, default: Any = None):
        if default is not None and not _takes_default():
            raise TypeError("Parameter.__init__() got an unexpected keyword argument 'default'")
        super().__init__(name, default=default)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) != 1 and not _takes_default():
            raise AttributeError("param substitutions expect 1 argument")
        if not 1 <= len(data) <= 2:
            raise TypeError("param substitution expects 1 or 2 arguments")
        return super().parse(data)

    def describe(self) -> str:
        return f"{type(self).__name__}(name={described(self.name)})"

    def perform(self, context: LaunchContext) -> str:
        """Return the value; raises ``SubstitutionFailure`` without the parameter and without a default."""
        name = perform_substitutions(context, self.name)
        no_parameters: Any = [] if _takes_default() else None  # without defaults, iterating None fails
        for item in context.launch_configurations.get("global_params", no_parameters):
            if isinstance(item, tuple) and item[0] == name:
                return str(item[1])
        if self.default is None:
            raise SubstitutionFailure(f"parameter '{name}' not found")
        return perform_substitutions(context, self.default)


def _takes_default() -> bool:
    return current_release().has(Feature.PARAMETER_DEFAULT)


@read_only("expression", "description")
class LocalSubstitution(Substitution):
    """A Python expression on the locals of the context: ``event.process_name``."""

    expression: str = ""
    description: str | None = None

    def __init__(self, expression: str, description: str | None = None) -> None:
        ensure_argument_type(expression, str, "expression", "LocalSubstitution")
        self.__expression = expression
        self.__description = description

    def describe(self) -> str:
        return f"LocalVar('{self.__expression if self.__description is None else self.__description}')"

    def perform(self, context: LaunchContext) -> str:
        # Only Python launch files, which are code themselves, can make one of these.
        value: str = eval(f"context.locals.{self.__expression}", {"context": context})
        return value


def local_name(name: str) -> str:
    """Return the name of the local that carries the value of loop variable ``name``."""
    return f"ForEachVar__{name}"


@expose_substitution("for-var", feature=Feature.FOR_EACH)
class ForEachVar(TemplateSubstitution):
    """A value of the round of ``for_each`` that is being visited."""

    name = template()
    default_value = template(default=None, keyword_only=True)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not 1 <= len(data) <= 2:
            raise ValueError(f"{cls.__name__} substitution expects 1 or 2 arguments")
        return super().parse(data)

    def describe(self) -> str:
        return f"{type(self).__name__}(name={described(self.name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.name)
        value: str | None = context.get_locals_as_dict().get(local_name(name))
        if value is not None:
            return value
        if self.default_value is None:
            raise RuntimeError(
                f"No value available for {type(self).__name__} '{name}' and no default value provided"
            )
        return perform_substitutions(context, self.default_value)


@expose_substitution("index", feature=Feature.FOR_LOOP)
class ForLoopIndex(ForEachVar):
    """The number of the round of ``for`` that is being visited."""

    def __init__(self, name: SomeSubstitutionsType, **_: Any) -> None:
        super().__init__(name)


@expose_substitution("anon")
class AnonName(TemplateSubstitution):
    """A unique name; the same for the same argument within one scope of launch configurations."""

    name = template()
    refusal = (TypeError, "anon substitution expects 1 argument")

    def describe(self) -> str:
        return f"AnonName({described(self.name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.name)
        configurations = context.launch_configurations
        if context.host.release.has(Feature.FLAT_ANONYMOUS_NAMES):
            known, key = configurations, f"anon{name}"
        else:
            known, key = configurations.setdefault("anon", {}), name
        if key not in known:
            known[key] = context.host.anonymous_name(name)
        value: str = known[key]
        return value
