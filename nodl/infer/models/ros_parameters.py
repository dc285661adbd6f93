"""Parameters of a node: declared, read and set by the program."""

from __future__ import annotations

from collections.abc import Callable

from nodl.infer.findings import NodeRecord
from nodl.infer.interpreter.conditions import only_if, truth
from nodl.infer.interpreter.elements import elements
from nodl.infer.interpreter.run import Call, Run
from nodl.infer.text import Guard, Input, Text, is_of_inputs, make_text, with_edit
from nodl.infer.values import (
    ABSENT,
    ANY,
    BOTTOM,
    NONE,
    OTHER,
    OTHER_KEYS,
    Dictionary,
    External,
    Instance,
    Items,
    Key,
    Unknown,
    Value,
    constant_strings,
    join,
    join_all,
    present,
    unknown,
)
from nodl.name_template import ONLY_IF_UNSET

PARAMETER_CLASS = "rclpy.parameter.Parameter"


def parameter_object(
    run: Run, call: Call, name: Value, value: Value, key: str = "parameter"
) -> tuple[Instance]:
    """Return an rclpy ``Parameter`` that holds ``value``; ``key`` tells those made by one call apart."""
    instance = run.library_object(call, PARAMETER_CLASS, key)
    run.state.store(instance, "name", name)
    run.state.store(instance, "value", value)
    return (instance,)


def _names(call: Call) -> list[str]:
    return constant_strings(call.args.at(0, "name") or ANY)


def _declare_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    names = _names(call)
    default = _default_value(call.args.at(1, "value"))
    ignored = truth(call.args.at(3, "ignore_override") or (False,))
    for name in names:
        record.declare(name, default)
        if ignored is not False:  # what launch says does not count, or perhaps not
            record.assigned[name] = default
            run.state.write(record.cells, name, join(default or NONE, BOTTOM if ignored else ABSENT))
    return parameter_object(run, call, call.args.at(0, "name") or ANY, _inputs(run, record, names))


def _default_value(default: Value | None) -> Value:
    """Return a declared default; a parameter type or ``None`` declares none."""
    if default is None or all(atom is None or isinstance(atom, External) for atom in default):
        return BOTTOM
    return tuple(atom for atom in default if atom is not None)


def _inputs(run: Run, record: NodeRecord, names: list[str]) -> Value:
    """Return the values of parameters: what the program set them to, else what launch and the defaults say."""
    if not names:
        return unknown("a parameter whose name is not known")
    result: Value = BOTTOM
    for name in names:
        held = record.cells.get(name, ABSENT)
        result = join(result, present(held))
        if ABSENT[0] in held:
            asked, declared = Input(name, record), record.default(name)
            unset = Guard(asked, *ONLY_IF_UNSET)
            others = [
                only_if(unset, each) for each in declared if isinstance(each, Text) and is_of_inputs(each)
            ]
            only_set = others or (run.without_value and not declared)
            text = with_edit(asked, "only if set", ()) if only_set else make_text((asked,))
            result = join(result, (text, *others))
    return result


def _declare_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    prefixes = constant_strings(call.args.at(0, "namespace") or ANY) or [""]
    listed = call.args.at(1, "parameters") or ANY
    found: Value = BOTTOM
    for entry in _each(run, listed, call):
        parts = elements(run, entry, call.node, call.frame)
        if parts.exact is None or not parts.exact:
            run.findings.gap(call.source, "the list of declared parameters is not known")
            continue
        default = parts.exact[1] if len(parts.exact) > 1 else None
        for name in constant_strings(parts.exact[0]):
            for prefix in prefixes:
                full = f"{prefix}.{name}" if prefix else name
                record.declare(full, _default_value(default))
                value = _inputs(run, record, [full])
                found = join(found, parameter_object(run, call, (full,), value, full))
    return run.sequence(call.node, "list", Items(None, found or ANY))


def _each(run: Run, value: Value, call: Call) -> list[Value]:
    items = elements(run, value, call.node, call.frame)
    return list(items.exact) if items.exact is not None else [items.any_element()]


def _get_parameter(run: Run, record: NodeRecord, call: Call) -> Value:
    return parameter_object(run, call, call.args.at(0, "name") or ANY, _inputs(run, record, _names(call)))


def _get_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    names = elements(run, call.args.at(0, "names") or ANY, call.node, call.frame).exact
    if names is None:
        return ANY
    found = (
        parameter_object(run, call, each, _inputs(run, record, constant_strings(each)), f"parameter {index}")
        for index, each in enumerate(names)
    )
    return run.sequence(call.node, "list", Items(tuple(found)))


def _get_parameters_by_prefix(run: Run, record: NodeRecord, call: Call) -> Value:
    """Return a dictionary of the parameters below a prefix, under the rest of their names."""
    found = run.allocate(call.node, "by prefix", Dictionary)
    for prefix in constant_strings(call.args.at(0, "prefix") or ANY):
        start = f"{prefix}." if prefix else ""
        everything = Input(f"{start}**", record)
        value = parameter_object(run, call, ANY, (make_text((everything,)),), f"below {prefix}")
        keys: Value = (with_edit(everything, "key", (start,)),)
        run.state.store(found, OTHER, join(found.cells.get(OTHER, BOTTOM), value))
        run.state.store(found, OTHER_KEYS, join(found.cells.get(OTHER_KEYS, BOTTOM), keys))
        for name in record.parameters:
            if name.startswith(start):
                held = parameter_object(run, call, (name,), _inputs(run, record, [name]), name)
                run.state.store(found, Key(name.removeprefix(start)), held)
    return (found,) if OTHER in found.cells else unknown("parameters below a prefix that is not known")


def _get_parameter_or(run: Run, record: NodeRecord, call: Call) -> Value:
    names = _names(call)
    others = (a for a in call.args.at(1, "alternative_value") or BOTTOM if isinstance(a, Instance))
    default = join_all(present(other.cells.get("value", BOTTOM)) for other in others)
    for name in names:
        record.declare(name, _default_value(default or None))
    return parameter_object(run, call, call.args.at(0, "name") or ANY, _inputs(run, record, names))


def _set_parameters(run: Run, record: NodeRecord, call: Call) -> Value:
    assign_parameters(run, record, call.args.at(0, "parameter_list") or ANY, call)
    return ANY


def assign_parameters(run: Run, record: NodeRecord, listed: Value, call: Call) -> None:
    """Set the node's parameters to what the ``Parameter`` objects hold; unknown entries become a gap."""
    lists = tuple(atom for atom in listed if atom is not None)
    for entry in _each(run, lists, call) if lists else ():
        for atom in entry:
            if isinstance(atom, Instance):
                for name in constant_strings(atom.cells.get("name", BOTTOM)):
                    value = present(atom.cells.get("value", ANY))
                    record.assigned[name] = join(record.assigned.get(name, BOTTOM), value)
                    run.state.write(record.cells, name, value)
            elif isinstance(atom, Unknown):
                run.findings.gap(call.source, f"parameters set in code are not known: {atom.why}")


METHODS: dict[str, Callable[[Run, NodeRecord, Call], Value]] = {
    "declare_parameter": _declare_parameter,
    "declare_parameters": _declare_parameters,
    "get_parameter": _get_parameter,
    "get_parameters": _get_parameters,
    "get_parameter_or": _get_parameter_or,
    "get_parameters_by_prefix": _get_parameters_by_prefix,
    "set_parameters": _set_parameters,
    "set_parameters_atomically": _set_parameters,
}
