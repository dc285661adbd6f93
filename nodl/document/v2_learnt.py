"""The part of our section in a NoDL v2 document about names learnt from runs (written by recording).

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

from enclave_common.source_location import SourceLocation
from enclave_common.words import counted
from nodl.builtin_interfaces import LOGGER_SERVICES
from nodl.document.v2_section import section_of
from nodl.errors import InvalidElementError
from nodl.name_template import PARAMETER_REFERENCE, NameTemplate, ParameterPart, Part
from nodl.names import InvalidNameError, validate_name
from nodl.node_interface import Endpoint, EndpointKind
from nodl.yaml_text import YamlMap

ONE_RUN = "one run"
"""``proof`` of a name that had its parameter's value in the only run that gave it one."""


class LearntName(NamedTuple):
    """A learnt name. ``readings``: what the name may be as well; ``note``: how it was learnt, for the reader of a
    plan."""

    template: NameTemplate
    introspected: bool = False
    note: str = ""
    readings: tuple[NameTemplate, ...] = ()


def learnt_names(root: YamlMap) -> dict[tuple[str, str], LearntName]:
    """Return what was learnt, by list (``publishers``) and name of the entry; raises ``InvalidElementError``."""
    return {
        (row.text("in"), row.text("name")): LearntName(
            _template(row, row.source),
            row.scalar("introspection") is True,
            _note(row),
            tuple(_readings(row)),
        )
        for row in section_of(root).mappings("endpoints")
    }


def _note(row: YamlMap) -> str:
    runs, undecided = row.texts("runs"), row.texts("undecided")
    texts = [f"recorded in {counted(len(runs), 'run')}"] if runs else []
    if undecided:
        first = f"comes from {row.text('parameter')}" if "parameter" in row.items else "is fixed"
        texts.append(f"undecided whether it {first} or comes from {' or '.join(undecided)}")
    if "proof" in row.items:
        proof = row.text("proof")
        texts.append("from the parameter as far as one run shows" if proof == ONE_RUN else proof)
    return "; ".join(texts)


def logger_services(root: YamlMap) -> Iterator[Endpoint]:
    """Yield the services of a node that was made with ``enable_logger_service`` (rclcpp node_logging.cpp)."""
    section = section_of(root)
    if section.scalar("logger_services") is True:
        source = section.items["logger_services"].source
        for name, type_name in LOGGER_SERVICES.items():
            template = NameTemplate.literal(f"~/{name}")
            yield Endpoint(EndpointKind.SERVICE_SERVER, template, type_name, source)


def _template(row: YamlMap, place: SourceLocation) -> NameTemplate:
    parameter = row.text("parameter")
    if not parameter:
        return _fixed(row.text("written") or row.text("name"), place)
    item = "each" if row.scalar("each") is True else None
    default = row.text("default") if "default" in row.items else None
    part = ParameterPart(parameter, default, item)
    return NameTemplate((*filter(None, (row.text("prefix"),)), part, *_with_parameters(row.text("suffix"))))


def _with_parameters(text: str) -> Iterator[Part]:
    place = 0
    for reference in PARAMETER_REFERENCE.finditer(text):
        yield from filter(None, (text[place : reference.start()],))
        yield ParameterPart(reference[1], reference[2])
        place = reference.end()
    yield from filter(None, (text[place:],))


def _readings(row: YamlMap) -> Iterator[NameTemplate]:
    """Yield what else the recorded name may be: fixed, or the value of one of several parameters."""
    fixed = row.texts("readings")
    if row.text("parameter") and row.text("proof") == ONE_RUN:
        fixed = (row.text("written") or row.text("name"), *row.texts("seen"), *fixed)
    yield from (_fixed(name, row.source) for name in fixed)
    yield from (_template(each, row.source) for each in row.mappings("candidates"))


def _fixed(name: str, place: SourceLocation) -> NameTemplate:
    try:
        validate_name(name)
    except InvalidNameError as error:
        raise InvalidElementError.at(place, str(error)) from None
    return NameTemplate.literal(name)
