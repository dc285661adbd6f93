"""What a value stands for in this run: parameters and names of nodes as the launch sets them, else their defaults.

The machine keeps which of them decided what is made.
"""

from __future__ import annotations

from enclave_addons.inference.cpp.engine.machine import Machine
from enclave_addons.inference.cpp.engine.values import (
    Atom,
    NodeNamePart,
    Param,
    Seq,
    Text,
    Value,
    literal,
    plain,
    truth,
    unknown,
)
from enclave_addons.inference.cpp.findings import AllocatedNode
from nodl.name_template import ParameterPart


def text_of(run: Machine, atom: Atom) -> str | None:
    """Return the text that a value stands for in this run: of a parameter as launch sets it, else its default."""
    known = plain(atom)
    if known is not None or not isinstance(atom, Text | Param):
        return known
    if isinstance(atom, Param):
        return _parameter_text(run, atom)
    pieces = [part if isinstance(part, str) else _part_text(run, part) for part in atom.parts]
    return None if None in pieces else "".join(piece for piece in pieces if piece is not None)


def settled_text(run: Machine, atom: Atom) -> str | None:
    """Return ``text_of`` if a launch has settled it; a parameter that only has its default is open."""
    if run.start is None:
        parts = atom.parts if isinstance(atom, Text) else ()
        if isinstance(atom, Param) or any(isinstance(part, ParameterPart) for part in parts):
            return None
    return text_of(run, atom)


def decided(run: Machine, value: Value) -> bool | None:
    """Return whether ``value`` is certainly true or false in this run."""
    return truth(settled(run, value))


def settled(run: Machine, value: Value) -> Value:
    """Return ``value`` with what a launch, else the default, gives a parameter; as it was if there is no launch."""
    if run.start is None or not any(isinstance(atom, Text | Param) for atom in value):
        return value
    return tuple(_settled(run, atom) for atom in value)


def _settled(run: Machine, atom: Atom) -> Atom:
    if isinstance(atom, Param):
        return _settled_parameter(run, atom)
    if not isinstance(atom, Text) or plain(atom) is not None:
        return atom
    known = text_of(run, atom)
    return atom if known is None else literal(known)[0]


def _settled_parameter(run: Machine, param: Param) -> Atom:
    """Return the value of a parameter that is declared once, by the first node, and that the program does not set."""
    record, name = param.record, param.name
    if record is not next(iter(run.nodes.values())) or record.arguments or name in record.overrides:
        return param
    declared = record.parameters.get(name)
    if declared is None or len(declared) > 1:
        return param
    value = given_by_launch(run, record, name)
    if value is not None and param.item is not None:
        value = value[param.item] if isinstance(value, list | tuple) and param.item < len(value) else None
    if isinstance(value, str):
        return literal(value)[0]
    if isinstance(value, bool | int | float):
        return value
    found = param.default if value is None else ()
    return (
        found[0]
        if len(found) == 1 and (plain(found[0]) is not None or isinstance(found[0], float))
        else param
    )


def given_by_launch(run: Machine, record: AllocatedNode, name: str) -> object | None:
    """Return what the launch file sets; a value that decides what is made is remembered."""
    if run.start is None:
        run.from_default[name] = None
        return None
    value = run.start.parameters(_static_name(record)).get(name)
    run.consulted[name] = value
    return value


def parameter_items(run: Machine, atom: Param) -> tuple[list[Value], bool]:
    """Return the elements of a list parameter, and whether these are all: of the launch, else the default."""
    given = given_by_launch(run, atom.record, atom.name) if run.start is not None else None
    if isinstance(given, list | tuple):
        return [(Param(atom.record, atom.name, i, literal(str(each))),) for i, each in enumerate(given)], True
    default = [each for each in atom.default if isinstance(each, Seq) and not each.open]
    if len(default) == 1 == len(atom.default):
        if run.start is None and any(plain(each) for item in default[0].items for each in item):
            run.from_default[atom.name] = None
        items = enumerate(default[0].items)
        if default[0].items or run.start is not None:
            return [(Param(atom.record, atom.name, index, item),) for index, item in items], True
    return [unknown(f"an element of parameter {atom.name}")], False


def _parameter_text(run: Machine, param: Param) -> str | None:
    value = given_by_launch(run, param.record, param.name)
    if value is not None and param.item is not None and isinstance(value, list | tuple):
        return str(value[param.item]) if param.item < len(value) else None
    if value is not None:
        return str(value)
    texts = [plain(each) for each in param.default]
    return texts[0] if len(texts) == 1 else None


def _part_text(run: Machine, part: object) -> str | None:
    if isinstance(part, ParameterPart):
        return _parameter_part(run, part)
    if not isinstance(part, NodeNamePart):
        return None
    if run.start is not None:
        name, namespace = run.start.final_name(_static_name(part.record))
        if namespace == "/" and _static_namespace(part.record) != "/":
            namespace = None  # whether the launch says so, or nothing
    else:
        run.from_default[f"the {part.what} of node {_static_name(part.record)}"] = None
        name, namespace = _static_name(part.record), _static_namespace(part.record)
    if name is None or namespace is None:
        return None
    return {"name": name, "ns": namespace}.get(part.what, f"{namespace.rstrip('/')}/{name}")


def _parameter_part(run: Machine, part: ParameterPart) -> str | None:
    found = [record for record in run.nodes.values() if part.name in record.parameters]
    if len(found) != 1:
        return None
    value = given_by_launch(run, found[0], part.name)
    texts = part.texts({} if value is None else {part.name: value})
    return texts[0] if len(texts) == 1 else None


def _static_name(record: AllocatedNode) -> str | None:
    names = [plain(each) for each in record.names]
    return names[0] if len(names) == 1 else None


def _static_namespace(record: AllocatedNode) -> str | None:
    spaces = [plain(each) for each in record.namespaces] or [""]
    return "/" + (spaces[0] or "").lstrip("/") if len(spaces) == 1 and spaces[0] is not None else None
