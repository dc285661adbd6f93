"""YAML between launch and its nodes: constants that need no reading, and the text of parameter files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import yaml

from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.substitution import TextSubstitution
from enclave_launch.ros_rules.parameter_file import MAX_BYTES
from enclave_launch.ros_rules.parameter_value import plain_scalar

_FAST = getattr(yaml, "CDumper", yaml.Dumper)
"""libyaml's emitter, where PyYAML was built with it."""


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


@lru_cache(maxsize=16)
def load_parameter_file(text: str) -> Any:
    """Load as ``yaml.safe_load``, once for all nodes with the same file; do not modify the values.

    Raises ``yaml.YAMLError``, ``ValueError``.
    """
    return load_yaml(text, MAX_BYTES)


def dump(value: Any) -> str:
    """Write YAML as PyYAML does by default, Python tags included; block style, sorted keys."""
    if isinstance(value, dict | list) and _FAST.yaml_representers == yaml.Dumper.yaml_representers:
        text = str(yaml.dump(value, Dumper=_FAST, default_flow_style=False))
        # The two emitters write a text with escapes and an empty key differently, as they do a lone scalar.
        if "\\" not in text and "'':" not in text:
            return text
    return str(yaml.dump(value, default_flow_style=False))


class _QuotedText(str):
    """A text that is written in quotes."""


class _QuotingDumper(yaml.Dumper):
    """Writes ``_QuotedText`` in quotes."""


_QuotingDumper.add_representer(
    _QuotedText, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style="'")
)


def quoted_parameter_file(section: str, parameters: Mapping[str, Any]) -> str:
    """Write a parameter file with every text value in quotes, so that rcl cannot take it for a number."""
    values = {name: _quoted(value) for name, value in parameters.items()}
    document = {section: {"ros__parameters": values}}
    return str(yaml.dump(document, Dumper=_QuotingDumper, default_flow_style=False))


def _quoted(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return type(value)(_quoted(item) for item in value)
    return _QuotedText(value) if isinstance(value, str) else value


class _RclDumper(yaml.SafeDumper):
    """Writes in quotes what rcl would read as another type, which is more than what YAML would."""


def _text_for_rcl(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = None if isinstance(plain_scalar(text), str) else "'"
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_RclDumper.add_representer(str, _text_for_rcl)


def dump_for_rcl(document: Mapping[str, Any], *, allow_unicode: bool) -> str:
    """Write a document of parameter sections that rcl reads back as the same values."""
    return str(yaml.dump(document, Dumper=_RclDumper, sort_keys=True, allow_unicode=allow_unicode))


def parameter_file(section: str, parameters: Mapping[str, Any]) -> str:
    """Write the parameter file that launch writes for one dict: ``section`` is a node's full name or ``/**``."""
    return dump({section: {"ros__parameters": dict(parameters)}})
