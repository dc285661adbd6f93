"""What a file declares: classes, functions with their parameters, variables, as values. Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.preprocess import Preprocessed
from enclave_addons.inference.cpp.syntax import Node, Tree, children, field_of, line_of, text, walk

_LITERAL = re.compile(r'"(?:\\.|[^"\\\n])*"')
Scope = tuple[str, ...]  # namespaces and classes around a declaration


_MENTIONED = re.compile(r"\b(?:msg|srv|action)::\w+|[A-Za-z_]\w*\b(?!\s*::(?!\s*(?:make_|[Cc]reate|Make)))")


_CHAIN = re.compile(r"(?:([A-Za-z_]\w*)\s*(\.|->|::)\s*|(\.|->|::)\s*)?([A-Za-z_]\w*)")


class Mention(NamedTuple):
    """An identifier in code: behind ``.``, ``->`` or ``::`` and the identifier ``before`` that, or behind neither."""

    name: str
    link: str
    before: str


@dataclass(eq=False, slots=True)
class FunctionParameter:
    """``type``: as written, with ``const`` and ``&`` or ``*``; ``name``: empty if the parameter has none."""

    name: str
    type: str
    default: Node | None = None

    @property
    def written_back(self) -> bool:
        """Return True if what a function writes to the parameter shows in its caller."""
        marked = self.type.rstrip().endswith(("&", "*"))
        return marked and "const" not in self.type.split() and bool(self.name)


@dataclass(eq=False, slots=True)
class Function:
    """A function with a body; ``owner`` is the class as written or known, empty for free functions."""

    name: str
    node: Node
    file: FileIndex
    scope: Scope  # namespaces, then classes, that names in it are looked up in
    owner: str = ""
    parameters: list[FunctionParameter] = field(default_factory=list)
    templates: list[str] = field(default_factory=list)
    initialisers: list[tuple[str, Node]] = field(default_factory=list)  # member or base -> arguments
    body: Node | None = None
    virtual: bool = False
    static: bool = False
    variadic: bool = False
    specialises: tuple[str, ...] | None = None  # arguments as written, its own or those of its class
    overrides: bool = False  # says so
    _words: frozenset[str] | None = None
    _mentions: frozenset[Mention] | None = None

    @property
    def qualified(self) -> str:
        return "::".join((*self.scope, self.name))

    @property
    def words(self) -> frozenset[str]:
        """Return every identifier in it but for its own name, and for scopes: whoever it may call is among them.

        Types of messages stand as ``msg::String``: they are none of the classes of the same last name.
        """
        if self._words is None:
            self._words = frozenset(_MENTIONED.findall(self._without_name()))
        return self._words

    @property
    def mentions(self) -> frozenset[Mention]:
        """Return every identifier in it but for its own name, with what it is called on."""
        if self._mentions is None:
            found = (match.groups("") for match in _CHAIN.finditer(self._without_name()))
            self._mentions = frozenset(
                Mention(name, link or chained, before) for before, link, chained, name in found
            )
        return self._mentions

    def _without_name(self) -> str:
        named = field_of(function_declarator(self.node), "declarator")
        source, start = self.node.text or b"", self.node.start_byte
        if named is not None:
            source = source[: named.start_byte - start] + source[named.end_byte - start :]
        return _LITERAL.sub("", source.decode("utf-8", "replace"))

    @property
    def constant(self) -> bool:
        """Return True for a ``const`` method."""
        declarator = function_declarator(self.node)
        qualifiers = declarator.named_children if declarator is not None else []
        return any(each.type == "type_qualifier" and text(each) == "const" for each in qualifiers)

    @property
    def line(self) -> int:
        return line_of(self.node)

    def __repr__(self) -> str:
        return f"{self.owner}::{self.name}" if self.owner else self.name


@dataclass(eq=False, slots=True)
class Field:
    """A data member. ``pointer``: declared with ``*`` or ``&``, which ``type`` then leaves out."""

    name: str
    type: str
    default: Node | None
    static: bool
    pointer: bool
    node: Node


@dataclass(eq=False, slots=True)
class Class:
    """A class with a body; ``fields``, ``methods`` and ``declared`` leave out what its bases have."""

    name: str
    qualified: str
    file: FileIndex
    node: Node
    scope: Scope
    bases: list[str] = field(default_factory=list)
    virtual_base: bool = False  # one of them is virtual
    templates: list[str] = field(default_factory=list)
    fields: dict[str, Field] = field(default_factory=dict)
    methods: dict[str, list[Function]] = field(default_factory=dict)
    declared: dict[str, list[Function]] = field(default_factory=dict)  # without body: defaults and virtual
    inherits_constructors: bool = False
    uses: dict[str, list[str]] = field(default_factory=dict)  # name -> bases of ``using Base::name``
    template_defaults: dict[str, str] = field(default_factory=dict)
    # Arguments as written, of an explicit or partial specialisation.
    specialises: tuple[str, ...] | None = None

    @property
    def line(self) -> int:
        return line_of(self.node)

    def __repr__(self) -> str:
        return self.qualified


@dataclass(eq=False, slots=True)
class Global:
    """A variable outside of functions; for a static member defined there ``scope`` ends with the class."""

    name: str
    type: str
    value: Node | None
    node: Node
    scope: Scope
    file: FileIndex
    pointer: bool
    specialises: tuple[str, ...] | None = None  # the arguments of its class, as written

    @property
    def qualified(self) -> str:
        return "::".join((*self.scope, self.name))


@dataclass(eq=False, slots=True)
class FileIndex:
    """One file. Names are kept under their last part; ``qualified`` tells them apart."""

    file: str
    source: Preprocessed
    tree: Tree
    classes: dict[str, list[Class]] = field(default_factory=dict)
    functions: dict[str, list[Function]] = field(default_factory=dict)
    declared: dict[str, list[Function]] = field(default_factory=dict)
    globals: dict[str, list[Global]] = field(default_factory=dict)
    # Qualified -> what it stands for, where.
    aliases: dict[str, tuple[str, Scope]] = field(default_factory=dict)
    using: list[str] = field(default_factory=list)  # using namespace
    enums: set[str] = field(default_factory=set)
    enumerators: dict[str, str] = field(default_factory=dict)  # qualified and last name -> qualified
    errors: list[tuple[int, int, str]] = field(default_factory=list)  # first byte, line, text
    all_functions: list[Function] = field(default_factory=list)


def conversion(node: Node) -> Node | None:
    """Return the declarator of a conversion operator, ``operator T()``; ``None`` for all else."""
    declarator = field_of(node, "declarator") if node.type == "function_definition" else None
    while declarator is not None and declarator.type == "qualified_identifier":
        declarator = field_of(declarator, "name")
    return declarator if declarator is not None and declarator.type == "operator_cast" else None


def written_name(node: Node, declarator: Node) -> str:
    """Return the name in a function's declarator: ``Foo::bar``, ``Foo::operator bool``."""
    if declarator.type != "operator_cast":
        return text(field_of(declarator, "declarator"))
    whole = text(field_of(node, "declarator"))
    return f"{whole.partition('operator')[0]}operator {text(declarator.child_by_field_name('type')).replace('::', '.')}"


def function_declarator(node: Node) -> Node | None:
    """Return the declarator with the parameters; ``None`` for variables, arrays and pointers to functions."""
    declarator = field_of(node, "declarator")
    while declarator is not None and declarator.type != "function_declarator":
        if declarator.type in ("init_declarator", "array_declarator"):
            return None
        declarator = field_of(declarator, "declarator") or next(
            (c for c in declarator.named_children if c.type.endswith("_declarator")), None
        )
    inner = field_of(declarator, "declarator")
    if inner is not None and inner.type == "parenthesized_declarator":
        return None  # a pointer to a function
    return declarator


def type_text(node: Node) -> str:
    """Return the type as written, on one line, without ``const``, ``&`` and ``*`` around it; may be empty."""
    kind = field_of(node, "type")
    if kind is not None and kind.type in BODIES and field_of(kind, "body") is not None:
        return text(field_of(kind, "name")) or unnamed(kind)
    return " ".join(text(kind).split())


BODIES = ("class_specifier", "struct_specifier", "union_specifier", "enum_specifier")
"""What declares a type where it is used."""


BIT_FIELD = "bit_field"
"""Stands for the type of a member that keeps some bits of a number only."""


def unnamed(node: Node) -> str:
    """Make a name for a structure without one."""
    return f"unnamed_{line_of(node)}_{node.start_point[1]}"


_VARIADIC = ("variadic_parameter_declaration", "variadic_parameter", "...")


def parameters_of(declarator: Node, function: Function | None = None) -> list[FunctionParameter]:
    """Return parameters in order, without a lone ``void``; ``...`` or a pack marks ``function`` as variadic."""
    listed = field_of(declarator, "parameters")
    found = []
    for child in listed.children if listed is not None else ():
        if child.type in _VARIADIC and function is not None:
            function.variadic = True
        if not child.type.endswith("parameter_declaration"):
            continue
        declared = field_of(child, "declarator")
        names = [n for n in walk(declared) if n.type == "identifier"] if declared is not None else []
        constant = any(text(c) == "const" for c in child.named_children if c.type == "type_qualifier")
        written = ("const " if constant else "") + type_text(child) + _marks(declared)
        if written == "void" and not names:
            continue
        found.append(
            FunctionParameter(text(names[0]) if names else "", written, field_of(child, "default_value"))
        )
    return found


def _marks(declarator: Node | None) -> str:
    """Return ``&`` or ``*`` of a declarator; an array as a parameter is a pointer ([dcl.fct]/5)."""
    if declarator is None:
        return ""
    if declarator.type == "array_declarator":
        return "*"
    written = text(declarator)
    return "".join(c for c in written[: max(1, len(written) - len(written.lstrip("&* ")))] if c in "&*")


def template_names(node: Node | None) -> list[str]:
    """Return the names of a template's parameters in order, empty for one without."""
    names = []
    for child in children(node):
        identifiers = [c for c in walk(child) if c.type in ("type_identifier", "identifier")]
        if child.type in ("parameter_declaration", "optional_parameter_declaration"):
            declarator = field_of(child, "declarator")
            names.append(text(declarator) if declarator is not None else "")
        elif identifiers:
            named = field_of(child, "name")
            names.append(text(named or identifiers[0]))
        else:
            names.append("")
    return names


def template_defaults(node: Node | None) -> dict[str, str]:
    """Return the defaults of a template's parameters, by their names."""
    found = {}
    for child in children(node):
        default = field_of(child, "default_type") or field_of(child, "default_value")
        name = field_of(child, "name") or field_of(child, "declarator")
        if default is not None and name is not None:
            found[text(name)] = text(default)
    return found
