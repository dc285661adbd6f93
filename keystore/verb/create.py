"""Create a keystore, or complete one whose creation was interrupted.

Identity and permissions get separate CAs. A complete keystore is left as it is.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import FLAG, PATH, TEXT
from keystore.errors import InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.governance_yaml import governance_of
from keystore.formats.role import Role
from keystore.formats.subject import SubjectScheme
from keystore.formats.validity import DEFAULT_LIFETIME, parse_end, utc_now
from keystore.steps.creation import CreateOptions, ImportedCa, create_keystore
from keystore.verb import common


def _imported(which: str) -> common.Table:
    return (
        (f"--{which}-ca-name CN", TEXT, f"common name of the {which} CA"),
        (f"--{which}-ca", {"metavar": ("CERT", "KEY"), "nargs": 2, **PATH},
         "import an existing CA; KEY is a PEM file, or a file with a pkcs11: URI"),
    )  # fmt: skip


OPTIONS: common.Table = (
    common.KEYSTORE,
    ("--domain-id IDS", {"default": "0"}, "domains of the governance: 0, 0-10, 3,7 or all"),
    ("--governance FILE", PATH, "governance instead of SROS2's default, as YAML or XML"),
    ("--ca-valid-for TIME", {"default": "10y"}, "validity of the CAs (10y)"),
    common.VALIDITY,
    *_imported("identity"),
    *_imported("permissions"),
    ("--external-identity-ca CERT", PATH,
     "certificates come from this CA (Vault, step-ca ...), by secure-keystore request and sign --issued"),
    common.ENCRYPTION,
    ("--compact", FLAG,
     "permissions name the parameter services of a node by one expression where no other node lies below it: Fast DDS "
     "carries 63,736 bytes; also for a keystore that exists"),
    ("--no-compact", FLAG, "take --compact back"),
    *common.SUBJECTS,
    *common.CHANGE,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Create or complete the keystore, and print what was made. Returns 0."""
    now = utc_now()
    lifetime = parse_end(arguments.valid_for, now) - now if arguments.valid_for else DEFAULT_LIFETIME
    given = vars(arguments)
    imported = {role: ImportedCa(*given[role.value]) for role in Role if given[role.value]}
    if arguments.external_identity_ca:
        if Role.IDENTITY in imported:
            raise InvalidInputError(
                "--identity-ca and --external-identity-ca name two identity CAs; leave out one: external is a CA whose "
                "key is elsewhere"
            )
        imported[Role.IDENTITY] = ImportedCa(arguments.external_identity_ca)
    options = CreateOptions(
        domains=Domains.parse(arguments.domain_id),
        governance=governance_of(arguments.governance) if arguments.governance else None,
        subjects=SubjectScheme.COMPATIBLE if arguments.compatible_subjects else SubjectScheme.EXACT,
        ca_lifetime=parse_end(arguments.ca_valid_for, now) - now,
        lifetime=lifetime,
        names={role: given[f"{role.value}_name"] for role in Role if given[f"{role.value}_name"]},
        imported=imported,
        encrypt_ca_keys=arguments.encrypt_ca_keys,
        compact=_compact(arguments),
        **common.change(arguments),
    )
    report = create_keystore(arguments.keystore, options)
    if not arguments.quiet:
        common.print_lines(report.actions or ("the keystore is complete already, nothing was changed",))
    common.warn(report.warnings, arguments)
    return 0


def _compact(arguments: argparse.Namespace) -> bool | None:
    if arguments.compact and arguments.no_compact:
        raise InvalidInputError("--compact and --no-compact contradict each other; leave out one")
    return True if arguments.compact else False if arguments.no_compact else None
