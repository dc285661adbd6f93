"""Dump plain values as YAML that people read: in the given order, long texts as blocks, always the same bytes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import yaml


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> Any:
        return super().increase_indent(flow, False)


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)


def yaml_text(content: Any) -> str:
    """Return ``content`` as one document."""
    text: str = yaml.dump(content, Dumper=_Dumper, sort_keys=False, width=110, allow_unicode=True)
    return text


def yaml_documents(contents: Iterable[Any]) -> str:
    """Return several documents, each behind ``---``."""
    return "".join(f"---\n{yaml_text(content)}" for content in contents)
