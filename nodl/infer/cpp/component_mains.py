"""Executables whose ``main`` only makes a component and spins it: they make what the component makes.

Decided by the text of ``main``, statement by statement; any other ``main`` is a program of its own. Reads files.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from enclave_launch.boundary.files import text_or_nothing
from nodl.infer.cpp.entry import Entry
from nodl.infer.cpp.program import Sources
from nodl.infer.cpp.reading.declarations import FileIndex, FunctionParameter
from nodl.infer.cpp.syntax import text

_MAIN = re.compile(
    r"\{rclcpp::init\((?P<arguments>\w+,\w+)\);"
    r"(?:rclcpp::NodeOptions(?P<options>\w+);)?"
    r"auto(?P<node>\w+)=std::make_shared<(?P<component>[\w:]+)>\((?P<given>rclcpp::NodeOptions\(\)|(?P=options))?\);"
    r"rclcpp::spin\((?P=node)(?:->get_node_base_interface\(\))?\);"
    r"(?:rclcpp::shutdown\(\);)?(?:return(?:0|EXIT_SUCCESS);)?\}"
)  # without white space
_DEFAULTS = ("rclcpp::NodeOptions()", "NodeOptions()", "{}")


def may_only_make(executable: Entry, component: Entry) -> bool:
    """Whether it is worth to ask ``only_makes``."""
    file = _main_beside(executable, component)
    return file is not None and f"<{component.cls}>" in text_or_nothing(file)


def _main_beside(executable: Entry, component: Entry) -> str | None:
    """The one source that the executable has beside those of the component; ``None`` if that is not all."""
    own = [file for file in executable.files if file not in component.files]
    rest = tuple(file for file in executable.files if file in component.files)
    alike = (executable.symbols, executable.complete) == (component.symbols, component.complete)
    return own[0] if alike and executable.main and rest == component.files and len(own) == 1 else None


def only_makes(executable: Entry, component: Entry, sources: Sources) -> bool:
    """Whether ``executable`` makes ``component``, as a container would, and nothing else."""
    file, symbols = _main_beside(executable, component), dict(component.symbols)
    index = sources.index(file, symbols, component.complete) if file is not None else None
    made = _made(index) if index is not None else None
    if index is None or made is None or made["component"] != component.cls:
        return False
    reached = sources.closure(component.files, symbols, component.complete)
    takes = _options_alone(component.cls, reached)
    default = text(takes.default) if takes is not None else ""
    called_alike = takes is not None and (made["given"] or "".join(default.split()) in _DEFAULTS)
    return bool(called_alike) and {each.file for each in reached}.issuperset(index.source.includes)


def _made(index: FileIndex) -> re.Match[str] | None:
    """What such a ``main`` makes, where the file has nothing else."""
    others = (
        index.classes, index.globals, index.aliases, index.using, index.enums, index.declared, index.errors,
        index.source.uncertain, index.source.unknown_macros,
    )  # fmt: skip
    mains = index.functions.get("main", ())
    if any(others) or len(index.all_functions) != 1 or len(mains) != 1:
        return None
    match = _MAIN.fullmatch("".join(text(mains[0].body).split()))
    given = ",".join(each.name for each in mains[0].parameters)
    return match if match is not None and match["arguments"] == given else None


def _options_alone(component: str, files: Iterable[FileIndex]) -> FunctionParameter | None:
    """The parameter of the one constructor that takes options, and takes nothing else; ``main`` can call no other."""
    name = component.rpartition("::")[2]
    classes = (each for index in files for each in index.classes.get(name, ()) if each.qualified == component)
    found = [each for cls in classes for each in (*cls.methods.get(name, ()), *cls.declared.get(name, ()))]
    taking = [each.parameters for each in found if any("NodeOptions" in p.type for p in each.parameters)]
    alone = len(taking) == 1 == len(taking[0]) and all(each.parameters for each in found)
    return taking[0][0] if alone else None
