"""PyYAML for the code of launch files, with libyaml behind it where that gives the very same.

Launch files and their helpers (nav2's ``RewrittenYaml`` above all) read and write whole parameter files with PyYAML's
pure Python loader and dumper; libyaml, which ships with PyYAML, does it in a tenth of the time. While we evaluate,
``yaml.load``, ``yaml.dump`` and their safe forms try it first. What it may treat otherwise goes the old way: texts with
marks that it scans differently (``yaml_tree``), loaders that somebody taught new tags, objects other than plain values,
and every error, which is therefore PyYAML's own. Equal texts are read once, equal values written once.
``tests/frontend/test_fast_yaml.py`` holds both ways equal.
"""

from __future__ import annotations

import io
import marshal
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from importlib.machinery import ModuleSpec
from types import ModuleType

from enclave_launch.boundary.light import Any, late_pattern

_NAMES = ("load", "dump", "safe_load", "safe_dump")
_LOADERS = {
    "SafeLoader": "CSafeLoader",
    "FullLoader": "CFullLoader",
    "Loader": "CLoader",
    "UnsafeLoader": "CUnsafeLoader",
}
_DUMPERS = {"Dumper": "CDumper", "SafeDumper": "CSafeDumper"}
_LEARNT = (  # class attributes that change when somebody teaches a loader or dumper something
    *("yaml_constructors", "yaml_multi_constructors", "yaml_implicit_resolvers", "yaml_path_resolvers"),
    *("yaml_representers", "yaml_multi_representers"),
)
_MAX_KEPT = 2**20  # characters of a text that is kept with its values

# Text that both emitters write alike, folded lines included: printable ASCII without line breaks.
_is_simple_text = re.compile(r"[ -~]{0,1000}").fullmatch
_is_simple_key = re.compile(r"[ -~]{1,100}").fullmatch  # a key of 128 characters has a form of its own
_SCALARS = {bool, int, float, type(None)}
_MAX_DEPTH = 10
_OPTIONS = {bool, type(None)}  # types of what is said of the style


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
                with _large_pattern_compiled_when_used():
                    run(module)
                self._stack.enter_context(accelerated(module))

            spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec

    def withdraw(self) -> None:
        if self in sys.meta_path:
            sys.meta_path.remove(self)


@contextmanager
def _large_pattern_compiled_when_used() -> Iterator[None]:
    """The pattern of what may not stand in YAML names nearly all characters there are: to compile it takes a third of
    PyYAML's import, and only the scanner in Python searches with it (``bench/resolve.py``)."""
    compile_now = re.compile

    def compile_later(pattern: Any, flags: Any = 0) -> Any:
        large = isinstance(pattern, str) and pattern[-2:-1] == chr(sys.maxunicode)
        return late_pattern(pattern) if large else compile_now(pattern, flags)

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

    def _fast(self, slow: Any, names: dict[str, str]) -> Any:
        """libyaml's class for ``slow``, if that is one of PyYAML's own and nobody taught it anything."""
        name = names.get(getattr(slow, "__name__", ""))
        if name is None or getattr(self._yaml, slow.__name__, None) is not slow:
            return None
        fast = getattr(self._yaml, name)
        same = all(getattr(slow, part, None) is getattr(fast, part, None) for part in _LEARNT)
        return fast if same else None


class _Load(_Fast):
    """``yaml.load``."""

    def __call__(self, stream: Any, Loader: Any = None) -> Any:
        if Loader is None:  # PyYAML 5 warns and goes on, PyYAML 6 refuses
            return self._original(stream)
        fast = self._fast(Loader, _LOADERS)
        if fast is None:
            return self._original(stream, Loader)
        text = stream if isinstance(stream, str) else _text_of(stream)
        if text is None:
            return self._original(stream, Loader)
        found = _read(text, fast)
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
    from enclave_launch.frontend.yaml_tree import libyaml_reads_alike

    if len(text) > _MAX_KEPT or not libyaml_reads_alike(text):
        return None
    try:
        refuse_deep_nesting(text)
        return marshal.dumps(_values(text, loader))
    except Exception:  # dates cannot be packed; other errors PyYAML meets again and words itself
        return None


def _values(text: str, loader: Any) -> Any:
    reader = loader(text)
    try:
        return reader.get_single_data()
    finally:
        reader.dispose()


class _Dump(_Fast):
    """``yaml.dump``."""

    def __call__(self, data: Any, stream: Any = None, Dumper: Any = None, **given: Any) -> Any:
        slow = Dumper or self._yaml.Dumper
        fast = self._fast(slow, _DUMPERS)
        whole = type(data) in (dict, list) and _is_simple(data, 0, set())
        if fast is None or not whole or not _plain_options(given):
            return self._original(data, stream, slow, **given)
        text = _written(marshal.dumps(data, 2), self._original, fast, tuple(given.items()))
        return text if stream is None else (stream.write(text), None)[1]


@lru_cache(maxsize=64)
def _written(
    packed: bytes, write: Callable[..., str], dumper: Any, given: tuple[tuple[str, Any], ...]
) -> str:
    """The text of packed values; equal values are written once."""
    text = write(marshal.loads(packed), None, dumper, **dict(given))
    if len(_texts_written) == 64:
        _texts_written.clear()
    _texts_written.add(text)
    return text


_texts_written: set[str] = set()


def was_written(text: str) -> bool:
    """Whether ``text`` is just what ``yaml.dump`` wrote here, and therefore well-formed."""
    return text in _texts_written


def _plain_options(given: dict[str, Any]) -> bool:
    known = given.keys() <= {"default_flow_style", "sort_keys"}
    return known and not given.get("default_flow_style", False) and {*map(type, given.values())} <= _OPTIONS


def _is_simple(value: Any, depth: int, inside: set[int]) -> bool:
    """A list or dict of plain values that both emitters write alike, nowhere shared and not too deep."""
    if depth > _MAX_DEPTH or id(value) in inside:
        return False
    inside.add(id(value))
    if type(value) is dict:
        for key in value:
            if type(key) is not str or not _is_simple_key(key):
                return False
        value = value.values()
    for item in value:
        kind = type(item)
        if kind is str:
            if not _is_simple_text(item):
                return False
        elif kind not in _SCALARS and not (kind in (list, dict) and _is_simple(item, depth + 1, inside)):
            return False
    return True
