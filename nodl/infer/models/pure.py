"""The functions of Python's library that are run on known values: pure, without input or output, bounded.

A reviewed list. A function is on it when its result depends on its arguments alone, it touches neither files nor
clocks, the environment or the network, and its cost is bounded by the size of its arguments (which ``concrete``
limits) or it gives an iterator that is consumed under a limit.
"""

from __future__ import annotations

import builtins
import collections
import functools
import importlib
import io
import itertools
import json
import math
import operator
import posixpath
import re
import string
from collections.abc import Callable
from pathlib import PurePosixPath
from typing import Any

from nodl.infer.models.concrete import Callback, NotConcrete, Opaque

Function = Callable[..., Any]

_BUILTINS = [
    "abs", "all", "any", "ascii", "bin", "bool", "bytes", "chr", "dict", "divmod", "enumerate", "filter", "float",
    "format", "frozenset", "hex", "int", "iter", "len", "list", "map", "max", "min", "next", "oct", "ord", "pow",
    "range", "repr", "reversed", "round", "set", "slice", "sorted", "str", "sum", "tuple", "zip",
]  # fmt: skip
_METHODS = {
    "str": str, "bytes": bytes, "int": int, "float": float, "dict": dict, "list": list, "tuple": tuple, "set": set,
}  # fmt: skip
_RE = ["match", "fullmatch", "search", "findall", "finditer", "split", "sub", "subn", "escape", "compile"]
_ITERTOOLS = [
    "accumulate", "combinations", "combinations_with_replacement", "compress", "count", "cycle", "dropwhile",
    "filterfalse", "groupby", "islice", "pairwise", "permutations", "product", "repeat", "starmap", "takewhile",
    "zip_longest",
]  # fmt: skip
_PATHS = [
    "basename", "commonpath", "commonprefix", "dirname", "isabs", "join", "normpath", "split", "splitext",
]  # fmt: skip
_MATH = [
    "ceil", "floor", "sqrt", "pow", "fabs", "gcd", "lcm", "log", "log2", "log10", "sin", "cos", "tan", "atan2", "hypot",
    "radians", "degrees", "trunc", "isclose",
]  # fmt: skip
# Functions of ``operator`` that change their first argument.
IN_PLACE = frozenset({
    "setitem", "delitem", "iadd", "iand", "iconcat", "ifloordiv", "ilshift", "imatmul", "imod", "imul", "ior", "ipow",
    "irshift", "isub", "itruediv", "ixor",
})  # fmt: skip
_OPERATORS = [
    name for name in dir(operator) if not name.startswith("_") and name not in {"methodcaller", *IN_PLACE}
]


def _pattern(function: Function) -> Function:
    """A function of ``re``, kept from patterns that may take for ever."""

    @functools.wraps(function)
    def run(pattern: Any, *given: Any, **named: Any) -> Any:
        if isinstance(pattern, str) and len(pattern) > 500:
            raise NotConcrete
        source = pattern.pattern if isinstance(pattern, re.Pattern) else pattern
        long = any(isinstance(each, str) and len(each) > 20 for each in given)
        if isinstance(source, str) and long and _repeats_repetition(source):
            raise NotConcrete
        return function(pattern, *given, **named)

    return run


def _repeats_repetition(pattern: str) -> bool:
    return re.search(r"[*+}][^()]*\)[*+{]", pattern) is not None


def _late(module: str, name: str) -> Function:
    """A function whose module few programs need: imported when it is called."""

    def run(*given: Any, **named: Any) -> Any:
        return getattr(importlib.import_module(module), name)(*given, **named)

    return run


def _no_opaque(function: Function) -> Function:
    """A function that would compare its arguments by identity."""

    @functools.wraps(function)
    def run(*given: Any, **named: Any) -> Any:
        if any(isinstance(each, Opaque | Callback) for each in (*given, *named.values())):
            raise NotConcrete
        repeating = "mul" in function.__name__ and not all(isinstance(each, int | float) for each in given)
        if repeating or "shift" in function.__name__:
            raise NotConcrete  # of any size
        return function(*given, **named)

    return run


def _range(*bounds: Any) -> Any:
    numbers = range(*bounds)
    if len(numbers) > 1_000:
        raise NotConcrete
    return numbers


def _tee(iterable: Any, n: int = 2) -> Any:
    kept = list(itertools.islice(iterable, 1_000))
    return tuple(iter(list(kept)) for _ in range(n))


def _whole(source: Any) -> Any:
    """The text of a file, or the text itself."""
    if isinstance(source, io.StringIO | io.BytesIO):
        source = source.read()
    if isinstance(source, bytes):
        source = source.decode()
    if not isinstance(source, str):
        raise NotConcrete
    return source


def _yaml(source: Any, *_: Any, **__: Any) -> Any:
    import yaml

    text = _whole(source)
    if "*" in text and "&" in text:
        raise NotConcrete
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from error


def _json(source: Any, **named: Any) -> Any:
    text = _whole(source)
    if named:
        raise NotConcrete
    return json.loads(text)


def _dumps(value: Any, *, default: Any = None, **named: Any) -> str:
    def known(given: Any) -> Any:
        if isinstance(given, Opaque):
            raise NotConcrete  # asked again and again, ``default`` would not make it known
        return default(given)

    return json.dumps(value, default=None if default is None else known, **named)


_LATE = {
    "configparser": ("ConfigParser",), "shlex": ("quote", "split"), "html": ("escape",),
    "urllib.parse": ("quote", "unquote"), "ast": ("literal_eval",), "base64": ("b64encode", "b64decode"),
    "textwrap": ("dedent", "indent", "shorten", "wrap", "fill"),
}  # fmt: skip
SHALLOW: dict[str, Function] = {
    **{f"builtins.{name}": getattr(builtins, name) for name in _BUILTINS},
    "builtins.range": _range,
    **{f"re.{name}": _pattern(getattr(re, name)) for name in _RE},
    **{f"itertools.{name}": getattr(itertools, name) for name in _ITERTOOLS if hasattr(itertools, name)},
    "itertools.chain": itertools.chain,
    "itertools.chain.from_iterable": itertools.chain.from_iterable,
    "itertools.tee": _tee,
    **{
        f"{module}.{name}": getattr(posixpath, name) for module in ("os.path", "posixpath") for name in _PATHS
    },
    **{f"math.{name}": getattr(math, name) for name in _MATH if hasattr(math, name)},
    **{f"operator.{name}": _no_opaque(getattr(operator, name)) for name in _OPERATORS},
    "functools.reduce": functools.reduce,
    "collections.Counter": collections.Counter,
    "collections.deque": collections.deque,
    "collections.OrderedDict": dict,
    **{f"pathlib.{name}": PurePosixPath for name in ("Path", "PosixPath", "PurePath", "PurePosixPath")},
    "string.Template": string.Template,
    "string.capwords": string.capwords,
    **{f"{module}.{name}": _late(module, name) for module, names in _LATE.items() for name in names},
}
# These look into what containers hold.
DEEP: dict[str, Function] = {
    "builtins.str": str,
    "builtins.repr": repr,
    "builtins.ascii": ascii,
    "json.dumps": _dumps,
    "json.loads": _json,
    "json.load": _json,
    **dict.fromkeys(("yaml.safe_load", "yaml.load", "yaml.full_load"), _yaml),
    "copy.deepcopy": lambda value: value,
}
# Methods of a path that ask the file system.
PATH_IO = frozenset({
    "absolute", "resolve", "expanduser", "exists", "is_file", "is_dir", "read_text", "read_bytes", "write_text",
    "write_bytes", "stat", "lstat", "touch", "mkdir", "unlink", "rename", "replace", "rglob", "is_symlink", "owner",
    "samefile", "open", "glob", "iterdir",
})  # fmt: skip
# The size of a number makes no difference to their cost.
ANY_SIZE = frozenset(
    f"builtins.{name}" for name in (
        "abs", "bin", "bool", "divmod", "float", "hex", "int", "max", "min", "oct", "round", "str", "repr", "sum",
    )
)  # fmt: skip


@functools.lru_cache(maxsize=4096)
def function_at(path: str) -> tuple[Function, bool] | None:
    """The function called ``path`` and whether it looks into containers; ``None``: not on the list."""
    if path in DEEP:
        return DEEP[path], True
    if path in SHALLOW:
        return SHALLOW[path], False
    owner, _, name = path.rpartition(".")
    kind = _METHODS.get(owner.removeprefix("builtins."))
    if kind is not None and owner.startswith("builtins.") and not name.startswith("_"):
        return getattr(kind, name, None) and (_no_opaque(getattr(kind, name)), False)
    return None


def constant_at(path: str) -> object:
    """A constant of a library; ``None``: not on the list."""
    module, _, name = path.rpartition(".")
    owner = {"string": string, "math": math, "re": re}.get(module)
    value = getattr(owner, name, None) if owner is not None and not name.startswith("_") else None
    return value if isinstance(value, str | int | float) else None
