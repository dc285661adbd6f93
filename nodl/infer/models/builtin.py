"""Python's built-in functions: texts and numbers, and the table of all of them."""

from __future__ import annotations

from nodl.infer.interpreter import special
from nodl.infer.interpreter.conditions import truth
from nodl.infer.interpreter.formatting import as_texts, formatted, text_value
from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.iterate import keys_of
from nodl.infer.interpreter.run import Model, Run
from nodl.infer.models import iterables, reflection
from nodl.infer.values import ANY, BOOLEAN, NONE, Dictionary, Sequence, Unknown, Value, boolean, sole, unknown


def _str(run: Run, call: Call) -> Value:
    value = call.args.at(0)
    if value is None:
        return ("",)
    return text_value(as_texts(special.spoken(run, value, call.node, call.frame)))


def _int(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    if isinstance(atom, str | int | float):
        try:
            return (int(atom),)
        except (ValueError, OverflowError):
            return ANY
    return (atom,) if isinstance(atom, Unknown) else ANY


def _float(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    return (float(atom),) if isinstance(atom, int | float) else ANY


def _bool(run: Run, call: Call) -> Value:
    return boolean(truth(special.tested(run, call.args.at(0) or (False,), call.node, call.frame)))


def _len(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    own = special.call_special(run, atom, "__len__", call.node, call.frame)
    if own:
        return own
    if isinstance(atom, str):
        return (len(atom),)
    if isinstance(atom, Sequence) and atom.items.exact is not None and not atom.escaped:
        return (len(atom.items.exact),)
    if isinstance(atom, Dictionary):
        keys = keys_of(atom).exact
        return (len(keys),) if keys is not None else ANY
    return ANY


def _format(run: Run, call: Call) -> Value:
    given = call.args.at(1) or ("",)
    spec = sole(given)
    value = special.spoken(run, call.args.at(0) or ANY, call.node, call.frame, given)
    return text_value(formatted(value, spec if isinstance(spec, str) else None))


def _repr(run: Run, call: Call) -> Value:
    atom = sole(call.args.at(0))
    own = special.call_special(run, atom, "__repr__", call.node, call.frame)
    if own:
        return own
    return (repr(atom),) if isinstance(atom, str | int | float) else unknown("repr()")


FUNCTIONS: dict[str, Model] = {
    f"builtins.{name}": model
    for name, model in {
        "str": _str,
        "int": _int,
        "float": _float,
        "bool": _bool,
        "len": _len,
        "range": iterables.call_range,
        "list": iterables.made_sequence("list"),
        "tuple": iterables.made_sequence("tuple"),
        "set": iterables.call_set,
        "frozenset": iterables.call_set,
        "iter": lambda run, call: call.args.at(0) or ANY,  # walking along it gives the same
        "sorted": iterables.call_sorted,
        "reversed": iterables.call_reversed,
        "enumerate": iterables.call_enumerate,
        "zip": iterables.call_zip,
        "map": iterables.call_map,
        "filter": iterables.call_filter,
        "dict": iterables.call_dict,
        "getattr": reflection.call_getattr,
        "setattr": reflection.call_setattr,
        "hasattr": reflection.call_hasattr,
        "isinstance": reflection.call_isinstance,
        "type": reflection.call_type,
        "format": _format,
        "repr": _repr,
        **dict.fromkeys(("min", "max", "next"), iterables.chosen),
        **dict.fromkeys(("any", "all", "callable"), lambda run, call: BOOLEAN),
        **dict.fromkeys(("eval", "exec", "compile"), reflection.dynamic_code),
        "__import__": reflection.import_dynamic,
        "vars": reflection.call_vars,
        "globals": reflection.call_globals,
        "locals": reflection.call_locals,
        "input": lambda run, call: unknown("text that the user types"),
        "object": lambda run, call: ANY,
        "object.__new__": reflection.object_new,
        "object.__init_subclass__": lambda run, call: NONE,
        "property": reflection.call_property,
    }.items()
}
