"""Create a keystore, or complete one whose creation was interrupted.

Identity and permissions get separate CAs. A complete keystore is left as it is.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from keystore.formats.validity import DEFAULT_LIFETIME, parse_end, utc_now
from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``secure-keystore create``."""
    common.add_keystore(parser)
    parser.add_argument(
        "--domain-id", metavar="IDS", default="0", help="domains of the governance: 0, 0-10, 3,7 or all"
    )
    parser.add_argument(
        "--governance", metavar="FILE.yaml", type=Path, help="governance instead of SROS2's default"
    )
    parser.add_argument(
        "--curve", choices=("P-256", "P-384"), default="P-256", help="P-384 works on Fast DDS only"
    )
    parser.add_argument("--ca-valid-for", metavar="TIME", default="10y", help="validity of the CAs (10y)")
    common.add_validity(parser)
    for which in ("identity", "permissions"):
        parser.add_argument(f"--{which}-ca-name", metavar="CN", help=f"common name of the {which} CA")
        parser.add_argument(
            f"--{which}-ca", metavar=("CERT", "KEY"), nargs=2, type=Path,
            help="import an existing CA; KEY is a PEM file, or a file with a pkcs11: URI",
        )  # fmt: skip
    parser.add_argument(
        "--external-identity-ca", metavar="CERT", type=Path,
        help="certificates come from this CA (Vault, step-ca ...), by secure-keystore request and sign --issued",
    )  # fmt: skip
    parser.add_argument(
        "--encrypt-ca-keys", action="store_true", help="encrypt new CA keys with the passphrase"
    )
    common.add_subjects(parser)
    common.add_change(parser)


def run(arguments: argparse.Namespace) -> int:
    """Create or complete the keystore, and print what was made. Returns 0."""
    from keystore.formats.domains import Domains
    from keystore.formats.governance_yaml import load_governance_yaml
    from keystore.formats.role import Role
    from keystore.formats.subject import SubjectScheme
    from keystore.signing.authority import Curve
    from keystore.steps.creation import CreateOptions, ImportedCa, create_keystore

    validity = common.span(arguments)
    now = utc_now()
    lifetime = validity.lifetime
    if lifetime is None:
        lifetime = validity.until - now if validity.until else DEFAULT_LIFETIME
    given = vars(arguments)
    imported = {role: ImportedCa(*given[role.value]) for role in Role if given[role.value]}
    if arguments.external_identity_ca:
        imported[Role.IDENTITY] = ImportedCa(arguments.external_identity_ca)
    options = CreateOptions(
        domains=Domains.parse(arguments.domain_id),
        governance=load_governance_yaml(arguments.governance) if arguments.governance else None,
        subjects=SubjectScheme.COMPATIBLE if arguments.compatible_subjects else SubjectScheme.EXACT,
        curve=Curve(arguments.curve),
        ca_lifetime=parse_end(arguments.ca_valid_for, now) - now,
        lifetime=lifetime,
        backdate=validity.backdate,
        names={role: given[f"{role.value}_name"] for role in Role if given[f"{role.value}_name"]},
        imported=imported,
        encrypt_ca_keys=arguments.encrypt_ca_keys,
        now=now,
        **common.change(arguments),
    )
    report = create_keystore(arguments.keystore, options)
    if not arguments.quiet:
        common.print_lines(report.actions or ("the keystore is complete already, nothing was changed",))
    common.warn(report.warnings, arguments)
    return 0
