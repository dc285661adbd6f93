"""``secure-launch``: arguments, the calls of ``flow``, an exit status."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from enclave_common.command_line import (
    CommandLine,
    complete,
    guarded,
    read_command_line,
)
from enclave_common.project import ProjectError, described, find_project, with_project
from enclave_common.terminal import (
    print_notes,
    printable,
    printable_lines,
    safe_output,
    short_paths,
    stdout_is_for_the_plan,
    warn,
)
from enclave_common.words import did_you_mean
from enclave_launch.description.actions.arguments import DeclareLaunchArgument
from enclave_launch.description.introspection import LaunchIntrospector
from enclave_launch.description.launch_description import LaunchDescription
from enclave_launch.description.parameters.yaml_text import dump_for_rcl
from enclave_launch.errors import EnclaveLaunchError, ManifestError, UsageError
from enclave_launch.evaluation.evaluate import read_description
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.plan import LaunchPlan
from enclave_launch.prefixes import ament_prefixes
from enclave_launch.report.explained import explainable, explained
from enclave_launch.report.plan_json import plan_json
from enclave_launch.report.terminal_style import terminal_style_of
from enclave_launch.report.tree import plan_tree
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.security_environment import SecuritySettings
from enclave_launch.verb.modes import check_modes
from enclave_launch.verb.options import DEMO, build_parser, resolve_options
from enclave_launch.verb.planning import planned
from enclave_launch.verb.target import LaunchTarget, find_target, launch_folder
from enclave_launch.verb.usage import (
    FOR_PLAN,
    FOR_SECURE,
    check_needs_secure,
    check_views,
)
from keystore.formats.policy import Policy
from keystore.formats.policy_xml import policy_xml
from nodl.ament_index import search_prefixes


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv`` (default: the program's own); return the exit status."""
    with safe_output():
        parser = build_parser(first=True)
        complete(parser)
        line = read_command_line(parser, argv)
        return guarded("secure-launch", lambda: _main(line), EnclaveLaunchError, ProjectError)


def check_options(line: CommandLine, actions: Sequence[argparse.Action]) -> None:
    """Refuse options without effect: ``UsageError`` names the flag that is missing."""
    given, options = line.given, line.options
    only_shown = check_views(line, actions)
    mode = check_modes(line, actions, only_shown=only_shown)
    if options.provision_only and only_shown:
        raise UsageError(
            "--provision-only writes the keystore and starts nothing: give it with --secure alone"
        )
    if not options.secure:
        check_needs_secure(actions, given & FOR_SECURE)
        if not (only_shown or (mode is not None and mode.plans(options))):
            check_needs_secure(actions, given & FOR_PLAN, "--secure (or --dry-run, --audit, --watch)")


def _main(line: CommandLine) -> int:
    check_options(line, line.actions)
    if line.options.demo:
        _take_demo(line.options)
    prefixes = search_prefixes(line.options.prefix)
    options = with_project(line, find_project(launch_folder(line.options.words, prefixes), Path()))
    if options.verbose:
        print_notes(described(options))
    for prefix in options.prefix:  # absent folders on AMENT_PREFIX_PATH are passed over, as by ament
        if not prefix.is_dir():
            raise UsageError(f"--prefix {prefix}: no such directory")
    if options.show_all_subprocesses_output:
        os.environ["OVERRIDE_LAUNCH_PROCESS_OUTPUT"] = "both"  # as ros2 launch says it to launch
    target = find_target(options.words, prefixes)
    if options.show_args or options.print_description:
        with ament_prefixes(options.prefix):
            return _show_file(target, options)
    keystore = _keystore(options)
    if options.dry_run or options.explain or options.dump_params:  # only shown
        with stdout_is_for_the_plan():
            plan = planned(target, options, keystore)
        return show_plan(plan, options, keystore)
    from enclave_launch.verb.start import launch_target  # asyncio, cryptography

    return launch_target(target, options, keystore)


def _take_demo(options: argparse.Namespace) -> None:
    """Let the options name the launch file of the package; raises UsageError for a start or another launch file."""
    if (
        not (options.dry_run or options.explain or options.show_args or options.print_description)
        or options.words
    ):
        raise UsageError(
            "--demo has a launch file of its own, to look at\ntry: secure-launch --dry-run --demo"
        )
    options.prefix, options.words = [DEMO], ["demo_nodes", "demo.launch.xml"]


def _keystore(options: argparse.Namespace) -> str | None:
    if not options.secure:
        return None
    if options.keystore is None:
        words = shlex.join(word for word in options.typed if word != "--secure")
        raise UsageError(
            "--secure needs a keystore: give --keystore DIR or set ROS_SECURITY_KEYSTORE, or write enclaves.yaml\n"
            f"try: secure-launch --secure --keystore keystore {words}"
        )
    return str(os.path.abspath(options.keystore))


def _show_file(target: LaunchTarget, options: argparse.Namespace) -> int:
    text = arguments_text if options.show_args else description_text
    host = PlanHost(resolve_options(options).host_options())
    with read_description(target.launch_file, host) as description:
        shown = text(description)
    sys.stdout.write(shown)
    return 0


def show_plan(plan: LaunchPlan, options: argparse.Namespace, keystore: str | None) -> int:
    """Print the form of ``plan`` that ``options`` ask for. Gives the exit status."""
    if options.format == "tree" and not options.explain and not options.dump_params:
        return _show_tree(plan, options)
    text = _plan_text(plan, options, keystore)
    diagnostics = (*plan.problems, *plan.warnings)
    if options.explain and diagnostics:
        warn(f"problems: {len(plan.problems)}, warnings: {len(plan.warnings)}; --dry-run shows them")
    elif options.format == "policy" or options.dump_params:  # the JSON holds them
        warn(*diagnostics)
    sys.stdout.write(short_paths(text, os.getcwd()) if options.explain else text)
    return _status(plan, options)


def _status(plan: LaunchPlan, options: argparse.Namespace) -> int:
    """Return 0, and 1 for a plan whose secured start would be refused, if ``--strict`` asks for that."""
    return 1 if options.strict and plan.problems else 0


def _show_tree(plan: LaunchPlan, options: argparse.Namespace) -> int:
    shown = plan._replace(warnings=()) if options.quiet else plan
    sys.stdout.write(plan_tree(shown, terminal_style_of(sys.stdout, verbose=options.verbose)))
    return _status(plan, options)


def _plan_text(plan: LaunchPlan, options: argparse.Namespace, keystore: str | None) -> str:
    if options.explain:
        return _explained(plan, options.explain)
    if options.dump_params:
        return params_yaml(plan)
    if options.format == "json":
        logs = os.path.abspath(options.log_security) if options.log_security else ""
        security = SecuritySettings(keystore, options.strategy, logs) if keystore else None
        return plan_json(plan, security) + "\n"
    return _policy_text(plan)


def _policy_text(plan: LaunchPlan) -> str:
    known = tuple(enclave for enclave in plan.derived.policy.enclaves if enclave.profiles)
    if not known:
        nothing = "no enclave with known permissions: there is no policy to print"
        raise ManifestError("\n".join((*map(str, plan.problems), nothing)))
    return policy_xml(Policy(known)).decode()


def _explained(plan: LaunchPlan, subject: str) -> str:
    lines = explained(plan, subject)
    if not lines:
        enclaves = [enclave.path for enclave in plan.derived.policy.enclaves]
        what = "enclave, node, process, topic, service or action"
        meant = did_you_mean(subject, explainable(plan))
        others = meant or f"; enclaves: {' '.join(enclaves)}"
        raise UsageError(f"{subject!r} is not an {what} of this launch{others}")
    return "\n".join(map(printable, lines)) + "\n"


def params_yaml(plan: LaunchPlan) -> str:
    """Render YAML that ``--params-file`` accepts: one section per node that has parameters, by final name if known."""
    sections: dict[str, dict[str, dict[str, object]]] = {}
    for name, parameters in _named(plan):
        if parameters:
            section = sections.setdefault(name, {"ros__parameters": {}})
            section["ros__parameters"].update({key: _plain(value) for key, value in parameters.items()})
    if not sections:
        return ""
    text = dump_for_rcl(sections, allow_unicode=True)
    readable = printable_lines(text) == text
    return text if readable else dump_for_rcl(sections, allow_unicode=False)  # with YAML's own escapes


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


def arguments_text(description: LaunchDescription) -> str:
    """Return the declared arguments as ``ros2 launch --show-args`` prints them (ros2launch/api/api.py)."""
    arguments = description.get_launch_arguments()
    blocks = ["Arguments (pass arguments as '<name>:=<value>'):"]
    blocks += ["\n".join(_argument(argument)) for argument in arguments] or ["  No arguments."]
    if any(argument._conditionally_included for argument in arguments):
        blocks.append("* argument(s) which are only used if specific conditions occur")
    return "\n\n".join(blocks) + "\n"


def _argument(argument: DeclareLaunchArgument) -> Iterator[str]:
    yield f"    '{printable(argument.name)}':{'*' if argument._conditionally_included else ''}"
    yield f"        {argument.description}"
    if argument.choices:
        yield f"        one of: {', '.join(repr(choice) for choice in argument.choices)}"
    if argument.default_value is not None:
        default = " + ".join(part.describe() for part in argument.default_value)
        yield f"        (default: {printable(default)})"


def description_text(description: LaunchDescription) -> str:
    """Return the description as a tree, as ``ros2 launch --print`` prints it; nothing is executed."""
    return LaunchIntrospector().format_launch_description(description) + "\n"
