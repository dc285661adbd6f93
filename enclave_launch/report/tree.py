"""The plan as a tree for people: enclaves, the processes in each, and what each enclave may do."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from enclave_common.source_location import SourceLocation
from enclave_common.words import counted
from enclave_launch.plan import InterfaceOrigin, LaunchPlan, PlannedComponent, PlannedProcess
from enclave_launch.policy.derivation import LIST_NAMES, allowed_names
from enclave_launch.policy.sharing import Gain, gains_by_sharing
from enclave_launch.report.terminal_style import TerminalStyle
from enclave_launch.report.unknown import UNKNOWN, label, shown_fqn, unknown_by_enclave
from enclave_launch.ros_rules.distro import since_text
from keystore.formats.policy import EnclavePolicy

_LABELS: dict[str, str] = {listed: operation.verb for operation, listed in LIST_NAMES.items()}


class Branch(NamedTuple):
    """A line of a tree with the lines below it. ``names``: the text is a list of names, which may be folded."""

    text: str
    below: Sequence[Branch] = ()
    names: bool = False


def plan_tree(plan: LaunchPlan, style: TerminalStyle | None = None) -> str:
    """Format the plan as a tree; interfaces that every node has are counted, not listed."""
    style = style or TerminalStyle()
    lines = style.wrapped(style.one_line(f"{plan.launch_file} (as {as_evaluated(plan)})"), "", "    ")
    gains = gains_by_sharing(plan.derived, composed_only=True)
    lines += _draw([_enclave(plan, enclave, gains) for enclave in plan.derived.policy.enclaves], style)
    outside = _outside(plan)
    if outside:
        lines += ["without an enclave", *_draw(outside, style)]
    lines += style.listed("error under --secure", plan.problems)
    lines += style.listed("warning", plan.warnings)
    if plan.problems:
        text = f"a secured start would be refused: {counted(len(plan.problems), 'error')}. "
        lines += style.wrapped(f"{text}A dry run ends with status 0, with --strict with 1.", "", "    ")
    return "\n".join(lines) + "\n"


def as_evaluated(plan: LaunchPlan) -> str:
    """Return whose rules were followed, and what in this launch file hangs on versions that are assumed."""
    release = plan.evaluation.release
    hanging = [
        f"{each.what} (since {each.package} {since_text(each, release)})"
        for each in plan.evaluation.uncertain
    ]
    return "; ".join([str(release), *([f"hanging on them: {', '.join(hanging)}"] if hanging else [])])


def _enclave(plan: LaunchPlan, enclave: EnclavePolicy, gains: Sequence[Gain]) -> Branch:
    processes = [item for item in plan.processes if item.enclave and item.enclave.path == enclave.path]
    branches: list[Branch] = [_process(item, plan) for item in processes]
    if plan.launcher and plan.launcher.enclave == enclave.path:
        branches.append(Branch(f"the launcher itself, node {plan.launcher.fqn}"))
    branches.extend(_permissions(plan, enclave))
    if unknown := unknown_by_enclave(plan).get(enclave.path):
        branches.append(Branch(f"{UNKNOWN} of {' '.join(map(label, unknown))}"))
    branches.extend(Branch(str(gain), names=True) for gain in gains if gain.enclave == enclave.path)
    merged = f"  (shared by {len(processes)} processes)" if len(processes) > 1 else ""
    return Branch(f"enclave {enclave.path}{merged}", branches)


def _process(item: PlannedProcess, plan: LaunchPlan) -> Branch:
    process = item.process
    what = item.program
    names = shown_fqn(item)
    event = f", {process.on_event}" if process.on_event else ""
    why = f", {item.enclave.reason.value}" if item.enclave else ""
    source = f", {origin_text(item)}" if _is_worth_a_word(item) else ""
    place = _place(process.location, plan.launch_file)
    also = _behind(process.prefix)
    also += f", domain {item.domain}" if item.domain else ""
    also += f": {UNKNOWN}" if item.missing else ""
    head = f"[{process.process_name}] {what}{f' as {names}' if names else ''}  ({place}{why}{source}{also}{event})"
    loaded = [Branch(_component(component)) for component in plan.components if component.container is item]
    return Branch(head, loaded)


def _behind(prefix: Sequence[str]) -> str:
    if not prefix:
        return ""

    return f", behind {shlex.join(prefix)}"


def _place(location: SourceLocation, launch_file: str) -> str:
    """Return the place in the launch file; another file is named as in its package or beside the launch file."""
    if location.file == launch_file:
        return f"line {location.line}"
    folder = os.path.join(os.path.dirname(launch_file), "")
    _, share, in_package = str(location).rpartition("/share/")
    return in_package if share else str(location).removeprefix(folder)


def _component(item: PlannedComponent) -> str:
    origin = UNKNOWN if item.missing else origin_text(item) if _is_worth_a_word(item) else ""
    component = f"component {item.component.package} {item.component.plugin} as {item.fqn}"
    return f"{component}  ({origin})" if origin else component


def _is_worth_a_word(item: PlannedProcess | PlannedComponent) -> bool:
    """Return False if the interfaces come from the package's own manifest, as one expects."""
    return item.origin not in (None, InterfaceOrigin.PACKAGE)


def origin_text(item: PlannedProcess | PlannedComponent) -> str:
    """Return the origin of the item's interfaces, with the document of the library."""
    if item.origin is InterfaceOrigin.LIBRARY and item.nodes:
        file = item.nodes[0].interface.source.file
        return f"library {'/'.join(file.split('/')[-2:]).removesuffix('.nodl.yaml')}"
    if item.origin is InterfaceOrigin.POLICY:
        return "from policy"
    if item.origin is InterfaceOrigin.ANALYSIS:
        return "inferred from its source"
    if item.origin is InterfaceOrigin.RECORDED and item.nodes:
        runs = max(node.interface.runs for node in item.nodes)
        return f"recorded in {counted(runs, 'run')}" if runs else str(item.origin)
    return str(item.origin)


def _permissions(plan: LaunchPlan, enclave: EnclavePolicy) -> Iterator[Branch]:
    built_in = plan.derived.built_in_names(enclave.path)
    hidden = 0
    for key, names in allowed_names(enclave).items():
        shown = [name for name in names if (key, name) not in built_in]
        hidden += len(names) - len(shown)
        if shown:
            yield Branch(f"{_LABELS[key]}: {' '.join(shown)}", names=True)
    if hidden:
        yield Branch(f"and {hidden} that every node has (see --format json or --explain {enclave.path})")


def _outside(plan: LaunchPlan) -> list[Branch]:
    without = [_process(item, plan) for item in plan.processes if item.enclave is None]
    without += [
        Branch(f"{_component(item)} in {item.component.container}")
        for item in plan.components
        if item.container is None
    ]
    return without


def _draw(branches: Sequence[Branch], style: TerminalStyle, indent: str = "") -> list[str]:
    lines: list[str] = []
    for index, branch in enumerate(branches):
        last = index == len(branches) - 1
        below = indent + ("    " if last else "│   ")
        head, further = (
            f"{indent}{'└── ' if last else '├── '}",
            f"{below}{'│   ' if branch.below else '    '}",
        )
        lines += style.wrapped(style.one_line(branch.text), head, further, fold=branch.names)
        lines += _draw(branch.below, style, below)
    return lines
