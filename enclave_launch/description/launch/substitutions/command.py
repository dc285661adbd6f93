"""``$(command cmd [on_stderr])``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.frontend.expose import expose_substitution
from enclave_launch.description.launch.substitution import Substitution
from enclave_launch.description.launch.substitutions.substitution_failure import SubstitutionFailure
from enclave_launch.description.launch.utilities import (
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.diagnostics import command_stderr

if TYPE_CHECKING:
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.host.protocol import CommandResult

_MODES = ("fail", "ignore", "warn", "capture")


@expose_substitution("command")
class Command(Substitution):
    """What a command writes to stdout, unstripped. Run without a shell, each time it is performed.

    ``on_stderr``: ``fail`` when it writes there, ``warn``, ``ignore``, or ``capture`` it with stdout.
    """

    def __init__(self, command: SomeSubstitutionsType, *, on_stderr: SomeSubstitutionsType = "fail") -> None:
        self.__command = normalize_to_list_of_substitutions(command)
        self.__on_stderr = normalize_to_list_of_substitutions(on_stderr)

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if not 1 <= len(data) <= 2:
            raise ValueError("command substitution expects 1 or 2 arguments")
        return cls, dict(zip(("command", "on_stderr"), data, strict=False))

    @property
    def command(self) -> list[Substitution]:
        return self.__command

    @property
    def on_stderr(self) -> list[Substitution]:
        return self.__on_stderr

    def describe(self) -> str:
        return f"Command({' + '.join(sub.describe() for sub in self.__command)})"

    def perform(self, context: LaunchContext) -> str:
        text = perform_substitutions(context, self.__command)
        words = shlex.split(text)
        mode = perform_substitutions(context, self.__on_stderr)
        if mode not in _MODES:
            raise SubstitutionFailure(
                "expected 'on_stderr' to be one of: 'fail', 'ignore', 'warn' or 'capture'"
            )
        try:
            result = context.host.run_command(words, merge_stderr=mode == "capture")
        except FileNotFoundError as error:
            raise SubstitutionFailure(f"file not found: {error}") from error
        _check(context, text, mode, result)
        return result.stdout


def _check(context: LaunchContext, text: str, mode: str, result: CommandResult) -> None:
    if result.returncode != 0:
        captured = f"\nCaptured stderr output: {result.stderr}" if result.stderr else ""
        raise SubstitutionFailure(f"executed command failed. Command: {text}{captured}")
    if not result.stderr:
        return
    message = (
        f"executed command showed stderr output. Command: {text}\nCaptured stderr output:\n{result.stderr}"
    )
    if mode == "fail":
        raise SubstitutionFailure(message)
    if mode == "warn":
        context.host.warn(command_stderr(message, text))
