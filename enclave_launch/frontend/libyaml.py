"""PyYAML for the code of launch files, with its C loader and dumper where they do the same.

Launch files and their helpers (nav2's ``RewrittenYaml`` above all) read and write whole parameter files with PyYAML's
pure Python loader and dumper. A loader with constructors of its own, a text that libyaml would read otherwise, and
every error go the way of PyYAML's own scanner, so that values and messages are those of upstream.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import yaml

from enclave_common.yaml_reader import libyaml_reads_alike, refuse_deep_nesting

_LOADERS = {
    getattr(yaml, name): getattr(yaml, f"C{name}", None)
    for name in ("SafeLoader", "FullLoader", "Loader", "UnsafeLoader")
}
_DUMPERS = {getattr(yaml, name): getattr(yaml, f"C{name}", None) for name in ("SafeDumper", "Dumper")}
_TABLES = (
    "yaml_constructors",
    "yaml_multi_constructors",
    "yaml_representers",
    "yaml_multi_representers",
    "yaml_implicit_resolvers",
    "yaml_path_resolvers",
)
_SAME_WITH_OPTIONS = {"default_flow_style", "sort_keys"}
_load, _dump = yaml.load, yaml.dump


@contextmanager
def libyaml_for_launch_files() -> Iterator[None]:
    """Let ``yaml.load``, ``yaml.dump`` and their safe forms use libyaml within the block."""
    functions = {"load": load, "dump": dump, "safe_load": safe_load, "safe_dump": safe_dump}
    before = {name: getattr(yaml, name) for name in functions}
    vars(yaml).update(functions)
    try:
        yield
    finally:
        vars(yaml).update(before)


def load(stream: Any, Loader: Any = None) -> Any:
    """Load as ``yaml.load``. Without a loader PyYAML 5 warns, and PyYAML 6 raises ``TypeError``."""
    if Loader is None:
        return _load(stream)  # type: ignore[call-arg]
    in_c = _in_c(Loader, _LOADERS)
    if in_c is None or not isinstance(stream, str | io.TextIOBase):
        return _load(stream, Loader)
    text = stream if isinstance(stream, str) else stream.read()
    if libyaml_reads_alike(text):
        with suppress(yaml.YAMLError):
            refuse_deep_nesting(text)
            return _load(text, in_c)
    return _load(text if text is stream else _named(text, stream), Loader)


def safe_load(stream: Any) -> Any:
    """Load as ``yaml.safe_load``."""
    return load(stream, yaml.SafeLoader)


def dump(data: Any, stream: Any = None, Dumper: Any = yaml.Dumper, **options: Any) -> Any:
    """Dump as ``yaml.dump``. The two emitters write a lone scalar, an empty key and a text with escapes differently."""
    in_c = _in_c(Dumper, _DUMPERS)
    if in_c is None or not isinstance(data, dict | list) or not options.keys() <= _SAME_WITH_OPTIONS:
        return _dump(data, stream, Dumper, **options)
    text = _dump(data, None, in_c, **options)
    if "\\" in text or "'':" in text:
        return _dump(data, stream, Dumper, **options)
    if stream is None:
        return text
    stream.write(text)
    return None


def safe_dump(data: Any, stream: Any = None, **options: Any) -> Any:
    """Dump as ``yaml.safe_dump``."""
    return dump(data, stream, yaml.SafeDumper, **options)


def _in_c(own: Any, known: dict[Any, Any]) -> Any:
    """Return the class in C that does what ``own`` does; None if there is none, or ``own`` was taught something."""
    in_c = known.get(own)
    tables = [(getattr(own, name, None), getattr(in_c, name, None)) for name in _TABLES]
    return in_c if all(ours is theirs for ours, theirs in tables) else None


def _named(text: str, stream: Any) -> io.StringIO:
    """Return the text of a stream that was read, under its name, which PyYAML's messages show."""
    again = io.StringIO(text)
    if hasattr(stream, "name"):
        again.name = stream.name
    return again
