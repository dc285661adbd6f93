"""The substitutions of ``nav2_common.launch``. They are used if the real package is not installed.

Source: what Nav2's package (https://github.com/ros-navigation/navigation2, nav2_common) gives for the same file. The
results are given to the host, which writes them to a file only when something is about to start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

from enclave_launch.description.parameters import yaml_text
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.substitutions.variables import LaunchConfiguration

if TYPE_CHECKING:
    from enclave_launch.description.conditions import Condition
    from enclave_launch.description.launch_context import LaunchContext

_Texts = Mapping[str, SomeSubstitutionsType]


class _OfFile(Substitution):
    """A substitution that reads a file; the path of a file of a missing package is passed on."""

    def __init__(self, source_file: SomeSubstitutionsType) -> None:
        self.__source_file = normalize_to_list_of_substitutions(source_file)

    @property
    def name(self) -> list[Substitution]:
        """Return the path of the file, to be performed."""
        return self.__source_file

    def _path(self, context: LaunchContext) -> str:
        return perform_substitutions(context, self.__source_file)


class RewrittenYaml(_OfFile):
    """Rewrite values and keys in a copy of a parameter file. Performed, it gives the path of the copy.

    Args:
        param_rewrites: Key -> new value of every key of that name. A path with dots stands for one value; a path with
            ``ros__parameters`` in it is added if it is not there.
        root_key: Key that everything is put below.
        key_rewrites: Key -> new key.
        value_rewrites: Value as text -> new value.
        convert_types: Whether the text of a number becomes a number. The text of a boolean always becomes one.
        out_dir: Not used: the host decides where files are written.
    """

    def __init__(
        self,
        source_file: SomeSubstitutionsType,
        param_rewrites: _Texts,
        root_key: SomeSubstitutionsType | None = None,
        key_rewrites: _Texts | None = None,
        value_rewrites: _Texts | None = None,
        convert_types: bool = False,
        out_dir: SomeSubstitutionsType | None = None,
    ) -> None:
        super().__init__(source_file)
        self.__rewrites = [_normalized(texts) for texts in (param_rewrites, key_rewrites, value_rewrites)]
        self.__root_key = normalize_to_list_of_substitutions(root_key or "")
        self.__convert_types = convert_types

    def perform(self, context: LaunchContext) -> str:
        path = self._path(context)
        if context.host.is_missing(path):
            return path
        parameters, keys, values = (_performed(context, texts) for texts in self.__rewrites)
        content = deepcopy(yaml_text.load_parameter_file(context.host.read_parameter_file(path)))
        converted = {name: self.__convert(text) for name, text in parameters.items()}
        _set_keys(content, converted)
        present = [place for place in _places(content, "") if place in converted]
        added = [
            place for place in converted if place not in present and "ros__parameters" in place.split(".")
        ]
        for place in (*present, *added):
            _set_place(content, place.split("."), converted[place])
        _rename_keys(content, keys)
        if values:
            content = self.__with_values(content, values)
        if root := perform_substitutions(context, self.__root_key):
            content = {root: content}
        return context.host.write_parameter_file(yaml_text.dump(content))

    def __convert(self, text: str) -> bool | int | float | str:
        if self.__convert_types:
            try:
                return float(text) if "." in text else int(text)
            except ValueError:
                pass
        return {"true": True, "false": False}.get(text.lower(), text)

    def __with_values(self, content: Any, values: Mapping[str, str]) -> Any:
        if isinstance(content, dict):
            return {key: self.__with_values(value, values) for key, value in content.items()}
        if isinstance(content, list):
            return [self.__with_values(value, values) for value in content]
        return self.__convert(values[str(content)]) if str(content) in values else content


class ReplaceString(_OfFile):
    """Replace texts in a copy of a file, in the order given. Performed, it gives the path of the copy.

    If the condition does not hold, it gives the path of the file itself.
    """

    def __init__(
        self, source_file: SomeSubstitutionsType, replacements: _Texts, condition: Condition | None = None
    ) -> None:
        super().__init__(source_file)
        self.__replacements = _normalized(replacements)
        self.__condition = condition

    @property
    def condition(self) -> Condition | None:
        """Return the condition of replacing anything."""
        return self.__condition

    def perform(self, context: LaunchContext) -> str:
        path = self._path(context)
        if context.host.is_missing(path) or not (
            self.__condition is None or self.__condition.evaluate(context)
        ):
            return path
        lines = context.host.read_parameter_file(path).splitlines(keepends=True)
        for old, new in _performed(context, self.__replacements).items():
            lines = [line.replace(old, new) for line in lines]
        return context.host.write_parameter_file("".join(lines))


class HasNodeParams(_OfFile):
    """Check if a parameter file has a section of this name. Performed, it gives ``True`` or ``False``."""

    def __init__(self, source_file: SomeSubstitutionsType, node_name: str) -> None:
        super().__init__(source_file)
        self.__node_name = node_name

    def perform(self, context: LaunchContext) -> str:
        path = self._path(context)
        if context.host.is_missing(path):
            return "False"
        content = yaml_text.load_parameter_file(context.host.read_parameter_file(path))
        return str(isinstance(content, dict) and self.__node_name in content)


class LaunchConfigAsBool(Substitution):
    """Convert a launch configuration to ``True`` or ``False``.

    ``true``, ``1``, ``yes`` and ``on`` are ``True``, in capitals too; any other text is ``False``.
    """

    def __init__(self, name: str) -> None:
        self.__configuration = LaunchConfiguration(name)

    def describe(self) -> str:
        return f"LaunchConfigAsBool({self.__configuration.describe()})"

    def perform(self, context: LaunchContext) -> str:
        text = self.__configuration.perform(context)
        return str(text.strip().lower() in ("true", "1", "yes", "on"))


def _normalized(texts: _Texts | None) -> dict[str, list[Substitution]]:
    return {key: normalize_to_list_of_substitutions(text) for key, text in (texts or {}).items()}


def _performed(context: LaunchContext, texts: Mapping[str, list[Substitution]]) -> dict[str, str]:
    return {key: perform_substitutions(context, text) for key, text in texts.items()}


def _set_keys(content: Any, values: Mapping[str, Any]) -> None:
    """Replace the value of every key of these names, however deep; lists are not searched."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        _set_keys(value, values)
        if key in values:
            content[key] = values[key]


def _places(content: Any, prefix: str) -> Iterator[str]:
    """Yield the path with dots of every value that is neither a mapping nor a list."""
    items: Iterator[tuple[Any, Any]]
    if isinstance(content, dict):
        items = iter(content.items())
    elif isinstance(content, list):
        items = iter(enumerate(content))
    else:
        yield prefix
        return
    for key, value in items:
        yield from _places(value, f"{prefix}.{key}" if prefix else str(key))


def _set_place(content: Any, keys: list[str], value: Any) -> None:
    *above, last = keys
    for key in above:
        content = content[int(key)] if isinstance(content, list) else content.setdefault(key, {})
    content[last] = value


def _rename_keys(content: Any, names: Mapping[str, str]) -> None:
    if not isinstance(content, dict):
        return
    for key, value in list(content.items()):
        _rename_keys(value, names)
        if key in names:
            content[names[key]] = content.pop(key)
