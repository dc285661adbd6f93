"""YAML between launch and its nodes: constants that need no reading, and the text of parameter files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

from enclave_launch.boundary.light import Any, late_pattern
from enclave_launch.description.substitution import TextSubstitution
from enclave_launch.frontend import yaml_scalar

# What PyYAML writes without quotes and reads back as the same text: no word of YAML 1.1's booleans and
# nulls, nothing that starts like a number, no space at which a long line would be folded.
_PLAIN_TEXT = late_pattern(
    r"(?!(?i:y|n|yes|no|on|off|true|false|null)\Z)[A-Za-z_/][A-Za-z0-9_/.+-]*\Z", re.ASCII
)


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
    from enclave_launch.frontend.yaml_tree import parse_yaml

    return parse_yaml(text).root


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
    if not parameters:
        return dump({section: {"ros__parameters": {}}})
    lines = [_entry(name, parameters[name]) for name in sorted(parameters)]
    if all(lines) and (section == "/**" or _PLAIN_TEXT.match(section)):
        return f"{section}:\n  ros__parameters:\n" + "".join(f"    {line}\n" for line in lines)
    return dump({section: {"ros__parameters": dict(parameters)}})


def _entry(name: str, value: Any) -> str:
    """``name: value`` when both need no quoting, else empty: then the real writer is asked."""
    if not _PLAIN_TEXT.match(name) or len(name) > 100:
        return ""
    if value is True or value is False:
        return f"{name}: {str(value).lower()}"
    if type(value) is int or (type(value) is str and _PLAIN_TEXT.match(value)):
        return f"{name}: {value}"
    if type(value) is float and (1e-4 <= abs(value) < 1e16 or value == 0):
        return f"{name}: {value!r}"  # no exponent, for which PyYAML has a form of its own
    return ""
