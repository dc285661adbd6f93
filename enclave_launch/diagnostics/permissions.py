"""Diagnostics of interfaces and of their permissions. Performs no I/O."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.source_location import SourceLocation
from enclave_common.words import counted, some_of
from enclave_launch.diagnostics import Code, Diagnostic

_INTERFACES = 6  # named in a message
_OTHER_NAME = "it could not start: give it another name or namespace"


_LEARN = (
    "let it run once with --learn, or name the folder of its source with --source; else describe it in a NoDL manifest "
    "(secure-nodl infer writes a first one), named with --nodl"
)
_NOT_MADE = (
    "correct the name in the launch file, or let the package install it; if it does, build it and let it run once "
    "with --learn"
)


def library_version(program: str, doubt: str, location: SourceLocation) -> Diagnostic:
    remedy = "compare them (secure-nodl library show), and keep a corrected copy in a folder for --library"
    return Diagnostic(Code.LIBRARY_VERSION, program, f"library document {doubt}", location, remedy)


def manifest_lacks(program: str, manifest: str, lacks: Sequence[str], place: SourceLocation) -> Diagnostic:
    text = (
        f"the manifest of {program} ({manifest}) lacks {counted(len(lacks), 'interface')} that another description "
        f"has, so {_they_are(lacks)} not permitted: {some_of(lacks, _INTERFACES, '; ')}"
    )
    remedy = "add what it needs to the manifest (secure-nodl infer --compare shows all)"
    return Diagnostic(Code.MANIFEST_LACKS, program, text, place, remedy)


def manifest_outdated(
    program: str,
    manifest: str,
    lacks: Sequence[str],
    vanished: Sequence[str],
    unknown: Sequence[str],
    place: SourceLocation,
) -> Diagnostic:
    """Report a manifest of inference. ``vanished``: what only it has; ``unknown``: what the source leaves open."""
    texts = []
    if lacks:
        texts.append(
            f"the manifest lacks, so {_they_are(lacks)} not permitted: {some_of(lacks, _INTERFACES, '; ')}"
        )
    if vanished:
        texts.append(f"only the manifest has: {some_of(vanished, _INTERFACES, '; ')}")
    if unknown:
        texts.append(f"the source leaves open: {some_of(unknown, _INTERFACES, '; ')}")
    since = f"the source of {program} has changed since its manifest ({manifest}) was written from it"
    remedy = "write the manifest again (secure-nodl infer -o), or remove it if the source says all"
    return Diagnostic(Code.MANIFEST_OUTDATED, program, "; ".join((since, *texts)), place, remedy)


def record_lacks(
    program: str, record: str, lacks: Sequence[str], unknown: Sequence[str], place: SourceLocation
) -> Diagnostic:
    texts = []
    if lacks:
        texts.append(
            f"lacks {counted(len(lacks), 'name')} that another description has, so {_they_are(lacks)} not permitted: "
            f"{some_of(lacks, _INTERFACES, '; ')}"
        )
    if unknown:
        texts.append(f"may lack what another description leaves open: {some_of(unknown, _INTERFACES, '; ')}")
    remedy = "record again while it is used: some names exist only while another one is subscribed"
    if lacks:
        remedy = f"--also unseen grants the names that were never seen; or {remedy}"
    text = f"the record of {program} ({record}) {'; it '.join(texts)}"
    return Diagnostic(Code.RECORD_LACKS, program, text, place, remedy)


def record_undecided(
    node: str, names: Sequence[str], parameters: Sequence[str], place: SourceLocation
) -> Diagnostic:
    """Report a coincidence. ``names``: what is granted; ``parameters``: whose value the recorded name had."""
    text = (
        f"node {node}: the recorded name may be fixed, or the value of {' or '.join(parameters)}; what is granted, as "
        f"no run decides: {', '.join(names)}"
    )
    remedy = "record it once more with another value of the parameter"
    return Diagnostic(Code.RECORD_UNDECIDED, node, text, place, remedy)


def descriptions_differ(
    program: str, other: str, differing: Sequence[str], place: SourceLocation
) -> Diagnostic:
    names = some_of(differing, _INTERFACES, "; ")
    text = f"{program}: its source and the library document ({other}) differ, the source is used: {names}"
    remedy = "correct the one that is wrong (secure-nodl library check shows all)"
    return Diagnostic(Code.DESCRIPTIONS_DIFFER, program, text, place, remedy)


def _they_are(names: Sequence[str]) -> str:
    return "they are" if len(names) != 1 else "it is"


def recording_incomplete(node: str, why: str, manifest: str, place: SourceLocation) -> Diagnostic:
    remedy = "record it again in a run that gets so far (--learn); runs are merged"
    return Diagnostic(
        Code.RECORDING_INCOMPLETE,
        node,
        f"node {node} is learnt incompletely ({manifest}): {why}",
        place,
        remedy,
    )


def configuration_unused(node: str, why: str, place: SourceLocation) -> Diagnostic:
    """Warn that a program does not take a configuration, or a part of it, as the user wrote it."""
    return Diagnostic(Code.CONFIGURATION_UNUSED, node, f"node {node}: {why}", place)


def action_remap_idle(node: str, rule: str, action: str, distro: str, place: SourceLocation) -> Diagnostic:
    """Warn that a rule for an action's name changes nothing before a release remaps whole actions."""
    text = (
        f"remap rule {rule} has no effect on action {action} of node {node}: {distro} remaps only the five names "
        f"below {action}/_action/, one by one"
    )
    return Diagnostic(Code.ACTION_REMAP_IDLE, node, text, place)


def interface_unknown(node: str, why: str, program: str, place: SourceLocation) -> Diagnostic:
    remedy = (
        "let it run once with --learn; grant what is known of the name as a wildcard with --accept-patterns; or "
        f"describe {program} in a NoDL manifest (--nodl), or the node in a policy file (--policy)"
    )
    return Diagnostic(Code.INTERFACE_UNKNOWN, node, f"node {node}: {why}", place, remedy)


def policy_answers(unknown: Diagnostic) -> Diagnostic:
    text = f"{unknown.text}; the policy file says what it may do"
    return Diagnostic(Code.POLICY_ANSWERS, unknown.subject, text, unknown.location)


def name_unremappable(node: str, name: str, place: SourceLocation) -> Diagnostic:
    """Report a name with ``__``, which rcl reads in a remap rule as a special name (``__node``, ``__ns``)."""
    text = f"node {node}: '{name}' contains '__', which no remap rule can name"
    return Diagnostic(Code.NAME_UNREMAPPABLE, node, text, place)


def no_manifest(subject: str, why: str, place: SourceLocation, *, not_made: bool = False) -> Diagnostic:
    remedy = _NOT_MADE if not_made else _LEARN
    return Diagnostic(Code.NO_MANIFEST, subject, f"no NoDL manifest for {subject}: {why}", place, remedy)


def node_name_unknown(subject: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(
        Code.NODE_NAME_UNKNOWN, subject, f"{subject}: {why}", place, "give it a name: set name="
    )


def node_name_impossible(node: str, why: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.NODE_NAME_IMPOSSIBLE, node, f"node {node}: {why}", place, _OTHER_NAME)


def pattern_accepted(node: str, operation: str, name: str, note: str, place: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.PATTERN_ACCEPTED, node, f"node {node} may {operation} {name}: {note}", place)


def permissions_large(enclave: str, text: str) -> Diagnostic:
    """Report large permissions in the words of ``keystore.formats.permissions_size``."""
    return Diagnostic(Code.PERMISSIONS_LARGE, enclave, text)


def policy_enclave_unused(path: str) -> Diagnostic:
    """Report an enclave of the policy file that this launch does not use; the file may serve several launches."""
    text = f"enclave {path} of the policy file is not used by this launch and was left out"
    return Diagnostic(Code.POLICY_ENCLAVE_UNUSED, path, text)


def policy_denies_need(
    denied: str, enclave: str, node: str, need: str, why: str, place: SourceLocation
) -> Diagnostic:
    """Report a denial of the policy file, which takes precedence, for a name that a manifest requests."""
    text = f"{denied} is denied in enclave {enclave}, but node {node} needs {need} ({why})"
    return Diagnostic(Code.POLICY_DENIES_NEED, node, text, place)


def policy_file(subject: str, text: str) -> Diagnostic:
    """Report an error of the policy file in the words of its reader, which knows the place."""
    return Diagnostic(Code.POLICY_FILE, subject, text)
