"""The options of ``secure-launch``, in the manner of ``ros2 launch``: tables, of which other commands take parts."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from enclave_common.command_line import (
    FLAG,
    PATH,
    PATHS,
    TEXT,
    TEXTS,
    CommandParser,
    FromProject,
    Option,
    OptionGroup,
    add_options,
    add_verbosity,
    add_version,
    one_of,
)
from enclave_common.files import read_text
from enclave_common.words import did_you_mean
from enclave_launch.enclave import EnclaveScope
from enclave_launch.errors import UsageError, translated
from enclave_launch.options import ResolveOptions
from enclave_launch.policy.node_permissions import ALSO
from enclave_launch.ros_rules.distro import DEFAULT, Distro, Versions, choose_release, read_versions
from enclave_launch.verb.completion import launch_words
from enclave_launch.verb.modes import modes

DESCRIPTION = """\
Launch a ROS 2 launch file (XML, YAML or Python), with or without ROS installed.
With --secure every process starts in an enclave with the least permissions that its nodes need: keys,
certificates and signed permissions are made from the launch file before anything starts. Processes of
one namespace share an enclave, unless --enclave-scope says otherwise.
"""

EPILOG = """\
examples:
  secure-launch --dry-run demo_nodes talker_listener.launch.xml       what would start, in which enclave
  secure-launch --secure --keystore ks demo_nodes talker_listener.launch.xml
  secure-launch --secure --keystore ks ./my.launch.py robot:=r1       a file, with a launch argument
  secure-launch -s demo_nodes talker_listener.launch.xml              the launch arguments of a file

exit status: 0 all ended well, 1 something failed (or a process could not be secured), 2 wrong usage
"""


def names_of(options: Iterable[Option]) -> frozenset[str]:
    """Return the names by which the parsed values of options without a short form go."""
    return frozenset(written.split()[0].lstrip("-").replace("-", "_") for written, *_ in options)


SECURITY: tuple[Option, ...] = (
    ("--secure", FLAG, "give every process its enclave; refuse to start otherwise"),
    ("--keystore DIR", {**PATH, "configured": FromProject("keystore")},
     "keystore to use (default: ROS_SECURITY_KEYSTORE, or keystore in enclaves.yaml); created when it does not exist"),
    ("--provision-only", FLAG, "make keys, certificates and permissions as planned; start nothing"),
    ("--no-create-keystore", FLAG, "an absent keystore is an error"),
    ("--strategy", one_of("Enforce", "Permissive"), "ROS_SECURITY_STRATEGY of the processes (default: Enforce)"),
    ("--domain-id IDS", TEXT,
     "DDS domains of the permissions: N, N-M, or a list (default: for each enclave those of its processes)"),
    ("--valid-for TIME", TEXT, "validity of new certificates and permissions, such as 90d"),
    ("--no-revoke", FLAG,
     "if rights are removed: do not revoke the previous certificate (it is usable until it expires)"),
    ("--expiring-within (--warn-expiry) TIME", {"default": "30d"},
     "warn when an enclave expires within this time (default: 30d)"),
    ("--compatible-subjects", FLAG,
     "certificate subjects as SROS2 writes them; see secure-keystore verify for the exposure"),
    ("--log-security DIR", PATH,
     "let each process on Fast DDS write its security log there (ROS_SECURITY_LOG_FILE); other middlewares have none"),
)  # fmt: skip
PASSPHRASE: tuple[Option, ...] = (
    ("--ca-passphrase-file FILE", PATH, "passphrase of encrypted CA keys"),
    ("--ca-passphrase-env NAME", TEXT, "the variable that holds it; no process of the launch sees it"),
)
LATE: tuple[Option, ...] = (
    ("--allow-late", FLAG, "provision actions that only exist at run time instead of refusing them"),
)
POLICY: tuple[Option, ...] = (
    ("--nodl FILE|DIR", {**PATHS, "configured": FromProject("nodl")},
     "use this NoDL manifest, or those of a folder, if definitions conflict (repeatable)"),
    ("--missing-nodl", one_of("infer", "analysis", "library", "error"),
     "nodes without a manifest: infer from their source, else take the library (default), only one of the two, "
     "or an error"),
    ("--library DIR", {**PATHS, "configured": FromProject("library")},
     "documents of your own that add to or correct the library (repeatable; docs/library.md)"),
    ("--source DIR", {**PATHS, "configured": FromProject("source")},
     "look for the sources of compiled nodes below this folder too (repeatable; docs/inference.md)"),
    ("--accept-patterns", FLAG,
     "accept names of which inference knows only a part, as wildcards; each is reported"),
    ("--enclave-scope",
     {**one_of("namespace", "node", "process", "launch"), "configured": FromProject("enclave-scope")},
     "which processes share an enclave (default: those of a namespace)"),
    ("--also WHAT", {**TEXTS, "choices": tuple(ALSO)},
     "grant every node also: clock (use_sim_time set at run time), logger-services, service-events "
     "(service introspection), unseen (names that a record lacks and another description has) (repeatable)"),
    ("--accept-prefix NAME", TEXTS,
     "a launch prefix that keeps the environment, although it is not known to (repeatable; 'shell' for shells)"),
    ("--accept-middleware NAME", TEXTS,
     "an RMW_IMPLEMENTATION that reads enclaves, although it is not known to (repeatable)"),
    ("--policy FILE|DIR", PATH,
     "SROS2 policy, or a folder of them, merged over the derived one; describes nodes that nothing else describes"),
)  # fmt: skip
LOOKING: tuple[Option, ...] = (
    ("--dry-run", FLAG, "print the plan; start nothing, write nothing"),
    ("--format", one_of("tree", "json", "policy"),
     "of the dry run: tree (default), json, or the derived SROS2 policy"),
    ("--strict", FLAG, "with --dry-run: exit status 1 if a secured start would be refused"),
    ("--explain ENCLAVE|NODE|TOPIC", TEXT,
     "why each permission is there: manifest, remap rule or built-in, with file and line"),
    ("--dump-params", FLAG, "print every node's parameters as one YAML file"),
)  # fmt: skip
DEMO = Path(__file__).parents[1] / "demo"
"""A workspace that comes with the package, for a first look."""
WRITTEN: tuple[Option, ...] = (
    ("--demo", FLAG, "look at a launch file that comes with this program: secure-launch --dry-run --demo"),
    ("-s --show-args --show-arguments", FLAG, "print the launch arguments that the file declares"),
    ("-p --print --print-description", {**FLAG, "dest": "print_description"}, "print the launch description"),
)


def distribution(text: str) -> str:
    """Return ``text`` if it names a distribution, or one of a day; raises argparse.ArgumentTypeError."""
    known = [distro.value for distro in Distro]
    name = text.partition("@")[0]
    if name not in known:
        question = did_you_mean(name, known)
        raise argparse.ArgumentTypeError(
            f"'{name}' is not a known distribution ({', '.join(known)}){question}"
        )
    try:
        choose_release(text, None)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


EVALUATION: tuple[Option, ...] = (
    ("--prefix DIR", PATHS, "ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)"),
    ("--distro NAME[@DATE]", {"type": distribution, "configured": FromProject("distro")},
     f"ROS distribution to behave like: {', '.join(distro.value for distro in Distro)} (default: ROS_DISTRO, else "
     f"{DEFAULT.value}). Installed packages decide the version, else the newest known patch release, or that of the "
     "date, as in jazzy@2025-03"),
    ("--versions FILE", PATH,
     "versions of ROS's packages on the robot: dpkg -l there, or secure-plan doctor --versions (in place of --distro)"),
    ("--allow-missing-packages", FLAG,
     "go on with a marked placeholder for packages that are not installed"),
    ("--no-python", FLAG, "refuse to run Python launch files (they are code)"),
)  # fmt: skip


def size_in_bytes(text: str) -> int:
    """Convert ``100M`` and the like to bytes; raises argparse.ArgumentTypeError, also below 4 KiB."""
    found = re.fullmatch(r"(\d+)([kKmMgG]?)", text)
    size = int(found[1]) << {"": 0, "k": 10, "m": 20, "g": 30}[found[2].lower()] if found else 0
    if size < 4096:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 500K, 100M or 2G (4K at least)")
    return size


RUNNING: tuple[Option, ...] = (
    ("-n --noninteractive", FLAG, "the launch has no terminal"),
    ("-d --debug", FLAG, "more output from the launcher itself"),
    ("--restart-expiring", FLAG,
     "shortly before a certificate or permissions expire: stop the launch, renew them, start it again"),
    ("--log-limit SIZE", {"type": size_in_bytes},
     "start a new log file at this size (such as 100M; the previous one becomes <name>.1); default: no limit"),
    ("-a --show-all-subprocesses-output", FLAG,
     "show all output of the processes on the screen (sets OVERRIDE_LAUNCH_PROCESS_OUTPUT)"),
    ("--launch-prefix COMMAND", TEXT, "put this before the commands of all processes"),
    ("--launch-prefix-filter REGEX", TEXT, "only if the executable's name matches"),
)  # fmt: skip
DENIALS: tuple[Option, ...] = (
    ("--no-explain-denials", FLAG, "do not record secured processes to explain what DDS refuses them"),
)


DAILY = (
    "--secure", "--keystore", "--dry-run", "--explain", "--show-args", "--learn", "--audit", "--watch",
    "--nodl", "--source", "--enclave-scope", "--prefix",
)  # fmt: skip
"""Options that ``--help`` shows; ``--help-all`` shows the others."""


def build_parser(*, first: bool = False) -> CommandParser:
    """Build the parser, its options grouped by the question they answer. ``first``: its help is for daily use."""
    parser = CommandParser(prog="secure-launch", description=DESCRIPTION, epilog=EPILOG)
    if first:
        parser.show_first(DAILY, build_parser)
    words = "PACKAGE LAUNCH_FILE | PATH [name:=value ...]"
    kind = {"nargs": "*", "metavar": words, "completer": launch_words}
    parser.add_options((("words", kind, "a launch file, and its launch arguments"),))
    add_version(parser)
    add_verbosity(parser)
    for title, options in (
        ("security", SECURITY),
        ("permissions", POLICY),
        ("looking without starting", (*LOOKING, *WRITTEN)),
        ("evaluating the launch file", EVALUATION),
        ("running", RUNNING),
        ("explaining denials", DENIALS),
        *((mode.TITLE, mode.OPTIONS) for mode in modes()),
    ):
        parser.add_options(options, title)
        if options is SECURITY:
            parser.add_one_of(PASSPHRASE, "passphrase of the CA keys")
            parser.add_options(LATE, "actions that a plan cannot foresee")
    return parser


def add_security_options(group: OptionGroup) -> list[argparse.Action]:
    """Add options that are also those of ``ros2 launch``, see ``ros2.option``."""
    return [
        *add_options(group, SECURITY),
        *add_options(group.add_mutually_exclusive_group(), PASSPHRASE),
        *add_options(group, LATE),
    ]


def resolve_options(options: argparse.Namespace) -> ResolveOptions:
    """Return what the options say about evaluation and permissions; raises UsageError."""
    for name in ("nodl", "source"):
        for path in getattr(options, name):
            if not os.path.exists(path):
                raise UsageError(f"--{name} {path}: no such file or directory")
    distro: str | None = options.distro
    versions: Versions = ()
    if options.versions is not None:
        distro, versions = _versions(options.versions, options.distro)
    return ResolveOptions(
        prefixes=tuple(options.prefix),
        manifests=tuple(options.nodl),
        policy=options.policy,
        distro=distro,
        versions=versions,
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


def _versions(file: Path, named: str | None) -> tuple[str, Versions]:
    with (
        translated(OSError, UsageError, f"--versions {file}: "),
        translated(ValueError, UsageError, f"--versions {file}: "),
    ):
        distro, versions = read_versions(read_text(file))
    if named not in (None, distro.value):
        raise UsageError(f"--versions {file} is of {distro}: it is given in place of --distro {named}")
    return distro.value, versions


def _launch_prefix(options: argparse.Namespace) -> Mapping[str, str]:
    pattern = options.launch_prefix_filter
    with translated(
        re.error, UsageError, f"--launch-prefix-filter {pattern!r} is not a regular expression: "
    ):
        re.compile(pattern or "")
    given = {"launch-prefix": options.launch_prefix, "launch-prefix-filter": pattern}
    return {name: value for name, value in given.items() if value is not None}
