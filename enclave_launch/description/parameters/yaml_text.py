"""YAML between launch and its nodes: constants that need no reading, and the text of parameter files."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache

from enclave_launch.boundary.light import Any
from enclave_launch.boundary.plain_yaml import LONGEST_KEY, WIDTH, NeedsPyYAML, block_text, scalar_text
from enclave_launch.description.substitution import TextSubstitution
from enclave_launch.frontend import yaml_scalar


class YamlConstant(TextSubstitution):
    """A value given in Python. launch writes it as YAML and reads it back; the value is the same."""

    def __init__(self, value: str | int | float):
        self.value = value
        super().__init__(text="" if isinstance(value, str) else str(value))

    @property
    def text(self) -> str:
        return dump(self.value)

    def perform(self, context: Any) -> str:
        return self.text


def load(text: str) -> Any:
    """YAML 1.1 as ``yaml.safe_load`` reads it. Raises ``yaml.YAMLError``, ``ValueError``."""
    if "\n" not in text:
        return yaml_scalar.load(text)
    from enclave_launch.frontend.yaml_tree import values_of_yaml

    return values_of_yaml(text)


@lru_cache(maxsize=256)
def load_shared(text: str) -> Any:
    """As ``load``, read once for all who read the same text; do not modify the values."""
    return load(text)


def dump(value: Any) -> str:
    """YAML as PyYAML writes it by default, Python tags included; block style, sorted keys."""
    import yaml

    return str(yaml.dump(value, default_flow_style=False))


def quoted_parameter_file(section: str, parameters: Mapping[str, Any]) -> str:
    """As ``parameter_file``, but every text value is in quotes, so that rcl cannot take it for a number."""
    import yaml

    class Dumper(yaml.Dumper):
        pass

    class Quoted(str):
        pass

    def quoted(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return type(value)(quoted(item) for item in value)
        return Quoted(value) if isinstance(value, str) else value

    Dumper.add_representer(
        Quoted, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style="'")
    )
    values = {name: quoted(value) for name, value in parameters.items()}
    return str(yaml.dump({section: {"ros__parameters": values}}, Dumper=Dumper, default_flow_style=False))


def parameter_file(section: str, parameters: Mapping[str, Any]) -> str:
    """The parameter file launch writes for one dict: ``section`` is a node's full name or ``/**``."""
    with suppress(NeedsPyYAML):  # for lists, and what does not fit into a line
        lines = [f"    {scalar_text(name)}: {scalar_text(parameters[name])}\n" for name in sorted(parameters)]
        if lines and all(parameters) and len(max(lines, key=len)) <= WIDTH and len(section) <= LONGEST_KEY:
            return f"{scalar_text(section)}:\n  ros__parameters:\n{''.join(lines)}"
    values = {section: {"ros__parameters": dict(parameters)}}
    return block_text(values) or dump(values)
