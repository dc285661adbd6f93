"""Say what is missing before a secured start of a launch file works on this machine, each with one next step.

Looks at ROS and its versions, the middleware and its security plugins, the keystore, access to the CA keys, the clock,
nodes that are not known, and names that nothing serves. Only reads; starts and writes nothing.

exit status: 0 ready, 1 something is missing, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from enclave_addons.review.checks import check_plan
from enclave_addons.review.installation import (
    installed_distributions,
    look_at_middleware,
    sourced_distribution,
)
from enclave_addons.review.verb import plans
from enclave_addons.review.verb.plans import FORM, read_plan
from enclave_common.command_line import FLAG, PATH, TEXT, FromProject, Option
from enclave_common.terminal import json_text, printable_lines
from enclave_common.words import counted, some_of
from enclave_launch.admission.middleware import ZENOH, middleware_of, vendor_of
from enclave_launch.diagnostics import Code
from enclave_launch.dry_run import Diagnostic, DryRun
from enclave_launch.errors import EnclaveLaunchError, UsageError
from enclave_launch.ros_rules.distro import choose_release, list_versions
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import KeystoreError, SigningUnavailableError, WrongClockError
from keystore.formats.role import Role
from keystore.formats.validity import utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.verification import verify
from nodl.ament_index import search_prefixes

WORDS: tuple[Option, ...] = (("words", {**plans.WORDS, "nargs": "*"}, "a plan or what to plan"),)
OPTIONS = {
    "": (
        ("--versions", {**FLAG, "dest": "lists_versions"},
         "only print the versions of the installed packages of ROS, for --versions FILE elsewhere"),
        ("--keystore DIR", {**PATH, "configured": FromProject("keystore")},
         "the keystore of the start (default: ROS_SECURITY_KEYSTORE, or keystore in enclaves.yaml)"),
        ("--ca-passphrase-file FILE", PATH, "passphrase of encrypted CA keys"),
        ("--ca-passphrase-env NAME", TEXT, "the variable that holds it"),
        FORM,
    )
}  # fmt: skip

OK, NOTE, MISSING = "ok", "note", "missing"
_UNKNOWN_NODES = frozenset({Code.NO_MANIFEST, Code.INTERFACE_UNKNOWN, Code.NODE_NAME_UNKNOWN})
_NOBODY_SERVES = frozenset({"no-server", "no-publisher"})
_SHOWN = 3


@dataclass(frozen=True)
class LookedAt:
    """One thing that was looked at.

    Attributes:
        state: ``ok``, ``note`` for what does not stop a secured start, or ``missing``.
        about: What was looked at.
        text: What was found.
        step: A command or action that comes next, empty if nothing needs doing.
    """

    state: str
    about: str
    text: str
    step: str = ""


def run(options: argparse.Namespace) -> int:
    """Print what is there and what is missing. Returns 1 if something is missing."""
    options.versions = None  # of the robot: here the installed ones count
    if options.lists_versions:
        return _print_versions(options)
    if not options.words:
        raise UsageError(
            "give PACKAGE LAUNCH_FILE, or the PATH of a launch file\ntry: secure-plan doctor PACKAGE LAUNCH_FILE"
        )
    answers = list(_answers(options))
    missing = [each for each in answers if each.state == MISSING]
    if options.format == "json":
        document = {"version": 1, "ready": not missing, "answers": [asdict(each) for each in answers]}
        sys.stdout.write(json_text(document, indent=2) + "\n")
    else:
        for each in answers:
            print(printable_lines(f"{each.state:8}{each.about}: {each.text}"))
            if each.step:
                print(printable_lines(f"        try: {each.step}"))
        print(_verdict(len(missing)))
    return 1 if missing else 0


def _print_versions(options: argparse.Namespace) -> int:
    release = choose_release(options.distro, os.environ.get("ROS_DISTRO"), search_prefixes(options.prefix))
    listed = list_versions(release)
    if not listed:
        raise UsageError(
            "no package of ROS whose version matters is installed or sourced here\n"
            "try: . /opt/ros/DISTRO/setup.sh, or name its install prefix with --prefix DIR"
        )
    sys.stdout.write(listed)
    return 0


def _verdict(missing: int) -> str:
    if missing:
        return f"{counted(missing, 'thing')} missing before a secured start"
    if not sourced_distribution(os.environ):
        return "ready to plan and to make keys; source ROS before you start nodes of ROS here"
    return "ready for a secured start"


def _answers(options: argparse.Namespace) -> Iterator[LookedAt]:
    prefixes = search_prefixes(options.prefix)
    plan: DryRun | None = None
    try:
        plan = read_plan(options.words, options)
    except UsageError:
        raise
    except EnclaveLaunchError as error:
        shown = shlex.join(["secure-launch", "--dry-run", *options.words])
        yield LookedAt(
            MISSING, "launch file", str(error).split("\n")[0], f"correct the launch file, then: {shown}"
        )
    yield from _ros(plan, prefixes)
    middlewares = {_middleware_of(each.environment) for each in plan.processes} if plan else set()
    for name in sorted(middlewares or {middleware_of(os.environ)}):
        yield _middleware(name, prefixes, plan.release.distro if plan and plan.release else "DISTRO")
    yield from _keystore(options)
    if plan is not None:
        yield from _plan(plan, options)


def _ros(plan: DryRun | None, prefixes: tuple[str, ...]) -> Iterator[LookedAt]:
    sourced = sourced_distribution(os.environ)
    if sourced:
        yield LookedAt(OK, "ROS", f"{sourced}, from {some_of(prefixes, 2)}")
    else:
        setups = installed_distributions()
        step = (
            f". {setups[-1]}"
            if setups
            else "apt install ros-jazzy-ros-base, or plan here and start on the robot"
        )
        yield LookedAt(
            NOTE,
            "ROS",
            "not installed or not sourced; planning works, nodes that need ROS do not start",
            step,
        )
    if plan is not None and plan.release is not None:
        versions = ", ".join(f"{name} {version}" for name, version in plan.release.versions.items())
        assumed = (
            f"; assumed, as not installed: {', '.join(plan.release.assumed)}" if plan.release.assumed else ""
        )
        step = (
            "secure-plan doctor --versions > robot.versions on the robot, then --versions robot.versions here"
            if assumed
            else ""
        )
        yield LookedAt(
            NOTE if assumed else OK,
            "versions",
            f"{plan.release.distro}: {versions}{assumed}",
            step if assumed else "",
        )


def _middleware_of(environment: dict[str, str]) -> str:
    return middleware_of({**os.environ, **environment})


def _middleware(name: str, prefixes: tuple[str, ...], distro: str) -> LookedAt:
    if vendor_of(name) is None and name != ZENOH:
        return LookedAt(
            MISSING,
            "middleware",
            f"{name} is not known to read enclaves",
            "export RMW_IMPLEMENTATION=rmw_fastrtps_cpp",
        )
    found = look_at_middleware(name, prefixes)
    if not found.version:
        package = f"ros-{distro}-{name.replace('_', '-')}"
        state = MISSING if sourced_distribution(os.environ) else NOTE
        return LookedAt(state, "middleware", f"{name} is not installed here", f"apt install {package}")
    if name == ZENOH:
        return LookedAt(OK, "middleware", f"{name} {found.version}")
    if found.security is None:
        return LookedAt(
            MISSING,
            "middleware",
            f"{name} {found.version}, but without security plugins: a process in an enclave would not start",
            f"install {name} from packages.ros.org (apt), or build its DDS with security (-DSECURITY=ON)",
        )
    return LookedAt(OK, "middleware", f"{name} {found.version}, with security ({found.security})")


def _keystore(options: argparse.Namespace) -> Iterator[LookedAt]:
    root = options.keystore
    if root is None:
        yield LookedAt(
            MISSING,
            "keystore",
            "none is named",
            "secure-plan init, which writes enclaves.yaml; or give --keystore DIR",
        )
        return
    named = shlex.quote(str(root))
    unopened = KeystoreView(Path(root))
    if unopened.can_be_completed and not unopened.is_complete:
        yield LookedAt(OK, "keystore", f"{root} does not exist yet; the first secured start makes it")
        yield LookedAt(OK, "clock", utc_now().strftime("%Y-%m-%d %H:%M UTC"))
        return
    try:
        view = keystore_at(root)
        report = verify(root)
    except KeystoreError as error:
        yield LookedAt(MISSING, "keystore", str(error), f"secure-keystore verify {named}")
        return
    failing = [finding for finding in report.findings if finding.severity.fails]
    if failing:
        text = f"{root}: {counted(len(failing), 'finding')}, the first: {failing[0].message}"
        yield LookedAt(MISSING, "keystore", text, f"secure-keystore verify {named}")
    else:
        yield LookedAt(OK, "keystore", f"{root}: {counted(report.enclaves, 'enclave')}, verified")
    yield _ca_access(view, options)
    yield _clock(view)


def _ca_access(view: KeystoreView, options: argparse.Namespace) -> LookedAt:
    secret = Secret(options.ca_passphrase_file, None, options.ca_passphrase_env)
    access = CaAccess(passphrase=secret if secret.is_given else None)
    if not any(view.key_file(role) for role in Role):
        step = "a changed launch is provisioned where the keys are: secure-keystore export there, import here"
        return LookedAt(NOTE, "CA keys", "not on this machine; enclaves that exist can start", step)
    try:
        for role in Role:
            view.authority(role, access)
    except SigningUnavailableError as error:
        return LookedAt(
            MISSING,
            "CA keys",
            str(error),
            "add --ca-passphrase-file FILE, with the file that holds the passphrase",
        )
    except KeystoreError as error:
        return LookedAt(
            MISSING, "CA keys", str(error), f"secure-keystore verify {shlex.quote(str(view.root))}"
        )
    return LookedAt(OK, "CA keys", "both open")


def _clock(view: KeystoreView) -> LookedAt:
    now = utc_now()
    text = now.strftime("%Y-%m-%d %H:%M UTC")
    try:
        view.refuse_clock(now)
    except WrongClockError as error:
        return LookedAt(MISSING, "clock", str(error), "timedatectl set-ntp true")
    return LookedAt(OK, "clock", text)


def _plan(plan: DryRun, options: argparse.Namespace) -> Iterator[LookedAt]:
    problems = [each for each in plan.diagnostics if each.severity == "error"]
    unknown = [each for each in problems if each.code in _UNKNOWN_NODES]
    words = shlex.join(options.words)
    if unknown:
        step = f"secure-launch --learn learnt {words}; then add --nodl learnt"
        yield LookedAt(MISSING, "nodes", f"not known: {_subjects(unknown)}", step)
    else:
        yield LookedAt(OK, "nodes", f"the interfaces of all {len(plan.nodes)} are known")
    for each in problems:
        if each.code not in _UNKNOWN_NODES:
            place = f"{each.place}: " if each.place else ""
            yield LookedAt(MISSING, "launch", f"{place}{each.text}", each.remedy)
    idle = [each for each in check_plan(plan) if each.code in _NOBODY_SERVES]
    if idle:
        step = f"secure-plan check {words}; correct the names, or start what serves them beside this launch"
        yield LookedAt(NOTE, "names", f"nothing in this launch serves {_subjects(idle)}", step)


def _subjects(found: Iterable[Diagnostic]) -> str:
    return some_of(dict.fromkeys(each.subject for each in found), _SHOWN)
