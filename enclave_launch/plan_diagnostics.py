"""The diagnostics of a plan: problems, at which ``--secure`` stops and a dry run only warns, and notes."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence

from enclave_common.source_location import SourceLocation
from enclave_launch.admission.middleware import failing, mixed_pairs
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.enclaves import (
    command_needs_enclave,
    container_elsewhere,
    domains_shared,
    enclave_attribute_unused,
    enclave_shared_with_launcher,
    enclave_too_deep,
    enclave_ungranted,
    executable_without_enclave,
    handshake_fails,
    machine_elsewhere,
)
from enclave_launch.diagnostics.evaluation import (
    nodes_renamed_alike,
    parameter_type,
    parameters_opaque,
    parameters_unknown,
)
from enclave_launch.diagnostics.permissions import (
    configuration_unused,
    descriptions_differ,
    library_version,
    manifest_lacks,
    manifest_outdated,
    no_manifest,
    node_name_unknown,
    record_lacks,
    recording_incomplete,
)
from enclave_launch.plan import (
    Described,
    InterfaceOrigin,
    Missing,
    Named,
    PlannedComponent,
    PlannedProcess,
    enclave_domains,
    enclave_processes,
    nodes_of,
)
from enclave_launch.policy import DerivedPolicy, RunningNode
from enclave_launch.policy.command_nodes import commands_of
from enclave_launch.ros_rules.parameter_value import type_name
from enclave_launch.ros_rules.ros2_command import instead_of
from keystore.formats.subject import common_name


def problems(
    processes: Sequence[PlannedProcess], components: Sequence[PlannedComponent]
) -> Iterator[Diagnostic]:
    """Report what ``--secure`` stops at, of each process and then of each component."""
    for item in processes:
        name, place = item.process.process_name, item.location
        if item.missing:
            yield _missing(item.missing, place)
        yield from item.refusals
        if item.enclave and item.enclave.too_deep:
            yield enclave_too_deep(name, item.enclave.too_deep, place)
        if command := _ros2_command(item):
            yield command_needs_enclave(name, shlex.join(command), instead_of(command), place)
        for path, why in item.process.unread_parameter_files:
            yield parameters_unknown(name, path, why, place)
        for unknown in item.process.unknown_parameters:
            yield parameters_opaque(name, unknown.value, unknown.module, place)
    for component in components:
        if component.missing:
            yield _missing(component.missing, component.location)
        for unknown in component.component.unknown_parameters:
            yield parameters_opaque(component.fqn, unknown.value, unknown.module, component.location)


def _ros2_command(item: PlannedProcess) -> tuple[str, ...] | None:
    commands = commands_of(item.process) if item.enclave is None else ()
    return commands[0] if commands else None


def _missing(missing: Missing, place: SourceLocation) -> Diagnostic:
    if missing.unnamed:
        return node_name_unknown(missing.subject, missing.why, place)
    return no_manifest(missing.subject, missing.why, place, not_made=missing.not_made)


def notes(
    processes: Sequence[PlannedProcess], components: Sequence[PlannedComponent], launcher: RunningNode | None
) -> Iterator[Diagnostic]:
    """Report what matters about single processes and components."""
    for item in processes:
        process = item.process
        if item.enclave is None and process.kind == "executable" and not _ros2_command(item):
            yield executable_without_enclave(process.process_name, process.location)
        if process.machine:
            yield machine_elsewhere(process.process_name, process.machine, process.location)
    for component in components:
        if component.container is None:
            target = component.component.container
            yield container_elsewhere(component.fqn, target, _alike(target, processes), component.location)
    started: list[PlannedProcess | PlannedComponent] = [*processes, *components]
    yield from (library_version(each.program, each.doubt, each.location) for each in started if each.doubt)
    yield from (note for each in started for note in _renamed_alike(each))
    yield from (note for each in started for node in each.nodes for note in _mistyped(node, each.location))
    yield from _differences(started)
    yield from _incomplete(nodes_of(processes, components, None))
    for item in processes:
        process, attribute = item.process, item.process.enclave.attribute
        if item.enclave and process.enclave.argument is not None and attribute is not None:
            path, place = item.enclave.path, process.location
            yield enclave_attribute_unused(process.process_name, path, attribute, place)
    if launcher and any(item.enclave and item.enclave.path == launcher.enclave for item in processes):
        yield enclave_shared_with_launcher(launcher.enclave)


def _mistyped(node: RunningNode, place: SourceLocation) -> Iterator[Diagnostic]:
    for name, declared in node.interface.parameter_types:
        given = type_name(node.parameters[name]) if name in node.parameters else declared
        if given not in (declared, "array"):
            yield parameter_type(node.fqn, name, declared, given, place)


def _renamed_alike(item: PlannedProcess | PlannedComponent) -> Iterator[Diagnostic]:
    originals: dict[str, list[str]] = {}
    for node in item.nodes:
        originals.setdefault(node.fqn, []).append(node.original_name)
    for name, several in originals.items():
        if len(set(several)) > 1:
            yield nodes_renamed_alike(item.program, name, several, item.location)


def _differences(started: Iterable[PlannedProcess | PlannedComponent]) -> Iterator[Diagnostic]:
    """Report where the descriptions of a program differ; each program once, where it is started first."""
    differing: dict[str, PlannedProcess | PlannedComponent] = {}
    for item in started:
        if item.descriptions:
            differing.setdefault(item.program, item)
    for program, item in differing.items():
        yield from _difference(program, item)


def _difference(program: str, item: PlannedProcess | PlannedComponent) -> Iterator[Diagnostic]:
    first = item.descriptions[0]
    granted = {named for each in item.descriptions if each.used for named in each.names}
    others = [each for each in item.descriptions[1:] if not each.found.doubt]
    beyond = {named: place for each in others for named, place in each.names.items() if named not in granted}
    if first.found.origin in (InterfaceOrigin.RECORDED, InterfaceOrigin.PACKAGE, InterfaceOrigin.NAMED):
        unknown = [text for each in others if not each.used for text in each.open]
        if first.found.outdated:
            vanished = (
                {}
                if unknown
                else {each: first.names[each] for each in first.names if not _is_in(each, others)}
            )
            if beyond or vanished or unknown:
                said = _places(beyond), _places(vanished), unknown
                yield manifest_outdated(program, first.found.source, *said, item.location)
        elif first.found.origin is not InterfaceOrigin.RECORDED and first.used and beyond:
            yield manifest_lacks(program, first.found.source, _places(beyond), item.location)
        elif first.found.origin is InterfaceOrigin.RECORDED and first.used and (beyond or unknown):
            yield record_lacks(program, first.found.source, _places(beyond), unknown, item.location)
        return
    library = item.descriptions[-1]
    if library.found.doubt or not (first.used and library.complete):
        return
    apart = {named: place for named, place in first.names.items() if named not in library.names}
    if first.complete:
        apart |= {named: place for named, place in library.names.items() if named not in first.names}
    if apart:
        yield descriptions_differ(program, library.found.source, _places(apart), item.location)


def _is_in(named: Named, descriptions: Iterable[Described]) -> bool:
    return any(named in each.names for each in descriptions)


def _places(names: Mapping[Named, str]) -> list[str]:
    return [f"{operation.verb} {name} ({place})" for (operation, name), place in sorted(names.items())]


def _incomplete(nodes: Iterable[RunningNode]) -> Iterator[Diagnostic]:
    for node in nodes:
        for why in node.interface.incomplete:
            yield recording_incomplete(node.fqn, why, str(node.interface.source), node.location)
        for why in node.interface.unused_configuration:
            yield configuration_unused(node.fqn, why, node.location)


def _alike(container: str, processes: Iterable[PlannedProcess]) -> tuple[str, ...]:
    last = "/" + container.rpartition("/")[2]
    return tuple(
        dict.fromkeys(node.fqn for planned in processes for node in planned.nodes if node.fqn.endswith(last))
    )


def shared_domains(processes: Iterable[PlannedProcess]) -> Iterator[Diagnostic]:
    """Warn about enclaves whose processes are in several domains: each of them may join all."""
    for enclave, by_domain in enclave_domains(processes).items():
        if len(by_domain) > 1:
            who = (
                f"{item.process.process_name} in {domain}"
                for domain, items in sorted(by_domain.items())
                for item in items
            )
            yield domains_shared(enclave, ", ".join(map(str, sorted(by_domain))), tuple(who))


def failing_handshakes(processes: Iterable[PlannedProcess]) -> Iterator[Diagnostic]:
    """Warn about enclaves on two DDS implementations that cannot authenticate each other under their subjects."""
    pairs = mixed_pairs(enclave_processes(processes))
    if not pairs:
        return

    subjects = {path: common_name(path) for pair in pairs for path in pair}
    for pair in failing(pairs, subjects):
        yield handshake_fails(*pair, planned=True)


def ungranted_enclaves(processes: Iterable[PlannedProcess], derived: DerivedPolicy) -> Iterator[Diagnostic]:
    """Warn about enclaves of executables that no policy file names: signed, they permit nothing at all."""
    empty = {enclave.path for enclave in derived.policy.enclaves if not enclave.profiles}
    members: dict[str, list[PlannedProcess]] = {}
    for item in processes:
        if item.enclave and item.enclave.path in empty and item.process.kind == "executable":
            members.setdefault(item.enclave.path, []).append(item)
    for path, items in members.items():
        names = tuple(item.process.process_name for item in items)
        yield enclave_ungranted(path, names, items[0].location)
