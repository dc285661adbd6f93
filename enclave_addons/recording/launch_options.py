"""``secure-launch --learn DIR`` and ``--audit``: run a launch recorded, to write manifests of its nodes, or to compare
what they request with its plan.
"""

from __future__ import annotations

import argparse
import ctypes
import fcntl
import os
import random
import socket
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from pathlib import Path

from enclave_addons.recording.audit import Audit, audit_json, audit_text
from enclave_addons.recording.learning import (
    RECORDS,
    LearntFolder,
    QuietWatch,
    keep_record,
    new_run,
    prepare_folder,
    write_manifests,
)
from enclave_addons.recording.recording import Recording
from enclave_common.dependencies import installed
from enclave_common.files import write_text
from enclave_common.terminal import warn
from enclave_common.words import counted, some_of
from enclave_launch.errors import ManifestError, RuntimeFailure, translated
from enclave_launch.flow import run_unsecured
from enclave_launch.options import RunSettings
from enclave_launch.plan import LaunchPlan
from enclave_launch.runtime.companion import LaunchCompanion
from enclave_launch.verb.planning import resolve_target
from enclave_launch.verb.start import Company, run_settings, start
from enclave_launch.verb.target import LaunchTarget
from nodl.errors import NoDLError

_NAMES = 6  # named in a message

Start = Callable[["LaunchCompanion"], int]
"""Run the launch with a companion; gives the exit status."""


def launch(target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
    """Learn from a run, or audit one. Return the exit status."""
    if options.audit:
        return audit_launch(resolve_target(target, options), options, run_settings(options))
    return learn_launch(
        target, options, lambda companion: start(target, options, keystore, Company(companion=companion))
    )


def learn_launch(target: LaunchTarget, options: argparse.Namespace, start: Start) -> int:
    """Record one run, write what was learnt, return the status of the launch."""
    folder = Path(options.learn).absolute()
    prepare_folder(folder)
    isolation = isolate(options.learn_isolation)
    unsecured = "" if options.secure else ", unsecured"
    _say(f"learning: every process runs as ever{unsecured}; {DEVICES_STAY_REAL}")
    _say(f"isolated by: {isolation.value}")

    distro = (options.distro or os.environ.get("ROS_DISTRO", "")).partition("@")[0]
    run = new_run(target.launch_file, distro, isolation.value, secured=options.secure)
    recording = Recording(run, [QuietWatch(options.learn_for)])
    status = start(recording)
    keep_record(folder, run, recording.data)
    _report(write_manifests(folder), folder)
    if installed("enclave_addons.inference") and options.missing_nodl == "infer":
        _report_unseen(folder, options)
    return status


def _report_unseen(folder: Path, options: argparse.Namespace) -> None:
    """Report what other descriptions of the recorded nodes have: some names exist only while another is read."""
    from enclave_addons.recording.verb.check_record import never_seen  # an add-on: inference

    _say("comparing the records with sources and the library")
    with translated(NoDLError, ManifestError):
        found = never_seen([folder / RECORDS], options.prefix, options.source)
    for about, names in found.items():
        _say(f"warning: {about}: never seen: {some_of(names, _NAMES, '; ')}")
    if found:
        _say(
            "record again while these are used, or grant them with --also unseen (--explain shows which description "
            "has them)"
        )


def _report(learnt: LearntFolder, folder: Path) -> None:
    for path, node in learnt.files.items():
        runs = counted(len(node.runs), "run")
        print(
            f"{path}: node {node.key.node} of {node.program}, {counted(len(node.entries), 'endpoint')}, {runs}"
        )
    for note in learnt.notes:
        _say(f"warning: {note}")
    if not learnt.files:
        _say(f"warning: no node was recorded; {folder} has no manifest")


def _say(text: str) -> None:
    print(f"secure-launch: {text}", file=sys.stderr)


def audit_launch(plan: LaunchPlan, options: argparse.Namespace, settings: RunSettings) -> int:
    """Run the launch and report what the plan would refuse; return 1 then, or if not everything was visible."""
    warn(*plan.problems)
    audit = Audit(plan)
    recording = Recording(new_run(plan.launch_file, plan.distro, "none"), [audit])
    status = run_unsecured(plan, options=replace(settings, companion=recording))
    report = audit.report()
    sys.stdout.write(audit_text(report))
    if options.audit_report is not None:
        with translated(
            OSError, RuntimeFailure, f"--audit-report {options.audit_report}: cannot be written: "
        ):
            write_text(options.audit_report, audit_json(report))
    return status or report.exit_status


_NEW_USER, _NEW_NET = 0x10000000, 0x40000000  # linux/sched.h
_GET_FLAGS, _SET_FLAGS, _UP = 0x8913, 0x8914, 0x1  # linux/sockios.h, linux/if.h
# Those whose ports lie below the ephemeral ones (ROS 2 documentation, ROS_DOMAIN_ID).
_DOMAINS = range(1, 101)

DEVICES_STAY_REAL = "motors, sensors and device files are not isolated: what the nodes do to them is real"


class Isolation(str, Enum):
    """Ways to isolate a recorded launch; the value is the text for reports."""

    NAMESPACE = "network namespace"
    LOCAL = "discovery on this machine only, in a DDS domain of its own"
    NONE = "nothing: it communicates with other nodes of its domain"


def isolate(wanted: str = "auto") -> Isolation:
    """Isolate this process from other robots and other nodes of this machine, and return what was done.

    A learning run is real and unsecured. A network namespace of its own keeps everything in but devices; if that is not
    allowed, or nodes need the network, discovery stays on this machine, in a DDS domain of its own. Call it
    before any thread or process is started.
    """
    if wanted == "none":
        return Isolation.NONE
    if wanted == "auto" and _a_child_can() and _enter_namespace():
        return Isolation.NAMESPACE
    os.environ.update(local_discovery(os.environ.get("ROS_DOMAIN_ID", "0")))
    os.environ.pop("ROS_STATIC_PEERS", None)  # a peer that is named here is talked to all the same
    return Isolation.LOCAL


def local_discovery(domain_in_use: str) -> dict[str, str]:
    """Return variables for all releases: the first one since iron, the second one before."""
    others = [str(domain) for domain in _DOMAINS if str(domain) != domain_in_use]
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOCALHOST_ONLY": "1",
        "ROS_DOMAIN_ID": random.SystemRandom().choice(others),
    }


def _a_child_can() -> bool:
    """Return True if it works in a child: half of it, done to ourselves, could not be undone."""
    child = os.fork()
    if child == 0:
        os._exit(0 if _enter_namespace() else 1)
    return os.waitpid(child, 0)[1] == 0


def _enter_namespace() -> bool:
    """Enter a network namespace with its loopback up; as an ordinary user in a user namespace with the same user."""
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.geteuid(), os.getegid()
    if user == 0:
        entered = libc.unshare(_NEW_NET) == 0
    else:
        entered = libc.unshare(_NEW_USER | _NEW_NET) == 0 and _map_us(user, group)
    return bool(entered) and _loopback_up()


def _map_us(user: int, group: int) -> bool:
    try:
        for file, text in (
            ("setgroups", "deny"),
            ("uid_map", f"{user} {user} 1"),
            ("gid_map", f"{group} {group} 1"),
        ):
            with open(f"/proc/self/{file}", "w", encoding="ascii") as stream:
                stream.write(text)
    except OSError:
        return False
    return True


def _loopback_up() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            request = struct.pack("16sh22x", b"lo", 0)
            flags = struct.unpack("16sh22x", fcntl.ioctl(probe, _GET_FLAGS, request))[1]
            fcntl.ioctl(probe, _SET_FLAGS, struct.pack("16sh22x", b"lo", flags | _UP))
        except OSError:
            return False
    return True
