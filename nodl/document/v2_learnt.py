"""What our section of a NoDL v2 document says of names that were learnt from runs (written by ``nodl.record``).

    codegen:
      enclave_launch:
        logger_services: true
        endpoints:
          - {in: subscriptions, name: front, parameter: scan_topic, default: scan, proof: one run, runs: [a]}

``name`` is that of the standard entry, the name that was seen. ``parameter`` gives the node's parameter (or ``<1>``,
a word of its command line, or ``--option``) whose value the name is, ``each`` says that it is a list, ``prefix`` and
``suffix`` what the program puts before and after the value (there ``$(param NAME)`` is the value of another one),
``default`` the value where nothing is set. ``written`` is the source's name where NoDL v2 cannot hold it,
``introspection`` says that the calls of a service are published. ``undecided`` and ``runs`` are for the reader: plans
show them.

A coincidence of values is not a rule: with ``proof: one run`` the name may as well be fixed, and ``seen`` lists further
names that came from the same parameter. Where several parameters had the value, ``candidates`` lists them beside the
fixed name; ``readings`` are what the source may write as well for a name that begins with the node's name or namespace.
Until another run decides all hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from enclave_common.words import counted
from nodl.builtin_interfaces import LOGGER_SERVICES
from nodl.document.v2_section import section_of
from nodl.errors import InvalidElementError
from nodl.name_template import PARAMETER_REFERENCE, NameTemplate, ParameterPart, Part
from nodl.names import InvalidNameError, validate_name
from nodl.node_interface import Endpoint, EndpointKind
from nodl.yaml_text import YamlList, YamlMap, YamlScalar, YamlValue

ONE_RUN = "one run"
"""``proof`` of a name that had its parameter's value in the only run that gave it one."""

_Fields = dict[str, "str | int | float | bool | None"]


class LearntName(NamedTuple):
    """A learnt name. ``readings``: what the name may be as well; ``note``: how it was learnt, for the reader of a
    plan."""

    template: NameTemplate
    introspected: bool = False
    note: str = ""
    readings: tuple[NameTemplate, ...] = ()


class LearntFrom(NamedTuple):
    """The runs behind a learnt manifest. ``runs``: how many; ``incomplete``: why they may not have shown everything."""

    runs: int = 0
    incomplete: tuple[str, ...] = ()


def learnt_from(root: YamlMap) -> LearntFrom:
    """Return what the document says of the runs that taught it; nothing, if a person wrote it."""
    section = _section(root)
    runs = section.get("runs")
    return LearntFrom(len(runs.items) if isinstance(runs, YamlList) else 0, _texts(section.get("incomplete")))


def learnt_names(root: YamlMap) -> dict[tuple[str, str], LearntName]:
    """Return what was learnt, by list (``publishers``) and name of the entry; raises ``InvalidElementError``."""
    rows = _section(root).get("endpoints")
    found: dict[tuple[str, str], LearntName] = {}
    for row in rows.items if isinstance(rows, YamlList) else ():
        if isinstance(row, YamlMap):
            fields = _scalars(row)
            found[str(fields["in"]), str(fields["name"])] = LearntName(
                _template(fields, row),
                fields.get("introspection") is True,
                _note(row),
                tuple(_readings(fields, row)),
            )
    return found


def _note(row: YamlMap) -> str:
    runs, undecided = _texts(row.items.get("runs")), _texts(row.items.get("undecided"))
    proof = row.items.get("proof")
    texts = [f"recorded in {counted(len(runs), 'run')}"] if runs else []
    if undecided:
        parameter = row.items.get("parameter")
        first = f"comes from {parameter.value}" if isinstance(parameter, YamlScalar) else "is fixed"
        texts.append(f"undecided whether it {first} or comes from {' or '.join(undecided)}")
    if isinstance(proof, YamlScalar):
        source_is_known = proof.value != ONE_RUN
        texts.append(str(proof.value) if source_is_known else "from the parameter as far as one run shows")
    return "; ".join(texts)


def _texts(value: YamlValue | None) -> tuple[str, ...]:
    items = value.items if isinstance(value, YamlList) else ()
    return tuple(str(item.value) for item in items if isinstance(item, YamlScalar))


def logger_services(root: YamlMap) -> Iterator[Endpoint]:
    """Yield the services of a node that was made with ``enable_logger_service`` (rclcpp node_logging.cpp)."""
    given = _section(root).get("logger_services")
    if isinstance(given, YamlScalar) and given.value is True:
        for name, type_name in LOGGER_SERVICES.items():
            template = NameTemplate.literal(f"~/{name}")
            yield Endpoint(EndpointKind.SERVICE_SERVER, template, type_name, given.source)


def _section(root: YamlMap) -> dict[str, YamlValue]:
    section = section_of(root)
    return section.items if section else {}


def _template(fields: _Fields, row: YamlMap) -> NameTemplate:
    parameter, default = fields.get("parameter"), fields.get("default")
    if parameter:
        item = "each" if fields.get("each") is True else None
        given = str(default) if default is not None else None
        part = ParameterPart(str(parameter), given, item)
        prefix, suffix = str(fields.get("prefix") or ""), str(fields.get("suffix") or "")
        return NameTemplate((*filter(None, (prefix,)), part, *_with_parameters(suffix)))
    return _fixed(str(fields.get("written") or fields["name"]), row)


def _with_parameters(text: str) -> Iterator[Part]:
    place = 0
    for reference in PARAMETER_REFERENCE.finditer(text):
        yield from filter(None, (text[place : reference.start()],))
        yield ParameterPart(reference[1], reference[2])
        place = reference.end()
    yield from filter(None, (text[place:],))


def _readings(fields: _Fields, row: YamlMap) -> Iterator[NameTemplate]:
    """Yield what else the recorded name may be: fixed, or the value of one of several parameters."""
    if fields.get("parameter") and fields.get("proof") == ONE_RUN:
        yield _fixed(str(fields.get("written") or fields["name"]), row)
        for name in _texts(row.items.get("seen")):
            yield _fixed(name, row)
    for name in _texts(row.items.get("readings")):
        yield _fixed(name, row)
    candidates = row.items.get("candidates")
    for each in candidates.items if isinstance(candidates, YamlList) else ():
        if isinstance(each, YamlMap):
            yield _template(_scalars(each), row)


def _scalars(row: YamlMap) -> _Fields:
    return {key: value.value for key, value in row.items.items() if isinstance(value, YamlScalar)}


def _fixed(name: str, row: YamlMap) -> NameTemplate:
    try:
        validate_name(name)
    except InvalidNameError as error:
        raise InvalidElementError.at(row.source, str(error)) from None
    return NameTemplate.literal(name)
