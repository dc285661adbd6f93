"""A ``LaunchPlan`` as JSON; the pydantic models of ``enclave_launch.dry_run`` say what each field means."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from enclave_common.terminal import json_text
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.plan import LaunchPlan, PlannedComponent, PlannedProcess
from enclave_launch.policy.derivation import LIST_NAMES, allowed_names
from enclave_launch.policy.node_permissions import Reason
from enclave_launch.process import Evaluation, LauncherCall, Reaction, RemapRule
from enclave_launch.report.unknown import label, unknown_by_enclave
from enclave_launch.ros_rules.distro import since_text
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.security_environment import SecuritySettings, secured_command, secured_environment
from keystore.formats.policy import Qualifier, Rule
from nodl.node_interface import NodeInterface

VERSION = 1


def plan_document(plan: LaunchPlan, security: SecuritySettings | None = None) -> dict[str, Any]:
    """Return the plan as plain values; ``security``: how ``--secure`` would start the processes."""
    return {
        "version": VERSION,
        "release": _release(plan.evaluation),
        "refused": bool(plan.problems),
        "processes": [_process(item, security) for item in plan.processes],
        "components": [_component(item) for item in plan.components],
        "enclaves": _enclaves(plan),
        "nodes": _nodes(plan),
        "reactions": [_reaction(item) for item in plan.evaluation.reactions],
        "launcher_calls": [_launcher_call(item) for item in plan.evaluation.launcher_calls],
        "warnings": [str(diagnostic) for diagnostic in (*plan.problems, *plan.warnings)],
        "diagnostics": [
            *(_diagnostic(problem, "error") for problem in plan.problems),
            *(_diagnostic(warning, "warning") for warning in plan.warnings),
        ],
    }


def _release(evaluation: Evaluation) -> dict[str, object]:
    release = evaluation.release
    return {
        "distro": release.distro.value,
        "versions": release.versions,
        "assumed": list(release.assumed),
        "hanging": [
            {"what": each.what, "package": each.package, "since": since_text(each, release)}
            for each in evaluation.uncertain
        ],
    }


def plan_json(plan: LaunchPlan, security: SecuritySettings | None = None) -> str:
    """Return ``plan_document`` as indented JSON, as ``--dry-run --format json`` writes it."""
    return json_text(plan_document(plan, security), indent=2)


def _process(item: PlannedProcess, security: SecuritySettings | None) -> dict[str, object]:
    process = item.process
    return {
        "package": process.package,
        "executable": process.executable,
        "process": process.process_name,
        "namespace": process.namespace,
        "name": item.name,
        "fqn": item.fqn,
        "cmd": list(secured_command(item, security)),
        "remaps": _remaps(process.remaps),
        "parameters": _parameters(item.nodes[0].parameters if item.nodes else process.parameters),
        "enclave": item.enclave.path if item.enclave else None,
        "interfaces": item.origin.value if item.origin else None,
        "prefix": list(process.prefix),
        "domain_id": item.domain,
        "middleware": item.middleware,
        "environment": {**process.environment, **secured_environment(item, security)},
        "launch_file": process.location.file,
        "line": process.location.line,
        "on_event": process.on_event,
        "kind": process.kind,
        "machine": process.machine,
        "cwd": process.cwd,
        "shell": process.shell,
        "respawn": process.respawn._asdict() if process.respawn else None,
        "parameter_files": {
            name: text for name, text in process.parameter_files.items() if name in process.cmd
        },
    }


def _component(item: PlannedComponent) -> dict[str, object]:
    component = item.component
    return {
        "container": component.container,
        "package": component.package,
        "plugin": component.plugin,
        "fqn": item.fqn,
        "remaps": _remaps(component.remaps),
        "parameters": _parameters(component.parameters),
        "enclave": item.enclave,
        "interfaces": item.origin.value if item.origin else None,
        "launch_file": component.location.file,
        "line": component.location.line,
        "on_event": component.on_event,
    }


def _reaction(item: Reaction) -> dict[str, object]:
    place = item.location
    return {"what": item.what, "launch_file": place.file, "line": place.line, "ends_with": item.ends_with}


def _launcher_call(item: LauncherCall) -> dict[str, object]:
    return {"service": item.service, "launch_file": item.location.file, "line": item.location.line}


def _diagnostic(diagnostic: Diagnostic, severity: str) -> dict[str, object]:
    place = diagnostic.location
    return {
        "severity": severity,
        "code": diagnostic.code.value,
        "subject": diagnostic.subject,
        "file": place.file if place else None,
        "line": place.line if place else 0,
        "text": diagnostic.text,
        "remedy": diagnostic.remedy,
    }


def _enclaves(plan: LaunchPlan) -> dict[str, dict[str, list[str]]]:
    nodes: dict[str, list[str]] = {}
    for node in plan.nodes:
        nodes.setdefault(node.enclave, []).append(node.fqn)
    unknown = unknown_by_enclave(plan)
    return {
        enclave.path: {
            "nodes": sorted(set(nodes.get(enclave.path, []))),
            "permissions_unknown": [label(item) for item in unknown.get(enclave.path, ())],
            **allowed_names(enclave),
        }
        for enclave in plan.derived.policy.enclaves
    }


def _nodes(plan: LaunchPlan) -> list[dict[str, object]]:
    """List every node, sorted by name, with the interfaces it needs and those that every node has."""
    interfaces = {(node.enclave, node.fqn): node.interface for node in plan.nodes}
    found: dict[tuple[str, str], list[dict[str, object]]] = {key: [] for key in interfaces}
    for enclave, reasons in plan.derived.reasons.items():
        for rule, why in reasons.items():
            for reason in why:
                if rule.qualifier is Qualifier.ALLOW and (enclave, reason.node) in found:
                    found[enclave, reason.node].append(_interface(rule, reason))
    return [
        {
            "fqn": fqn,
            "enclave": enclave,
            "program": _program(interfaces[enclave, fqn]),
            "parameters": _declared(interfaces[enclave, fqn]),
            "interfaces": _once(uses),
        }
        for (enclave, fqn), uses in sorted(found.items(), key=lambda item: (item[0][1], item[0][0]))
    ]


def _once(uses: list[dict[str, object]]) -> list[dict[str, object]]:
    """Leave out of several entries for one name those that say no more: no type, or a type that another one has."""
    found: dict[tuple[object, object], list[dict[str, object]]] = {}
    for use in uses:
        same = found.setdefault((use["operation"], use["name"]), [])
        types = [each["type"] for each in same]
        if not use["type"] and same:
            continue
        if use["built_in"] and use["type"] in types:
            continue
        same[:] = [
            each for each in same if each["type"] and not (each["built_in"] and each["type"] == use["type"])
        ]
        same.append(use)
    return [use for same in found.values() for use in same]


def _program(interface: NodeInterface) -> str:
    return f"{interface.package}/{interface.executable or interface.plugin}"


def _declared(interface: NodeInterface) -> list[str] | None:
    return sorted(interface.parameters) if interface.parameters_complete and not interface.gaps else None


def _interface(rule: Rule, reason: Reason) -> dict[str, object]:
    return {
        "operation": LIST_NAMES[rule.operation],
        "name": rule.expression,
        "type": reason.type,
        "built_in": reason.origin == "built-in",
        "place": reason.place,
        "written": reason.written,
        "remapped_by": [
            f"{each.text} at {each.origin}" if each.origin else each.text for each in reason.rules
        ],
        "note": reason.note,
        "qos": dict(reason.qos),
    }


def _remaps(rules: Iterable[RemapRule]) -> list[list[str]]:
    return [[rule.source, rule.target] for rule in rules]


def _parameters(parameters: Mapping[str, ParameterValue]) -> dict[str, object]:
    return {name: _plain(value) for name, value in parameters.items()}


def _plain(value: ParameterValue) -> object:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value.hex() if isinstance(value, bytes) else value
