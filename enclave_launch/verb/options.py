"""The options of ``secure-launch``: one table of argparse groups, in the manner of ``ros2 launch``."""

from __future__ import annotations

import argparse
import os
import re
from typing import TYPE_CHECKING

from enclave_launch.boundary.command_line import CommandParser, add_verbosity, add_version
from enclave_launch.boundary.files import as_path
from enclave_launch.ros_rules.distro import Distro

if TYPE_CHECKING:
    from pathlib import Path

DESCRIPTION = """\
Launch a ROS 2 launch file (XML, YAML or Python), with or without ROS installed.
With --secure every process gets an enclave with the least permissions that let it work:
keys, certificates and signed permissions are made from the launch file before anything starts.
"""

EPILOG = """\
examples:
  secure-launch --dry-run demo_nodes talker_listener.launch.xml       what would start, in which enclave
  secure-launch --secure --keystore ks demo_nodes talker_listener.launch.xml
  secure-launch --secure --keystore ks ./my.launch.py robot:=r1       a file, with a launch argument
  secure-launch -s demo_nodes talker_listener.launch.xml              the launch arguments of a file

exit status: 0 all ended well, 1 something failed (or a process could not be secured), 2 wrong usage
"""


def build_parser() -> argparse.ArgumentParser:
    """All options, grouped by the question they answer."""
    parser = CommandParser(
        prog="secure-launch",
        usage="secure-launch [options] PACKAGE LAUNCH_FILE [name:=value ...]\n"
        "       secure-launch [options] PATH/TO/FILE.launch.{xml,yaml,py} [name:=value ...]",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "words", nargs="*", metavar="PACKAGE LAUNCH_FILE | PATH [name:=value ...]", help=argparse.SUPPRESS
    )
    add_version(parser)
    add_verbosity(parser)
    add_security_options(parser.add_argument_group("security"))
    add_policy_options(parser.add_argument_group("what each node may do"))
    _add_inspection(parser.add_argument_group("looking without starting"))
    add_evaluation_options(parser.add_argument_group("evaluating the launch file"))
    _add_running(parser.add_argument_group("running"))
    _add_recording(parser.add_argument_group("recording what nodes ask for"))
    return parser


def add_security_options(group: argparse._ArgumentGroup) -> None:
    """Also those of ``ros2 launch``, see ``ros2.option``."""
    group.add_argument(
        "--secure", action="store_true", help="give every process its enclave; refuse to start otherwise"
    )
    group.add_argument(
        "--keystore",
        metavar="DIR",
        type=as_path,
        default=_path_from_environment("ROS_SECURITY_KEYSTORE"),
        help="keystore to use (default: ROS_SECURITY_KEYSTORE); created when it does not exist",
    )
    group.add_argument("--no-create-keystore", action="store_true", help="an absent keystore is an error")
    group.add_argument(
        "--strategy",
        choices=("Enforce", "Permissive"),
        default="Enforce",
        help="ROS_SECURITY_STRATEGY of the processes (default: Enforce)",
    )
    group.add_argument(
        "--domain-id",
        metavar="IDS",
        help="DDS domains of the permissions: N, N-M, or a list (default: for each enclave those of its processes)",
    )
    group.add_argument(
        "--valid-for", metavar="TIME", help="validity of new certificates and permissions, such as 90d"
    )
    group.add_argument(
        "--no-revoke",
        action="store_true",
        help="where rights are taken away: do not revoke the certificate of before (it can be used until it ends)",
    )
    group.add_argument(
        "--warn-expiry",
        metavar="TIME",
        default="30d",
        help="warn when an enclave expires within this time (default: 30d)",
    )
    group.add_argument(
        "--compatible-subjects",
        action="store_true",
        help="certificate subjects as SROS2 writes them; see secure-keystore verify for the exposure",
    )
    passphrase = group.add_mutually_exclusive_group()
    passphrase.add_argument(
        "--ca-passphrase-file", metavar="FILE", type=as_path, help="passphrase of encrypted CA keys"
    )
    passphrase.add_argument(
        "--ca-passphrase-env",
        metavar="NAME",
        help="the variable that holds it; no process of the launch sees it",
    )
    group.add_argument(
        "--allow-late",
        action="store_true",
        help="provision actions that only exist at run time instead of refusing them",
    )


def add_policy_options(group: argparse._ArgumentGroup) -> None:
    """Also those of ``ros2 launch``."""
    group.add_argument(
        "--nodl",
        metavar="FILE|DIR",
        action="append",
        type=as_path,
        default=[],
        help="use this NoDL manifest, or those of a folder, where definitions conflict (repeatable)",
    )
    group.add_argument(
        "--missing-nodl",
        choices=("infer", "analysis", "library", "error"),
        default="infer",
        help="nodes without a manifest: infer from their source, else ask the library (default), only one of the two, "
        "or an error",
    )
    group.add_argument(
        "--library",
        metavar="DIR",
        action="append",
        type=as_path,
        default=[],
        help="documents of your own that add to or correct the library (repeatable; docs/library.md)",
    )
    group.add_argument(
        "--source",
        metavar="DIR",
        action="append",
        type=as_path,
        default=[],
        help="look for the sources of compiled nodes below this folder too (repeatable; docs/inference.md)",
    )
    group.add_argument(
        "--accept-patterns",
        action="store_true",
        help="accept names of which inference knows only a part, as wildcards; each is reported",
    )
    group.add_argument(
        "--enclave-scope",
        choices=("namespace", "node", "process", "launch"),
        default="namespace",
        help="enclave of a process that names none (default: namespace)",
    )
    group.add_argument(
        "--also",
        metavar="WHAT",
        action="append",
        choices=("clock", "logger-services", "service-events"),
        default=[],
        help="grant every node also: clock (use_sim_time set at run time), logger-services, service-events "
        "(service introspection) (repeatable)",
    )
    group.add_argument(
        "--accept-prefix",
        metavar="NAME",
        action="append",
        default=[],
        help="a launch prefix that keeps the environment, though it is not known to (repeatable; 'shell' for shells)",
    )
    group.add_argument(
        "--accept-middleware",
        metavar="NAME",
        action="append",
        default=[],
        help="an RMW_IMPLEMENTATION that reads enclaves, though it is not known to (repeatable)",
    )
    group.add_argument(
        "--policy", metavar="FILE", type=as_path, help="SROS2 policy merged over the derived one"
    )


def add_looking_options(group: argparse._ArgumentGroup) -> None:
    """Also those of ``ros2 launch``."""
    group.add_argument("--dry-run", action="store_true", help="print the plan; start nothing, write nothing")
    group.add_argument(
        "--format",
        choices=("tree", "json", "policy", "html", "markdown", "dot", "mermaid"),
        default="tree",
        help="of the dry run: tree (default), json, the derived SROS2 policy, or a report as of secure-plan report",
    )
    group.add_argument(
        "--explain",
        metavar="ENCLAVE|NODE|TOPIC",
        help="why each permission is there: manifest, remap rule or built-in, with file and line",
    )
    group.add_argument(
        "--dump-params", action="store_true", help="print every node's parameters as one YAML file"
    )


def _add_inspection(group: argparse._ArgumentGroup) -> None:
    add_looking_options(group)
    group.add_argument(
        "-s",
        "--show-args",
        "--show-arguments",
        action="store_true",
        help="print the launch arguments that the file declares",
    )
    group.add_argument(
        "-p",
        "--print",
        "--print-description",
        dest="print_description",
        action="store_true",
        help="print the launch description",
    )


def add_evaluation_options(group: argparse._ArgumentGroup) -> None:
    """Options that decide how a launch file is evaluated, of every command that reads one."""
    group.add_argument(
        "--prefix",
        metavar="DIR",
        action="append",
        type=as_path,
        default=[],
        help="ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)",
    )
    group.add_argument(
        "--distro",
        choices=[distro.value for distro in Distro],
        help="ROS distribution to behave like (default: ROS_DISTRO, else the newest)",
    )
    group.add_argument(
        "--allow-missing-packages",
        action="store_true",
        help="go on with a marked placeholder for packages that are not installed",
    )
    group.add_argument(
        "--no-python", action="store_true", help="refuse to run Python launch files (they are code)"
    )


def size_in_bytes(text: str) -> int:
    """``100M`` and the like. :raises argparse.ArgumentTypeError: anything else, or less than 4 KiB."""
    found = re.fullmatch(r"(\d+)([kKmMgG]?)", text)
    size = int(found[1]) << {"": 0, "k": 10, "m": 20, "g": 30}[found[2].lower()] if found else 0
    if size < 4096:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 500K, 100M or 2G (4K at least)")
    return size


def _add_running(group: argparse._ArgumentGroup) -> None:
    group.add_argument("-n", "--noninteractive", action="store_true", help="the launch has no terminal")
    group.add_argument("-d", "--debug", action="store_true", help="more output from the launcher itself")
    group.add_argument(
        "--restart-expiring",
        action="store_true",
        help="shortly before a certificate or permissions end: end the launch in order, renew them, start it anew",
    )
    group.add_argument(
        "--watch",
        action="store_true",
        help="observe the DDS domain beside the launch, and tell what runs otherwise than planned",
    )
    group.add_argument(
        "--watch-report",
        metavar="FILE",
        type=as_path,
        help="what --watch tells, as JSON lines, beside the text",
    )
    group.add_argument(
        "--watch-accept",
        metavar="NODE",
        action="append",
        default=[],
        help="with --watch: may run beside the plan, such as '/_ros2cli*' (repeatable)",
    )
    group.add_argument(
        "--log-limit",
        metavar="SIZE",
        type=size_in_bytes,
        help="begin a log file anew at this size (such as 100M; the one before stays as <name>.1); default: no limit",
    )
    group.add_argument(
        "-a",
        "--show-all-subprocesses-output",
        action="store_true",
        help="all output of the processes on the screen, by setting OVERRIDE_LAUNCH_PROCESS_OUTPUT",
    )
    group.add_argument(
        "--launch-prefix", metavar="COMMAND", help="put this before the commands of all processes"
    )
    group.add_argument(
        "--launch-prefix-filter", metavar="REGEX", help="only where the executable's name matches"
    )


def _add_recording(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--learn",
        metavar="DIR",
        type=as_path,
        help="run the launch, record what its nodes ask for, and write their manifests into DIR",
    )
    group.add_argument(
        "--learn-for",
        metavar="TIME",
        help="end the learning run when nothing new was asked for during TIME, such as 10s (default: at Ctrl-C)",
    )
    group.add_argument(
        "--learn-isolation",
        choices=("auto", "local", "none"),
        default="auto",
        help="keep the learning run in a network namespace, else on this machine (auto), only the latter, or not",
    )
    group.add_argument(
        "--learn-parameters",
        action="store_true",
        help="a second run with marker values decides which names come from which parameters",
    )
    group.add_argument(
        "--audit",
        action="store_true",
        help="run unsecured, and tell what the plan would refuse and what it grants that nobody asks for",
    )
    group.add_argument(
        "--audit-report", metavar="FILE", type=as_path, help="the audit as JSON, beside the text"
    )
    add_explain_option(group)


def add_explain_option(group: argparse._ArgumentGroup) -> None:
    """Also of ``ros2 launch``."""
    group.add_argument(
        "--no-explain-denials",
        action="store_true",
        help="do not record secured processes to explain what DDS refuses them",
    )


def _path_from_environment(variable: str) -> Path | None:
    value = os.environ.get(variable)
    return as_path(value) if value else None
