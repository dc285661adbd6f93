"""Every node's resolved parameters as one parameter file (wished for in ros2/launch_ros issue 549)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import yaml

from enclave_common.terminal import printable_lines
from enclave_launch.plan import LaunchPlan
from enclave_launch.ros_rules.parameter_value import ParameterValue


def params_yaml(plan: LaunchPlan) -> str:
    """Render YAML that ``--params-file`` accepts: one section per node that has parameters, by final name if known."""
    sections: dict[str, dict[str, dict[str, object]]] = {}
    for name, parameters in _named(plan):
        if parameters:
            section = sections.setdefault(name, {"ros__parameters": {}})
            section["ros__parameters"].update({key: _plain(value) for key, value in parameters.items()})
    if not sections:
        return ""
    text = yaml.safe_dump(sections, sort_keys=True, allow_unicode=True)
    readable = printable_lines(text) == text
    return text if readable else yaml.safe_dump(sections, sort_keys=True)  # with YAML's own escapes


def _named(plan: LaunchPlan) -> Iterator[tuple[str, Mapping[str, ParameterValue]]]:
    for process in plan.processes:
        if process.process.kind != "executable":
            if not process.nodes:
                yield process.fqn or "/**", process.process.parameters
            yield from ((node.fqn, node.parameters) for node in process.nodes)
    for component in plan.components:
        if not component.nodes:
            yield component.fqn, component.component.parameters
        yield from ((node.fqn, node.parameters) for node in component.nodes)


def _plain(value: ParameterValue) -> object:
    return [_plain(item) for item in value] if isinstance(value, tuple) else value
