"""C++ files as syntax trees, and what their declarations say: constants, aliases, classes, functions.

Reads files; next is ``nodes``, which looks for endpoints in what is collected here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from nodl.source_ref import SourceRef

if TYPE_CHECKING:
    from tree_sitter import Node, Parser


class CppSupportMissing(Exception):
    """tree-sitter is not installed: ``pip install enclave-launch[cpp]``."""


@lru_cache(maxsize=1)
def _parser() -> Parser:
    try:
        import tree_sitter_cpp
        from tree_sitter import Language, Parser
    except ImportError as error:
        raise CppSupportMissing(
            "C++ sources need the extra cpp: pip install 'enclave-launch[cpp]'"
        ) from error
    return Parser(Language(tree_sitter_cpp.language()))


@dataclass(eq=False)
class Function:
    """A function, method or constructor body with the names of its parameters."""

    name: str
    node: Node
    file: str
    owner: str | None = None  # the class
    parameters: list[str] = field(default_factory=list)
    defaults: dict[str, Node] = field(default_factory=dict)
    initialisers: dict[str, Node] = field(default_factory=dict)  # member or base -> its arguments
    values: dict[str, list[Node]] = field(default_factory=dict)  # variable -> expressions assigned to it


@dataclass(eq=False)
class CppClass:
    name: str
    file: str
    line: int
    bases: list[str] = field(default_factory=list)
    qualified: str = ""
    values: dict[str, list[Node]] = field(default_factory=dict)
    functions: list[Function] = field(default_factory=list)


@dataclass
class CppUnit:
    """All sources of one package together."""

    classes: dict[str, CppClass] = field(default_factory=dict)
    functions: list[Function] = field(default_factory=list)
    constants: dict[str, list[Node]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    registered: list[str] = field(default_factory=list)
    errors: list[SourceRef] = field(default_factory=list)


def text(node: Node | None) -> str:
    return node.text.decode("utf-8", "replace") if node is not None and node.text is not None else ""


def line_of(node: Node) -> int:
    return int(node.start_point[0]) + 1


def walk(node: Node) -> Iterator[Node]:
    """``node`` and everything below it, in order."""
    stack = [node]
    while stack:
        current = stack.pop()
        yield current
        stack.extend(reversed(current.named_children))


def read_unit(files: list[str]) -> CppUnit:
    """Parse and collect. Raises ``CppSupportMissing``."""
    unit = CppUnit()
    for file in files:
        try:
            data = Path(file).read_bytes()
        except OSError:
            unit.errors.append(SourceRef(file))
            continue
        tree = _parser().parse(data)
        _collect(unit, tree.root_node, file, [])
    for function in [*unit.functions]:
        if function.owner in unit.classes:
            unit.classes[function.owner].functions.append(function)
            unit.functions.remove(function)
    return unit


def _collect(unit: CppUnit, node: Node, file: str, scope: list[str]) -> None:
    for child in node.named_children:
        kind = child.type
        if kind == "namespace_definition":
            inner = text(child.child_by_field_name("name"))
            body = child.child_by_field_name("body")
            if body is not None:
                _collect(unit, body, file, [*scope, *([inner] if inner else [])])
        elif kind in ("class_specifier", "struct_specifier"):
            _collect_class(unit, child, file, scope)
        elif kind == "function_definition":
            _collect_function(unit, child, file, None)
        elif kind == "preproc_def":
            _constant_macro(unit, child)
        elif kind in ("alias_declaration", "namespace_alias_definition", "using_declaration"):
            _alias(unit, child)
        elif kind in ("declaration", "field_declaration"):
            _assignments(child, unit.constants)
            _collect(unit, child, file, scope)
        elif kind == "expression_statement" and "RCLCPP_COMPONENTS_REGISTER_NODE" in text(child):
            _registration(unit, child)
        elif kind in ("preproc_ifdef", "preproc_if", "preproc_else", "linkage_specification", "template_declaration",
                      "declaration_list"):  # fmt: skip
            _collect(unit, child, file, scope)
        elif kind == "ERROR" and "create_" in text(child):
            unit.errors.append(SourceRef(file, line_of(child)))


def _registration(unit: CppUnit, node: Node) -> None:
    for call in walk(node):
        if call.type == "call_expression":
            arguments = call.child_by_field_name("arguments")
            if arguments is not None and arguments.named_children:
                unit.registered.append(text(arguments.named_children[0]).lstrip(":"))


def _constant_macro(unit: CppUnit, node: Node) -> None:
    value = text(node.child_by_field_name("value")).strip()
    if value.startswith('"') and value.endswith('"'):
        literal = _parser().parse(f"auto x = {value};".encode()).root_node
        _assignments(literal, {}, unit.constants, text(node.child_by_field_name("name")))


def _alias(unit: CppUnit, node: Node) -> None:
    if node.type == "using_declaration":
        target = text(node.named_children[-1]) if node.named_children else ""
        unit.aliases[target.rpartition("::")[2]] = target
    elif len(node.named_children) >= 2:
        unit.aliases[text(node.named_children[0])] = text(node.named_children[-1])


def _collect_class(unit: CppUnit, node: Node, file: str, scope: list[str]) -> None:
    name = text(node.child_by_field_name("name"))
    body = node.child_by_field_name("body")
    if body is None or not name:
        return
    cls = CppClass(name, file, line_of(node), qualified="::".join([*scope, name]))
    for child in node.named_children:
        if child.type == "base_class_clause":
            cls.bases = [text(base) for base in child.named_children if base.type != "access_specifier"]
    unit.classes[name] = cls
    for child in body.named_children:
        if child.type == "function_definition":
            _collect_function(unit, child, file, cls)
        elif child.type in ("field_declaration", "declaration"):
            _assignments(child, cls.values)
        elif child.type in ("alias_declaration", "using_declaration"):
            _alias(unit, child)
        elif child.type in ("class_specifier", "struct_specifier"):
            _collect_class(unit, child, file, [*scope, name])


def _collect_function(unit: CppUnit, node: Node, file: str, cls: CppClass | None) -> None:
    declarator = node.child_by_field_name("declarator")
    while declarator is not None and declarator.type != "function_declarator":
        declarator = declarator.child_by_field_name("declarator") or next(
            (c for c in declarator.named_children if c.type == "function_declarator"), None
        )
    if declarator is None:
        return
    full = text(declarator.child_by_field_name("declarator"))
    owner, _, name = full.rpartition("::")
    function = Function(name or full, node, file, cls.name if cls else owner.rpartition("::")[2] or None)
    _read_parameters(function, declarator)
    for child in node.named_children:
        if child.type == "field_initializer_list":
            for item in child.named_children:
                if len(item.named_children) >= 2:
                    member = text(item.named_children[0]).rpartition("::")[2].partition("<")[0]
                    function.initialisers[member] = item.named_children[-1]
    _assignments(node, function.values)
    if cls is not None:
        cls.functions.append(function)
    else:
        unit.functions.append(function)


def _read_parameters(function: Function, declarator: Node) -> None:
    parameters = declarator.child_by_field_name("parameters")
    for parameter in parameters.named_children if parameters is not None else ():
        names = [child for child in walk(parameter) if child.type == "identifier"]
        name = text(names[0]) if names else ""
        function.parameters.append(name)
        default = parameter.child_by_field_name("default_value")
        if default is not None:
            function.defaults[name] = default


def _assignments(
    node: Node, values: dict[str, list[Node]], into: dict[str, list[Node]] | None = None, name: str = ""
) -> None:
    """Every ``x = e``, ``T x(e)``, ``T x{e}`` below ``node``."""
    for child in walk(node):
        target: Node | None = None
        value: Node | None = None
        if child.type == "init_declarator":
            target, value = child.child_by_field_name("declarator"), child.child_by_field_name("value")
        elif child.type == "assignment_expression":
            target, value = child.child_by_field_name("left"), child.child_by_field_name("right")
        elif child.type == "field_declaration":
            target = child.child_by_field_name("declarator")
            value = child.child_by_field_name("default_value")
        if target is None or value is None:
            continue
        if into is not None:
            into.setdefault(name, []).append(value)
            continue
        key = text(target).lstrip("*& ").removeprefix("this->").partition("[")[0]
        values.setdefault(key, []).append(value if child.type != "assignment_expression" else child)
