"""The declarations of one preprocessed file, read from its tree."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.declarations import (
    BIT_FIELD,
    Class,
    Field,
    FileIndex,
    Function,
    Global,
    Scope,
    conversion,
    function_declarator,
    parameters_of,
    template_defaults,
    template_names,
    type_text,
    unnamed,
    written_name,
)
from enclave_addons.inference.cpp.reading.preprocess import Preprocessed
from enclave_addons.inference.cpp.reading.type_names import split_type
from enclave_addons.inference.cpp.syntax import (
    Node,
    children,
    field_of,
    line_of,
    parse,
    parse_expression,
    text,
    walk,
)

STRUCTURES = ("class_specifier", "struct_specifier", "union_specifier")
_USING = re.compile(r"\busing\s+namespace\s+([\w:]+)\s*;")


def index_file(source: Preprocessed) -> FileIndex:
    """Raises ``CppSupportMissing``."""
    tree = parse(source.text.encode())
    index = FileIndex(source.file, source, tree)
    _Collector(index).collect(tree.root_node, (), [])
    inside = (found.lstrip(":") for found in _USING.findall(source.text))  # of functions, for the whole file
    index.using += [name for name in dict.fromkeys(inside) if name not in index.using]
    if tree.root_node.has_error:
        for node in walk(tree.root_node):
            if node.type == "ERROR" or node.is_missing:
                index.errors.append((node.start_byte, line_of(node), text(node)))
    return index


class _Collector:
    def __init__(self, index: FileIndex):
        self.index = index
        self.defaults: dict[str, str] = {}  # of the template parameters that were just read

    def collect(self, node: Node, scope: Scope, templates: list[str], cls: Class | None = None) -> None:
        for child in node.named_children:
            self.one(child, scope, templates, cls)

    def one(self, child: Node, scope: Scope, templates: list[str], cls: Class | None) -> None:
        kind = child.type
        if kind == "namespace_definition":
            name = text(field_of(child, "name"))
            inner = (
                *scope,
                *(part.strip() for part in name.removeprefix("inline").split("::") if part.strip()),
            )
            self.collect(_required(child, "body"), inner, [])
        elif kind in STRUCTURES:
            self.class_(child, scope, templates)
        elif kind == "function_definition":
            self.function(child, scope, templates, cls)
        elif kind == "template_declaration":
            names = template_names(field_of(child, "parameters"))
            self.defaults = template_defaults(field_of(child, "parameters"))
            for inner_node in child.named_children[1:]:
                self.one(inner_node, scope, [*templates, *names], cls)
        elif kind in (
            "alias_declaration",
            "using_declaration",
            "namespace_alias_definition",
            "type_definition",
        ):
            self.alias(child, scope, cls)
        elif kind == "enum_specifier":
            self.enum(child, scope)
        elif kind in ("declaration", "field_declaration"):
            self.declaration(child, scope, templates, cls)
        elif kind == "friend_declaration":
            classes = {each.qualified for listed in self.index.classes.values() for each in listed}
            around = next(n for n in range(len(scope), -1, -1) if "::".join(scope[:n]) not in classes)
            for each in children(child):
                if each.type == "function_definition":  # of the namespace around
                    self.function(each, scope[:around], templates, None)
        elif kind in ("preproc_if", "preproc_ifdef", "preproc_else", "preproc_elif", "linkage_specification",
                      "declaration_list", "ERROR", "export_declaration"):  # fmt: skip
            self.collect(child, scope, templates, cls)

    # --- classes ----------------------------------------------------------------------------------------

    def class_(self, node: Node, scope: Scope, templates: list[str], name: str = "") -> None:
        """Add a class; ``name``: what a ``typedef`` calls one that has none itself."""
        body = field_of(node, "body")
        named = field_of(node, "name")
        if body is None:
            return
        written = text(named).partition("<")[0] or name or unnamed(node)
        steps = [step for step in written.split("::") if step]
        name, inner = steps[-1], (*scope, *steps)
        made = Class(name, "::".join(inner), self.index, node, inner, templates=templates)
        made.specialises = split_type(text(named))[1] or None
        made.template_defaults, self.defaults = (self.defaults if templates else {}), {}
        for child in node.named_children:
            if child.type == "base_class_clause":
                listed = [b for b in children(child) if b.type not in ("access_specifier", "virtual")]
                made.bases = [text(b) for b in listed]
                made.virtual_base = any(b.type == "virtual" for b in child.children)
        self.index.classes.setdefault(name, []).append(made)
        self.collect(body, inner, [], made)

    def enum(self, node: Node, scope: Scope) -> None:
        name = text(field_of(node, "name"))
        body = field_of(node, "body")
        prefix = "::".join((*scope, *([name] if name else [])))
        self.index.enums.add(name)
        listed = [child for child in children(body) if child.type == "enumerator"]
        if not _all_differ([text(field_of(each, "value")) for each in listed]):
            return
        for child in listed:
            constant = text(field_of(child, "name"))
            full = f"{prefix}::{constant}" if prefix else constant
            for key in (constant, f"{name}::{constant}", full):
                self.index.enumerators.setdefault(key, full)

    # --- functions --------------------------------------------------------------------------------------

    def function(self, node: Node, scope: Scope, templates: list[str], cls: Class | None) -> None:
        made = self._function(node, scope, templates, cls)
        if made is None or any(child.type == "delete_method_clause" for child in node.named_children):
            return
        made.body = next(
            (c for c in node.named_children if c.type in ("compound_statement", "try_statement")), None
        )
        if made.body is None:  # = default, = 0
            self._declare(made, cls)
            return
        for child in (
            *node.named_children,
            *(made.body.named_children if made.body.type == "try_statement" else ()),
        ):
            if child.type == "field_initializer_list":
                made.initialisers = [
                    _initialiser(item) for item in children(child) if item.type == "field_initializer"
                ]
        self.index.all_functions.append(made)
        if cls is not None:
            cls.methods.setdefault(made.name, []).append(made)
        else:
            self.index.functions.setdefault(made.name, []).append(made)

    def _function(self, node: Node, scope: Scope, templates: list[str], cls: Class | None) -> Function | None:
        declarator = function_declarator(node) or conversion(node)
        if declarator is None:
            return None
        named = written_name(node, declarator)
        full = _plain_name(named)
        owner, _, name = full.rpartition("::")
        owner = cls.qualified if cls is not None else self._used(owner, scope)
        inner = scope if cls is not None else (*scope, *(step for step in owner.split("::") if step))
        made = Function(name, node, self.index, inner, owner, templates=templates)
        made.specialises = _specialised(named, templates) if cls is None else None
        made.parameters = parameters_of(declarator, made)
        words = {
            text(child)
            for child in node.named_children
            if child.type in ("virtual", "storage_class_specifier")
        }
        head = text(node)[: max(0, declarator.end_byte - node.start_byte)]
        made.virtual = (
            "virtual" in words
            or head.lstrip().startswith("virtual")
            or any(child.type == "virtual_specifier" for child in declarator.named_children)
        )
        made.overrides = any(child.type == "virtual_specifier" for child in declarator.named_children)
        made.static = "static" in words
        return made

    def _used(self, owner: str, scope: Scope) -> str:
        """Return the class before ``::`` as a using-declaration above has it: ``using ns::Foo; Foo::Foo() {}``."""
        first, separator, rest = owner.partition("::")
        target = self.index.aliases.get("::".join((*scope, first)), ("", ()))[0]
        return f"{target}{separator}{rest}" if target.endswith(f"::{first}") else owner

    def _declare(self, made: Function, cls: Class | None) -> None:
        table = cls.declared if cls is not None else self.index.declared
        table.setdefault(made.name, []).append(made)

    # --- the rest ---------------------------------------------------------------------------------------

    def declaration(self, node: Node, scope: Scope, templates: list[str], cls: Class | None) -> None:
        kind = field_of(node, "type")
        if kind is not None and kind.type in STRUCTURES:
            self.class_(kind, scope, templates)
        elif kind is not None and kind.type == "enum_specifier":
            self.enum(kind, scope)
        if function_declarator(node) is not None and not _is_variable(node):
            made = self._function(node, scope, templates, cls)
            if made is not None:
                self._declare(made, cls)
                if cls is None and any(each.type in self.index.globals for each in made.parameters):
                    self._object(node, made)
            return
        for declared in declared_names(node):
            self._variable(node, declared, scope, templates, cls)

    def _object(self, node: Node, made: Function) -> None:
        """Add the variable ``Foo foo(bar);``, which reads as a function, where ``bar`` is a variable."""
        written = text(field_of(function_declarator(node), "parameters"))
        given = field_of(parse_expression(f"f{written}"), "arguments")
        found = Global(made.name, type_text(node), given, node, made.scope, self.index, False)
        self.index.globals.setdefault(made.name, []).append(found)

    def _variable(
        self, node: Node, declared: DeclaredVariable, scope: Scope, templates: list[str], cls: Class | None
    ) -> None:
        name, value, pointer, written = declared
        specialises = _specialised(name, templates)
        name = _plain_name(name)
        static = any(text(c) == "static" for c in node.named_children if c.type == "storage_class_specifier")
        if cls is not None:
            cls.fields[name] = Field(name, written, value, static, pointer, node)
            return
        owner, _, last = name.rpartition("::")
        inner = (*scope, *(step for step in self._used(owner, scope).split("::") if step))
        made = Global(last, written, value, node, inner, self.index, pointer, specialises)
        self.index.globals.setdefault(last, []).append(made)

    def alias(self, node: Node, scope: Scope, cls: Class | None) -> None:
        if node.type == "using_declaration":
            target = text(node.named_children[-1]) if node.named_children else ""
            if re.match(r"using\s+namespace\b", text(node)):
                self.index.using.append(target.lstrip(":"))
            else:
                name = target.rpartition("::")[2]
                if cls is not None and (
                    name in target.rpartition("::")[0].split("::")[-1:]
                    or any(base.partition("<")[0].rpartition("::")[2] == name for base in cls.bases)
                ):
                    cls.inherits_constructors = True
                    return
                if cls is not None:
                    cls.uses.setdefault(name, []).append(target.rpartition("::")[0])
                self.index.aliases["::".join((*scope, name))] = (target, scope)
            return
        if node.type == "type_definition":
            names = [child for child in node.named_children if child.type == "type_identifier"]
            kind = field_of(node, "type")
            if kind is not None and kind.type in STRUCTURES and field_of(kind, "body") is not None:
                own = "" if field_of(kind, "name") is not None or not names else text(names[-1])
                self.class_(kind, scope, [], own)
                if own:
                    return
                kind = field_of(kind, "name") or kind
            if kind is not None and kind.type == "enum_specifier":
                self.enum(kind, scope)
                self.index.enums |= {text(name) for name in names}
                return
            if names and kind is not None:
                self.index.aliases["::".join((*scope, text(names[-1])))] = (text(kind), scope)
            return
        inner = children(node)
        if len(inner) >= 2:
            self.index.aliases["::".join((*scope, text(inner[0])))] = (text(inner[-1]), scope)


def _specialised(name: str, templates: list[str]) -> tuple[str, ...] | None:
    """Return the arguments in ``Foo<int>::f`` and ``f<int>``, unless they are the template's own parameters."""
    written = split_type(name)[1] if "operator" not in name else ()
    return (
        None
        if not written or set(written) <= {*templates, *(f"{each}..." for each in templates)}
        else written
    )


def _required(node: Node, name: str) -> Node:
    return field_of(node, name) or node


def _is_variable(node: Node) -> bool:
    """Return whether it is a variable: ``Foo member(1, this);`` reads as a function that takes types named 1 and
    this.
    """
    declarator = function_declarator(node)
    listed = children(field_of(declarator, "parameters")) if declarator is not None else []
    return any(text(item) in ("this", "*this", "nullptr", "true", "false") for item in listed)


def _plain_name(name: str) -> str:
    """Strip template arguments: ``Foo<T>::bar`` is ``Foo::bar``; operators stay whole."""
    if "operator" in name:
        return name
    out, depth = [], 0
    for character in name:
        depth += (character == "<") - (character == ">")
        if depth == 0 and character != ">":
            out.append(character)
    return re.sub(r"\s+", "", "".join(out))


def _all_differ(numbers: Sequence[str]) -> bool:
    """Return whether enumerators with these numbers, as written, are certainly all different."""
    return not any(numbers[1:]) or (
        all(map(str.isdecimal, numbers)) and len({*map(int, numbers)}) == len(numbers)
    )


def _initialiser(item: Node) -> tuple[str, Node]:
    inner = children(item)
    return re.sub(r"\s+", "", text(inner[0])), inner[-1]


class DeclaredVariable(NamedTuple):
    """One variable of a declaration. ``type``: of the variable itself; that of an array is a ``std::array``."""

    name: str
    value: Node | None
    pointer: bool
    type: str


def declared_names(node: Node) -> list[DeclaredVariable]:
    """Return the variables of a declaration."""
    found: list[DeclaredVariable] = []
    values = node.children_by_field_name("default_value") or node.children_by_field_name("value")
    declarators = node.children_by_field_name("declarator")
    for index, declarator in enumerate(declarators):
        value = None
        inner: Node | None = declarator
        pointer, array, size = False, False, ""
        while inner is not None and inner.type not in (
            "identifier",
            "field_identifier",
            "qualified_identifier",
        ):
            if inner.type == "init_declarator":
                value = field_of(inner, "value")
            pointer = pointer or inner.type in ("pointer_declarator", "reference_declarator")
            if inner.type == "array_declarator":
                array, size = True, "" if array else text(field_of(inner, "size"))
            inner = field_of(inner, "declarator") or next(
                (c for c in inner.named_children if c.type.endswith(("declarator", "identifier"))), None
            )
        if inner is not None:
            end = declarators[index + 1].start_byte if index + 1 < len(declarators) else node.end_byte
            later = [v for v in values if declarator.end_byte <= v.start_byte < end]
            is_bit_field = any(each.type == "bitfield_clause" for each in node.named_children)
            written = BIT_FIELD if is_bit_field else type_text(node)
            if array and (pointer or written not in ("char", "unsigned char")):
                counted = f", {size}" if size.isdigit() else ""
                written, pointer = f"std::array<{written}{' *' if pointer else ''}{counted}>", False
            found.append(
                DeclaredVariable(text(inner), value or (later[0] if later else None), pointer, written)
            )
    return found
