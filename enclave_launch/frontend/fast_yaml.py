"""PyYAML for the code of launch files, with something faster behind it where that gives the very same.

Launch files and their helpers (nav2's ``RewrittenYaml`` above all) read and write whole parameter files with PyYAML's
pure Python loader and dumper. While we evaluate, ``yaml.load``, ``yaml.dump`` and their safe forms build plain values
from the events of libyaml, which ships with PyYAML (``yaml_tree.values_of``), and write them line by line
(``boundary.plain_yaml``), each in a twentieth of the time. All else goes the old way: texts with marks that libyaml
scans differently, loaders and dumpers that somebody taught anything, other objects, and every error, which is therefore
PyYAML's own. Equal texts are read once, equal values written once. ``tests/frontend/test_fast_yaml.py`` holds both ways
equal.
"""

from __future__ import annotations

import io
import marshal
import re
import sys
from collections.abc import Callable, Container, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from importlib.machinery import ModuleSpec
from types import ModuleType

from enclave_launch.boundary.light import Any, late_pattern
from enclave_launch.boundary.plain_yaml import TUPLE_TAG, block_text

_NAMES = ("load", "dump", "safe_load", "safe_dump")
_LOADERS = {
    "SafeLoader": "CSafeLoader",
    "FullLoader": "CFullLoader",
    "Loader": "CLoader",
    "UnsafeLoader": "CUnsafeLoader",
}
_TUPLE_TAGS = {"Dumper": TUPLE_TAG, "SafeDumper": ""}
_TABLES = ("yaml_constructors", "yaml_multi_constructors", "yaml_representers", "yaml_multi_representers")
_TYPED_BY_FIRST_CHARACTER = {
    "bool": "yYnNtTfFoO",
    "float": "-+0123456789.",
    "int": "-+0123456789",
    "merge": "<",
    "null": ("~", "n", "N", ""),
    "timestamp": "0123456789",
    "value": "=",
    "yaml": "!&*",
}
_PATTERNS = sorted(
    (first, f"tag:yaml.org,2002:{kind}")
    for kind, firsts in _TYPED_BY_FIRST_CHARACTER.items()
    for first in firsts
)
_MAX_KEPT = 2**20  # characters of a text that is kept with its values
_OPTIONS = {"default_flow_style", "sort_keys"}


@contextmanager
def libyaml_for_launch_files() -> Iterator[None]:
    """Within the block ``yaml`` is ``accelerated``, as soon as somebody imports it."""
    yaml = sys.modules.get("yaml")
    with ExitStack() as stack:
        if yaml is not None:
            stack.enter_context(accelerated(yaml))
        else:
            finder = _OnImport(stack)
            sys.meta_path.insert(0, finder)
            stack.callback(finder.withdraw)
        yield


class _OnImport:
    """A meta path finder that meets the first import of PyYAML."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        if fullname != "yaml":
            return None
        from importlib.util import find_spec

        self.withdraw()
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            run = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                with _patterns_compiled_when_used():
                    run(module)
                self._stack.enter_context(accelerated(module))

            spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec

    def withdraw(self) -> None:
        if self in sys.meta_path:
            sys.meta_path.remove(self)


@contextmanager
def _patterns_compiled_when_used() -> Iterator[None]:
    """PyYAML's patterns take half of its import to compile. One names nearly all characters there are, for the scanner
    in Python alone; by the others scalars are typed, most of which need none (``bench/resolve.py``)."""
    compile_now = re.compile

    def compile_later(pattern: Any, flags: Any = 0) -> Any:
        of_pyyaml = sys._getframe(1).f_globals.get("__name__", "").startswith("yaml.")
        return late_pattern(pattern, flags) if of_pyyaml else compile_now(pattern, flags)

    re.compile = compile_later
    try:
        yield
    finally:
        re.compile = compile_now


@contextmanager
def accelerated(yaml: ModuleType) -> Iterator[None]:
    """Within the block the functions of module ``yaml`` use libyaml where they can; nothing without libyaml."""
    if not getattr(yaml, "__with_libyaml__", False) or isinstance(yaml.load, _Fast):
        yield
        return
    before = {name: getattr(yaml, name) for name in _NAMES}
    load, dump = _Load(yaml, before["load"]), _Dump(yaml, before["dump"])
    yaml.load, yaml.dump = load, dump  # type: ignore[attr-defined]
    yaml.safe_load = lambda stream: load(stream, yaml.SafeLoader)  # type: ignore[attr-defined]
    yaml.safe_dump = lambda data, stream=None, **given: dump(data, stream, yaml.SafeDumper, **given)  # type: ignore[attr-defined]
    try:
        yield
    finally:
        for name, function in before.items():
            setattr(yaml, name, function)


class _Fast:
    """One of PyYAML's functions, and the module that has it."""

    def __init__(self, yaml: ModuleType, original: Callable[..., Any]) -> None:
        self._yaml = yaml
        self._original = original

    def _as_shipped(self, name: str, known: Container[str], given: Any) -> bool:
        """Whether ``given`` is PyYAML's own class ``name`` and nobody taught it anything."""
        return name in known and getattr(self._yaml, name, None) is given and _is_untaught(given)


def _is_untaught(own: Any) -> bool:
    """Whether all that a loader or dumper of PyYAML's does is written in PyYAML."""
    functions = [value for base in own.__mro__[:-1] for value in vars(base).values() if callable(value)]
    for table in _TABLES:
        functions += getattr(own, table, {}).values()
    patterns = [(str(first), tag) for first, found in own.yaml_implicit_resolvers.items() for tag, _ in found]
    return (
        all(getattr(function, "__module__", "").startswith("yaml.") for function in functions)
        and sorted(patterns) == _PATTERNS
        and not own.yaml_path_resolvers
    )


class _Load(_Fast):
    """``yaml.load``."""

    def __call__(self, stream: Any, Loader: Any = None) -> Any:
        if Loader is None:  # PyYAML 5 warns and goes on, PyYAML 6 refuses
            return self._original(stream)
        name = getattr(Loader, "__name__", "")
        if not self._as_shipped(name, _LOADERS, Loader):
            return self._original(stream, Loader)
        text = stream if isinstance(stream, str) else _text_of(stream)
        if text is None:
            return self._original(stream, Loader)
        found = _read(text, getattr(self._yaml, _LOADERS[name]))
        if found is not None:
            return marshal.loads(found)
        return self._original(stream if isinstance(stream, str) else _Again(text, stream), Loader)


class _Again(io.StringIO):
    """The text of a stream that was read already, under its name, for PyYAML's messages."""

    def __init__(self, text: str, stream: Any) -> None:
        super().__init__(text)
        if hasattr(stream, "name"):
            self.name = stream.name


def _text_of(stream: Any) -> str | None:
    """All of a text file, from where it stands; ``None`` for anything else."""
    if not isinstance(stream, io.TextIOBase):
        return None
    return stream.read()


@lru_cache(maxsize=256)
def _read(text: str, loader: Any) -> bytes | None:
    """The values of ``text``, packed, so that each reader gets its own; ``None`` where PyYAML must read it."""
    from enclave_launch.boundary.yaml_nodes import refuse_deep_nesting
    from enclave_launch.frontend.yaml_tree import libyaml_reads_alike, values_of

    if len(text) > _MAX_KEPT or not libyaml_reads_alike(text):
        return None
    try:
        refuse_deep_nesting(text)
        with suppress(Exception):  # what only nodes give
            return marshal.dumps(values_of(text, loader))
        return marshal.dumps(_values_of_nodes(text, loader))
    except Exception:  # dates cannot be packed; other errors PyYAML meets again and words itself
        return None


def _values_of_nodes(text: str, loader: Any) -> Any:
    reader = loader(text)
    try:
        return reader.get_single_data()
    finally:
        reader.dispose()


class _Dump(_Fast):
    """``yaml.dump``."""

    def __call__(self, data: Any, stream: Any = None, Dumper: Any = None, **given: Any) -> Any:
        slow = Dumper or self._yaml.Dumper
        name = getattr(slow, "__name__", "")
        text = None
        if _is_default(given) and self._as_shipped(name, _TUPLE_TAGS, slow):
            text = block_text(data, sort_keys=given.get("sort_keys", True), tuple_tag=_TUPLE_TAGS[name])
        if text is None:
            return self._original(data, stream, slow, **given)
        return text if stream is None else (stream.write(text), None)[1]


def _is_default(given: dict[str, Any]) -> bool:
    return given.keys() <= _OPTIONS and given.get("default_flow_style", False) is False
