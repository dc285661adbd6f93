"""The program of one process: command, name, directory and environment."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from enclave_common import shell_words
from enclave_launch.description import read_only
from enclave_launch.description.substitution import normalize_to_list_of_substitutions, perform_substitutions
from enclave_launch.description.substitutions.variables import LaunchConfiguration

if TYPE_CHECKING:
    from enclave_launch.description.entity import Action
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.substitution import SomeSubstitutionsType, Substitution


_DEFAULT_PREFIX: list[Substitution] = [LaunchConfiguration("launch-prefix", default="")]
_PREFIX_FILTER: list[Substitution] = [LaunchConfiguration("launch-prefix-filter", default="")]

Variables = list[tuple["list[Substitution]", "list[Substitution]"]]


@read_only(
    "name", "cwd", "env", "additional_env", "arguments", "final_name", "final_cmd", "final_prefix", "final_cwd",
    "final_env", "prefix", "cmd",
)  # fmt: skip
class Executable:
    """Describes a process; ``prepare`` performs it. The ``final_...`` members are ``None`` before that."""

    name: list[Substitution] | None = None
    cwd: list[Substitution] | None = None
    env: Variables | None = None
    additional_env: Variables | None = None
    arguments: Iterable[SomeSubstitutionsType] | None = None
    final_name: str | None = None
    final_cmd: list[str] | None = None
    final_prefix: tuple[str, ...] = ()  # the words of ``final_cmd`` that the prefix gave (ours)
    final_cwd: str | None = None
    final_env: dict[str, str] | None = None  # shared between processes with the same one: do not modify
    prefix: list[Substitution]
    cmd: list[list[Substitution]]  # shared: derived descriptions append to it

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        prefix: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        cwd: SomeSubstitutionsType | None = None,
        env: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        additional_env: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        arguments: Iterable[SomeSubstitutionsType] | None = None,
    ) -> None:
        """Describe a program to run; with ``prefix`` the filter is ignored, ``env`` replaces the environment."""
        self.__cmd = [normalize_to_list_of_substitutions(word) for word in cmd]
        self.__cmd += [normalize_to_list_of_substitutions(word) for word in arguments or ()]
        self.__prefix = _DEFAULT_PREFIX if prefix is None else normalize_to_list_of_substitutions(prefix)
        self.__prefix_filter = _PREFIX_FILTER if prefix is None else None
        self.__name = None if name is None else normalize_to_list_of_substitutions(name)
        self.__cwd = None if cwd is None else normalize_to_list_of_substitutions(cwd)
        self.__env = None if env is None else _normalize(env)
        self.__additional_env = None if additional_env is None else _normalize(additional_env)
        self.__arguments = arguments

    def prepare(self, context: LaunchContext, action: Action) -> None:
        """Perform command, prefix, name, directory and environment, in this order."""
        cmd = [perform_substitutions(context, word) for word in self.__cmd]
        if self.__prefix_applies(context, cmd):
            prefix = perform_substitutions(context, self.__prefix)
            self.__final_prefix = tuple(shell_words.split_words(prefix)) if prefix else ()
            cmd = [*self.__final_prefix, *cmd]
        self.__final_cmd = cmd
        name = (
            os.path.basename(cmd[0]) if self.__name is None else perform_substitutions(context, self.__name)
        )
        self.__final_name = f"{name}-{context.host.next_process_index()}"
        self.__final_cwd = None if self.__cwd is None else perform_substitutions(context, self.__cwd)
        self.__final_env = self.__environment(context)

    def __prefix_applies(self, context: LaunchContext, cmd: list[str]) -> bool:
        if self.__prefix_filter is None:
            return True
        pattern = perform_substitutions(context, self.__prefix_filter)
        return re.match(pattern, os.path.basename(cmd[0])) is not None

    def __environment(self, context: LaunchContext) -> dict[str, str]:
        """Perform the variables; each sees the environment of the context, not the ones added before it."""
        if self.__env is None:
            base = context.process_environment.snapshot()
        else:
            base = _perform(context, self.__env)
        if not self.__additional_env:
            return base
        return {**base, **_perform(context, self.__additional_env)}


def _normalize(variables: Mapping[SomeSubstitutionsType, SomeSubstitutionsType]) -> Variables:
    return [
        (normalize_to_list_of_substitutions(name), normalize_to_list_of_substitutions(value))
        for name, value in variables.items()
    ]


def _perform(context: LaunchContext, variables: Variables) -> dict[str, str]:
    return {
        perform_substitutions(context, name): perform_substitutions(context, value)
        for name, value in variables
    }
