"""Python modules that are not installed, for dry runs with ``--allow-missing-packages``.

A launch file that imports one gets opaque values: their attributes, items, calls and base classes are opaque, too. They
may be handed on. As an entity one is reported ("what it would start is not known"), as a parameter of a node as well,
and so is a loop over one, which is empty. Where a launch file needs the value itself (text, number, path, comparison,
test) it is refused: no default would be right. Nothing of this exists while something is started.
"""

from __future__ import annotations

import ast
import inspect
import os
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from functools import lru_cache
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

from enclave_common.files import read_text
from enclave_common.source_location import SourceLocation
from enclave_launch.description.entity import LaunchDescriptionEntity
from enclave_launch.description.location import OUTSIDE, location_of
from enclave_launch.description.substitution import OpaqueValueUsed, Substitution
from enclave_launch.diagnostics.evaluation import module_not_installed
from enclave_launch.host.current import current_host
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Unforeseeable

if TYPE_CHECKING:
    from enclave_launch.description.launch_context import LaunchContext

_OURS = "enclave_launch."
_EVALUATION = "enclave_launch.evaluation"
_MAX_OPERATIONS = 100_000


class OpaqueValue(Substitution, LaunchDescriptionEntity):
    """A value that a module which is not installed would have given."""

    argument_summary = None  # as a description: it has not been summed up

    def __init__(self, text: str, module: str) -> None:
        self.__text = text
        self.__module = module
        self.__operations = 0
        self.source_location = _user_location()

    @property
    def opaque_text(self) -> str:
        """How the launch file writes it."""
        return self.__text

    @property
    def opaque_module(self) -> str:
        """The module that is not installed."""
        return self.__module

    def __repr__(self) -> str:
        return f"<{self.__text}, not known>"

    # As something that can be handed on

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name.endswith(("Error", "Exception")):
            return type(name, (Exception,), {})
        return self.__derived(f".{name}")

    def __getitem__(self, key: object) -> OpaqueValue:
        return self.__derived(f"[{key!r}]")

    def __setitem__(self, key: object, value: object) -> None:
        """Do nothing: what it holds is not known."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        if len(args) == 1 and not kwargs and (inspect.isfunction(args[0]) or inspect.isclass(args[0])):
            return args[0]  # a decorator
        result = self.__derived("()")
        if any(_may_be_extended(value) for value in (*args, *kwargs.values())):
            self.__report(f"what {result.opaque_text} adds to what it is given", _user_location())
        return result

    def __mro_entries__(self, bases: tuple[object, ...]) -> tuple[type, ...]:
        return (_class_of(self.__text, self.__module),)

    def __derived(self, suffix: str) -> OpaqueValue:
        self.__operations += 1
        if self.__operations > _MAX_OPERATIONS or len(self.__text) > _MAX_OPERATIONS:
            self.__refuse("an endless loop's condition")
        return OpaqueValue(self.__text + suffix, self.__module)

    # As several values: none, and reported

    def __iter__(self) -> Iterator[Any]:
        self.__report(f"what {self.__text} contains", _user_location())
        return iter(())

    def __add__(self, other: object) -> Any:
        if isinstance(other, str):
            self.__refuse("text")
        return [self, *other] if isinstance(other, list) else self.__derived(" + ...")

    def __radd__(self, other: object) -> Any:
        if isinstance(other, str):
            self.__refuse("text")
        return [*other, self] if isinstance(other, list) else self.__derived(" + ...")

    # As part of a launch description

    def visit(self, context: LaunchContext) -> None:
        self.__report(f"what {self.__text} would start", location_of(self, context))

    def describe(self) -> str:
        return repr(self)

    def get_launch_arguments_with_include_launch_description_actions(self, *_: object) -> list[Any]:
        """Return no arguments, as a description: those that it would declare are not known."""
        return []

    def __report(self, what: str, location: SourceLocation) -> None:
        if not isinstance(current_host(), PlanHost):
            self.__refuse("a part of a launch that is about to start")
        text = f"{what}: the Python module '{self.__module}' is not installed"
        current_host().unforeseeable(Unforeseeable(text, location))

    # As a value: refused

    def __refuse(self, use: str) -> NoReturn:
        raise OpaqueValueUsed(self.__text, self.__module, use)

    def perform(self, context: LaunchContext) -> str:
        self.__refuse("text")

    def __str__(self) -> str:
        self.__refuse("text")

    def __format__(self, format_spec: str) -> str:
        self.__refuse("text")

    def __fspath__(self) -> str:
        self.__refuse("a path")

    def __truediv__(self, other: object) -> OpaqueValue:
        self.__refuse("a path")

    def __rtruediv__(self, other: object) -> OpaqueValue:
        self.__refuse("a path")

    def __bool__(self) -> bool:
        self.__refuse("a condition")

    def __len__(self) -> int:
        self.__refuse("a number")

    def __contains__(self, item: object) -> bool:
        self.__refuse("a condition")

    def __eq__(self, other: object) -> bool:
        return self is other or self.__refuse("a condition")

    def __lt__(self, other: object) -> bool:
        self.__refuse("a condition")

    __gt__ = __le__ = __ge__ = __lt__
    __hash__ = object.__hash__


def _class_of(text: str, module: str) -> type[OpaqueValue]:
    """Return a base class for classes of the launch file: attributes that they do not have are opaque."""

    class OpaqueBase(OpaqueValue):
        def __init__(self, *_: object, **__: object) -> None:
            super().__init__(f"{type(self).__name__}()", module)

        def __call__(self, *args: Any, **kwargs: Any) -> Any:
            return OpaqueValue(f"{text}()", module)

    return OpaqueBase


def _may_be_extended(value: object) -> bool:
    """Return True for a list or description to which a function may add what is to be started."""
    if isinstance(value, OpaqueValue):
        return False
    if isinstance(value, list):
        return any(isinstance(item, LaunchDescriptionEntity) for item in value)
    return isinstance(value, LaunchDescriptionEntity)


class _OpaqueModule(ModuleType):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.__path__ = []
        self.all_names_imported = False

    def __getattr__(self, name: str) -> Any:
        if name == "__all__":  # ``from module import *``
            self.all_names_imported = True
            return ()
        if name.startswith("__"):
            raise AttributeError(name)
        return OpaqueValue(f"{self.__name__}.{name}", self.__name__.partition(".")[0])


class AbsentModules(Loader, MetaPathFinder):
    """The last of the finders: it finds what the launch file, or a module of the user, imports in vain.

    Args:
        taken: Packages of which nothing may be made up, by name.
        stood_in_for: Packages of which a part is there; other modules below them are opaque.
    """

    def __init__(self, taken: Sequence[str], stood_in_for: Sequence[str]) -> None:
        self.__taken = taken
        self.__stood_in_for = stood_in_for

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        top, _, below = fullname.partition(".")
        if top in self.__taken or top in sys.stdlib_module_names or not isinstance(current_host(), PlanHost):
            return None
        parent = sys.modules.get(fullname.rpartition(".")[0])
        if below and top not in self.__stood_in_for and not isinstance(parent, _OpaqueModule):
            return None
        importer = _importer()
        if importer is None or _has_an_answer(importer):
            return None
        return ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        if not isinstance(sys.modules.get(spec.name.rpartition(".")[0]), _OpaqueModule):
            current_host().warn(module_not_installed(spec.name))
        return _OpaqueModule(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing: there is nothing to execute."""

    @staticmethod
    def forget() -> None:
        """Take the modules that were made up out of ``sys.modules``."""
        for name in [name for name, module in sys.modules.items() if isinstance(module, _OpaqueModule)]:
            del sys.modules[name]


def modules_with_all_names_imported() -> list[str]:
    """Return the modules that are not installed, and from which a launch file imports ``*``."""
    modules = [each for each in sys.modules.values() if isinstance(each, _OpaqueModule)]
    return sorted(module.__name__ for module in modules if module.all_names_imported)


def _importer() -> FrameType | None:
    """Return the frame with the ``import`` that is being executed, None unless it is of the user's code."""
    frame = inspect.currentframe()
    while frame is not None and frame.f_code.co_name != "_find_and_load":
        frame = frame.f_back
        if frame is not None and not (_is_import_system(frame) or _is_ours(frame)):
            return None  # importlib.util.find_spec only asks
    while frame is not None and _is_import_system(frame):
        frame = frame.f_back
    return frame if frame is not None and _is_users(frame) else None


def _is_import_system(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith("<frozen importlib")


def _is_ours(frame: FrameType) -> bool:
    return str(frame.f_globals.get("__name__", "")).startswith(_OURS)


def _is_users(frame: FrameType) -> bool:
    file = frame.f_code.co_filename
    return not _is_ours(frame) and not file.startswith(("<", *_library_folders()))


@lru_cache(maxsize=1)
def _library_folders() -> tuple[str, ...]:
    paths = sysconfig.get_paths()
    return tuple(paths[name] + os.sep for name in ("stdlib", "platstdlib", "purelib", "platlib"))


def _has_an_answer(frame: FrameType | None) -> bool:
    """Return True if the user's code catches the error of an import that fails at this point."""
    while frame is not None and not _is_ours(frame):
        if _is_users(frame) and frame.f_lineno in _guarded_lines(frame.f_code.co_filename):
            return True
        frame = frame.f_back
    return False


@lru_cache(maxsize=64)
def _guarded_lines(file: str) -> frozenset[int]:
    """Return the lines of a Python file whose ImportError the file catches itself."""
    try:
        tree = ast.parse(read_text(file))
    except (OSError, SyntaxError, ValueError):
        return frozenset()
    bodies = [
        node.body
        for node in ast.walk(tree)
        if (isinstance(node, ast.Try) and any(_catches_import_errors(each.type) for each in node.handlers))
        or (isinstance(node, ast.With) and any(_suppresses(item.context_expr) for item in node.items))
    ]
    return frozenset(
        line
        for body in bodies
        for line in range(body[0].lineno, (body[-1].end_lineno or body[-1].lineno) + 1)
    )


_CATCH = {"ImportError", "ModuleNotFoundError", "Exception", "BaseException"}


def _catches_import_errors(caught: ast.expr | None) -> bool:
    names = caught.elts if isinstance(caught, ast.Tuple) else [caught]
    return any(name is None or (isinstance(name, ast.Name) and name.id in _CATCH) for name in names)


def _suppresses(expression: ast.expr) -> bool:
    return (
        isinstance(expression, ast.Call)
        and ast.unparse(expression.func).rpartition(".")[2] == "suppress"
        and any(_catches_import_errors(each) for each in expression.args)
    )


def _user_location() -> SourceLocation:
    """Return the line of the user's code that is being executed."""
    frame = inspect.currentframe()
    while frame is not None and not _is_users(frame):
        frame = None if str(frame.f_globals.get("__name__")).startswith(_EVALUATION) else frame.f_back
    return (
        SourceLocation(OUTSIDE) if frame is None else SourceLocation(frame.f_code.co_filename, frame.f_lineno)
    )
