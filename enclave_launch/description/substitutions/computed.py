"""Substitutions that compute: ``command``, ``eval``, ``file-content``, ``find-exec``, ``string-join``."""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from enclave_common import shell_words
from enclave_common.files import read_text
from enclave_launch.description import read_only
from enclave_launch.description.markup.expose import expose_substitution
from enclave_launch.description.substitution import (
    MAX_TEXT,
    SomeSubstitutionsType,
    Substitution,
    SubstitutionFailure,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.templates import TemplateSubstitution, described, template
from enclave_launch.diagnostics.evaluation import command_stderr
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.host.host import CommandResult


_MODES = ("fail", "ignore", "warn", "capture")


@expose_substitution("command")
class Command(TemplateSubstitution):
    """The output of a command on stdout, unstripped. Run without a shell, each time it is performed.

    ``on_stderr``: ``fail`` when it writes there, ``warn``, ``ignore``, or ``capture`` it with stdout.
    """

    command = template()
    on_stderr = template(default="fail", keyword_only=True)
    refusal = (ValueError, "command substitution expects 1 or 2 arguments")

    def describe(self) -> str:
        return f"Command({described(self.command)})"

    def perform(self, context: LaunchContext) -> str:
        text = perform_substitutions(context, self.command)
        words = shell_words.split_words(text)
        mode = perform_substitutions(context, self.on_stderr)
        if mode not in _MODES:
            raise SubstitutionFailure(
                "expected 'on_stderr' to be one of: 'fail', 'ignore', 'warn' or 'capture'"
            )
        try:
            result = context.host.run_command(
                words, merge_stderr=mode == "capture", at_event=context.on_event is not None
            )
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


_DEFAULT_MODULES = ("math",)


@expose_substitution("eval")
@read_only("expression", "python_modules")
class PythonExpression(Substitution):
    """The value of a Python expression, as text. It sees the builtins and the modules given.

    Names are those of the modules, and what module ``math`` holds; humble knows only the latter.
    """

    expression: list[Substitution]
    python_modules: list[Substitution]

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

    def describe(self) -> str:
        modules = ", ".join(sub.describe() for sub in self.__python_modules)
        return f"PythonExpr({described(self.__expression)}, [{modules}])"

    def perform(self, context: LaunchContext) -> str:
        if context.host.release.has(Feature.EVAL_MODULES):
            names = _names([sub.perform(context) for sub in self.__python_modules])
        else:
            names = dict(math.__dict__)
        # A launch file may compute anything here: that is the substitution's purpose.
        expression = perform_substitutions(context, self.__expression)
        results = context.host.user_code_results
        try:
            if results is None or context.on_event is not None:
                return str(eval(expression, {}, names))
            return results.call(("eval", expression), lambda: str(eval(expression, {}, names)))
        except Exception as error:  # whatever the expression raises; it goes on, with the expression noted
            setattr(error, _EXPRESSION, expression)
            raise


_EXPRESSION = "enclave_launch_expression"


def expression_of(error: BaseException) -> str | None:
    """Return the Python expression, as it was evaluated, that raised ``error``; None for any other error."""
    expression: str | None = getattr(error, _EXPRESSION, None)
    return expression


def _literal_names(modules: Any) -> list[str]:
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


@expose_substitution("file-content", feature=Feature.FILE_CONTENT)
class FileContent(TemplateSubstitution):
    """The text of a file, unstripped."""

    path = template()
    refusal = (AttributeError, "file content substitutions expect 1 argument")

    def describe(self) -> str:
        return f"FileContent({', '.join(sub.describe() for sub in self.path)})"

    def perform(self, context: LaunchContext) -> str:
        path = perform_substitutions(context, self.path)
        try:
            return read_text(path, MAX_TEXT)
        except FileNotFoundError:
            raise SubstitutionFailure(f"File not found: {path}") from None


@expose_substitution("find-exec")
class FindExecutable(TemplateSubstitution):
    """The path of a program on the ``PATH``."""

    name = template(keyword_only=True)
    refusal = (AttributeError, "find-exec substitution expects 1 argument")

    def describe(self) -> str:
        return f"FindExec({described(self.name)})"

    def perform(self, context: LaunchContext) -> str:
        name = perform_substitutions(context, self.name)
        path = context.host.find_program(name)
        if path is None:
            raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
        return path


@expose_substitution("string-join", feature=Feature.STRING_JOIN_IN_FRONTENDS)
class StringJoinSubstitution(TemplateSubstitution):
    """Concatenates each component, then joins them with the delimiter."""

    substitutions = template(read=lambda items: list(map(normalize_to_list_of_substitutions, items)))
    delimiter = template(default="")

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        if len(data) < 2:
            raise TypeError(
                "string-join substitution expects at least 2 arguments: 1 delimiter + at least 1 component"
            )
        return cls, {"delimiter": data[0], "substitutions": data[1:]}

    def describe(self) -> str:
        components = ", ".join(map(described, self.substitutions))
        return f"StringJoinSubstitution([{components}], delimiter={described(self.delimiter)})"

    def perform(self, context: LaunchContext) -> str:
        components = [perform_substitutions(context, component) for component in self.substitutions]
        return perform_substitutions(context, self.delimiter).join(components)
