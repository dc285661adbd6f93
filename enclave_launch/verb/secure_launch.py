"""``secure-launch``: arguments, the calls of ``flow``, an exit status."""

from __future__ import annotations

import argparse
import gc
import os
import re
import sys
from collections.abc import Mapping, Sequence

from enclave_launch.boundary.command_line import complete, guarded
from enclave_launch.boundary.light import TYPE_CHECKING
from enclave_launch.boundary.terminal import (
    printable,
    safe_output,
    short_paths,
    stdout_is_for_the_plan,
    warn,
    write_coloured,
)
from enclave_launch.boundary.words import did_you_mean
from enclave_launch.errors import EnclaveLaunchError, ManifestError, UsageError, translated
from enclave_launch.verb.options import build_parser
from enclave_launch.verb.usage import (
    PERMISSIVE_NOTICE,
    CommandLine,
    check_options,
    read_command_line,
    unsecured_notice,
)

if TYPE_CHECKING:
    from enclave_launch.options import ResolveOptions, RunSettings
    from enclave_launch.plan import LaunchPlan
    from enclave_launch.runtime.companion import LaunchCompanion
    from enclave_launch.verb.target import LaunchTarget


_ALLOCATIONS = 100_000
"""Between two searches for garbage. Python's 700 search all that a start-up builds, and nearly all of it stays."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv`` (default: the program's own). Gives the exit status, never a traceback
    for what a user can cause."""
    with safe_output():
        parser = build_parser()
        complete(parser, _offer)
        line = read_command_line(parser, argv)
        before = gc.get_threshold()
        gc.set_threshold(_ALLOCATIONS)
        try:
            return guarded("secure-launch", lambda: _main(line, parser), EnclaveLaunchError)
        finally:
            gc.set_threshold(*before)


def _offer(parser: argparse.ArgumentParser) -> None:
    from enclave_launch.verb.completion import offer_launches

    offer_launches(parser)


def _main(line: CommandLine, parser: argparse.ArgumentParser) -> int:
    from enclave_launch.prefixes import ament_prefixes
    from enclave_launch.verb.target import find_target
    from nodl.ament_index import search_prefixes

    check_options(line, parser)
    options = line.options
    for prefix in options.prefix:  # absent folders on AMENT_PREFIX_PATH are passed over, as by ament
        if not prefix.is_dir():
            raise UsageError(f"--prefix {prefix}: no such directory")
    if options.show_all_subprocesses_output:
        os.environ["OVERRIDE_LAUNCH_PROCESS_OUTPUT"] = "both"  # as ros2 launch says it to launch
    target = find_target(options.words, search_prefixes(options.prefix))
    if options.show_args or options.print_description:
        with ament_prefixes(options.prefix):
            return _show_file(target, options)
    keystore = _keystore(options)
    if options.dry_run or options.explain or options.dump_params:  # only looked at
        with stdout_is_for_the_plan():
            plan = _planned(target, options, keystore)
        return show_plan(plan, options, keystore)
    if options.learn is not None:
        from enclave_launch.verb.learn import learn_launch

        return learn_launch(target, options, lambda companion: start(target, options, keystore, companion))
    if options.audit:
        from enclave_launch.verb.audit import audit_launch

        return audit_launch(_resolve(target, options), options, _run_settings(options))
    return start(target, options, keystore)


def start(
    target: LaunchTarget,
    options: argparse.Namespace,
    keystore: str | None,
    companion: LaunchCompanion | None = None,
) -> int:
    """Launch ``target``, secured where there is a ``keystore``, and stay until it is over. Gives the exit status."""
    if keystore is None:
        if options.watch:
            from enclave_launch.verb.watch import watch_plain_launch

            plan = _resolve(target, options)
            warn(*plan.problems, *plan.warnings)
            print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
            return watch_plain_launch(plan, options, _run_settings(options))
        return _launch_plainly(target, options, companion)
    while (status := _launch(_planned(target, options, keystore), options, keystore, companion)) is None:
        pass  # what it used was about to end: planned, renewed and started once more
    return status


def _planned(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> LaunchPlan:
    """The plan; with a keystore it says what is shared with other launches there."""
    plan = _resolve(target, options)
    if keystore is None or not os.path.isdir(keystore):
        return plan
    from enclave_launch.secured import told_of_shares

    return told_of_shares(plan, keystore)


def _keystore(options: argparse.Namespace) -> str | None:
    """The keystore that ``--secure`` is to use. Raises ``UsageError`` when there is none."""
    if not options.secure:
        return None
    if options.keystore is None:
        raise UsageError("--secure needs a keystore: give --keystore DIR or set ROS_SECURITY_KEYSTORE")
    return str(os.path.abspath(options.keystore))


def _resolve(target: LaunchTarget, options: argparse.Namespace) -> LaunchPlan:
    from enclave_launch.boundary.terminal import ProgressLine, wanted
    from enclave_launch.flow import resolve

    line = ProgressLine("analysing") if wanted(options.quiet) else None
    try:
        chosen = resolve_options(options)._replace(progress=line)
        return resolve(target.launch_file, target.arguments, options=chosen)
    finally:
        if line is not None:
            line.clear()


def resolve_options(options: argparse.Namespace) -> ResolveOptions:
    """What the options say about evaluation and permissions."""
    from enclave_launch.enclave import EnclaveScope
    from enclave_launch.options import ResolveOptions

    return ResolveOptions(
        prefixes=tuple(options.prefix),
        manifests=tuple(options.nodl),
        policy=options.policy,
        distro=options.distro,
        enclave_scope=EnclaveScope(options.enclave_scope),
        infer=options.missing_nodl in ("infer", "analysis"),
        library=options.missing_nodl in ("infer", "library"),
        library_folders=tuple(options.library),
        source_folders=tuple(options.source),
        accept_patterns=options.accept_patterns,
        allow_missing_packages=options.allow_missing_packages,
        also=tuple(options.also),
        accept_prefixes=tuple(options.accept_prefix),
        accept_middlewares=tuple(options.accept_middleware),
        no_python=options.no_python,
        launch_configurations=_launch_prefix(options),
    )


def _launch_prefix(options: argparse.Namespace) -> Mapping[str, str]:
    pattern = options.launch_prefix_filter
    with translated(
        re.error, UsageError, f"--launch-prefix-filter {pattern!r} is not a regular expression: "
    ):
        re.compile(pattern or "")
    given = {"launch-prefix": options.launch_prefix, "launch-prefix-filter": pattern}
    return {name: value for name, value in given.items() if value is not None}


def _show_file(target: LaunchTarget, options: argparse.Namespace) -> int:
    from enclave_launch.evaluation.evaluate import read_description
    from enclave_launch.host.plan_host import PlanHost
    from enclave_launch.report.launch_file import arguments_text, description_text

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
    told = (*plan.problems, *plan.warnings)
    if options.explain and told:
        warn(f"problems: {len(plan.problems)}, warnings: {len(plan.warnings)}; --dry-run shows them")
    elif options.format == "policy" or options.dump_params:  # the JSON holds them
        warn(*told)
    sys.stdout.write(short_paths(text, os.getcwd()) if options.explain else text)
    gc.freeze()  # the process ends now: no last search for garbage among all that was read
    return 0


def _show_tree(plan: LaunchPlan, options: argparse.Namespace) -> int:
    from enclave_launch.report.look import look_for
    from enclave_launch.report.tree import plan_tree

    shown = plan._replace(warnings=()) if options.quiet else plan
    write_coloured(plan_tree(shown, look_for(sys.stdout, os.environ, verbose=options.verbose)), sys.stdout)
    gc.freeze()  # as in show_plan
    return 0


def _plan_text(plan: LaunchPlan, options: argparse.Namespace, keystore: str | None) -> str:
    if options.explain:
        return _explained(plan, options.explain)
    if options.dump_params:
        from enclave_launch.report.params import params_yaml

        return params_yaml(plan)
    if options.format == "json":
        from enclave_launch.report.plan_json import plan_json
        from enclave_launch.security_environment import SecuritySettings

        security = SecuritySettings(keystore, options.strategy) if keystore else None
        return plan_json(plan, security) + "\n"
    if options.format == "policy":
        return _policy_text(plan)
    from enclave_launch.report.plan_json import plan_document
    from enclave_launch.verb.secure_plan.report import report_text

    there = keystore if keystore is not None and os.path.isdir(keystore) else None
    return report_text(plan_document(plan), options.format, " ".join(options.words), keystore=there)


def _policy_text(plan: LaunchPlan) -> str:
    """Raises ``ManifestError`` when there is no enclave to write: SROS2's schema wants at least one."""
    from keystore.formats.policy import Policy
    from keystore.formats.policy_xml import policy_xml

    known = tuple(enclave for enclave in plan.derived.policy.enclaves if enclave.profiles)
    if not known:
        nothing = "no enclave with known permissions: there is no policy to print"
        raise ManifestError("\n".join((*map(str, plan.problems), nothing)))
    return policy_xml(Policy(known)).decode()


def _explained(plan: LaunchPlan, subject: str) -> str:
    from enclave_launch.report.explained import explainable, explained

    lines = explained(plan, subject)
    if not lines:
        enclaves = [enclave.path for enclave in plan.derived.policy.enclaves]
        what = "enclave, node, process, topic, service or action"
        meant = did_you_mean(subject, explainable(plan))
        others = meant or f"; enclaves: {' '.join(enclaves)}"
        raise UsageError(f"{subject!r} is not an {what} of this launch{others}")
    return "\n".join(map(printable, lines)) + "\n"


def _launch_plainly(
    target: LaunchTarget, options: argparse.Namespace, companion: LaunchCompanion | None = None
) -> int:
    """Without enclaves nobody has to know what the nodes say to each other."""
    from enclave_launch.flow import launch_source, run

    launch = launch_source(target.launch_file, target.arguments, options=resolve_options(options))
    print(f"secure-launch: {unsecured_notice(os.environ)}", file=sys.stderr)
    return run(launch, options=_run_settings(options)._replace(companion=companion))


def _launch(
    plan: LaunchPlan, options: argparse.Namespace, keystore: str, companion: LaunchCompanion | None = None
) -> int | None:
    """The exit status; ``None`` when it was ended in order to be renewed and started anew (``--restart-expiring``)."""
    from enclave_launch.flow import provision, run
    from enclave_launch.verb.security import created_notices, expiry_notices, repair_notices, security_options

    warn(*(() if options.quiet else plan.warnings))
    _check_before_keys_are_made(plan, keystore)
    if options.strategy == "Permissive":
        print(f"secure-launch: {PERMISSIVE_NOTICE}", file=sys.stderr)
    launch = provision(plan, keystore, options=security_options(options))
    if not options.quiet:
        for text in created_notices(launch):
            print(f"secure-launch: {printable(text)}", file=sys.stderr)
    repaired = (*repair_notices(launch), *launch.report.warnings, *launch.handshakes)
    gaps = launch.zenoh.gaps if launch.zenoh is not None else ()
    warn(*repaired, *gaps, *expiry_notices(launch, options.warn_expiry))
    deadline = watch = None
    if options.restart_expiring:
        from enclave_launch.expiry_watch import renewal_deadline
        from keystore.formats.validity import utc_now

        deadline = renewal_deadline(launch, utc_now())
    if options.watch:
        from enclave_launch.verb.watch import watch_of_secured_launch

        watch = watch_of_secured_launch(launch, options)
    settings = _run_settings(options)._replace(companion=companion, deadline=deadline, watch=watch)
    status = run(launch, options=settings)
    if watch is not None:
        status = watch.status(status)
    return None if deadline is not None and deadline.reached else status


def _check_before_keys_are_made(plan: LaunchPlan, keystore: str) -> None:
    """What ``run`` would refuse in any case, asked before the keystore is touched. Raises as ``run`` does."""
    from enclave_launch.evaluation.programs import check_programs
    from enclave_launch.plan import on_zenoh

    if plan.problems:
        return  # told first, by ``provision``
    check_programs(plan.evaluation.processes)
    if on_zenoh(plan, os.environ):
        from enclave_launch.secured import check_router

        check_router(plan, keystore)
    if plan.launcher is not None:
        # It brings asyncio, which otherwise is imported while the warden starts up.
        from enclave_launch.runtime.ros_services import require_rclpy

        require_rclpy()


def _run_settings(options: argparse.Namespace) -> RunSettings:
    from enclave_launch.options import RunSettings

    return RunSettings(
        noninteractive=options.noninteractive,
        debug=options.debug,
        allow_late=options.allow_late,
        secrets=frozenset(filter(None, [options.ca_passphrase_env])),
        record=False if options.no_explain_denials else None,
        log_limit=options.log_limit,
    )
