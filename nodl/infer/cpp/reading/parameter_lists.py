"""Parameters in the declarators of functions, and of templates. Pure."""

from __future__ import annotations

from nodl.infer.cpp.reading.declarations import Function, FunctionParameter, type_text
from nodl.infer.cpp.syntax import Node, children, field_of, text, walk


def parameters_of(declarator: Node, function: Function | None = None) -> list[FunctionParameter]:
    """Parameters in order, without a lone ``void``; ``...`` or a pack marks ``function`` as variadic."""
    listed = field_of(declarator, "parameters")
    found = []
    for child in listed.named_children if listed is not None else ():
        if child.type in ("variadic_parameter_declaration", "variadic_parameter") and function is not None:
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
    """``&`` or ``*`` of a declarator."""
    if declarator is None:
        return ""
    written = text(declarator)
    return "".join(c for c in written[: max(1, len(written) - len(written.lstrip("&* ")))] if c in "&*")


def template_names(node: Node | None) -> list[str]:
    """The names of a template's parameters in order, empty for one without."""
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
    """The defaults of a template's parameters, by their names."""
    found = {}
    for child in children(node):
        default = field_of(child, "default_type") or field_of(child, "default_value")
        name = field_of(child, "name") or field_of(child, "declarator")
        if default is not None and name is not None:
            found[text(name)] = text(default)
    return found
