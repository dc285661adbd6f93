"""Give every enclave of an SROS2 policy file exactly its permissions, creating enclaves that are missing."""

from __future__ import annotations

import argparse
from pathlib import Path

from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``secure-keystore apply-policy``."""
    common.add_keystore(parser)
    parser.add_argument("policy", metavar="POLICY.xml", type=Path, help="SROS2 policy, version 0.2.0")
    common.add_domains(parser)
    common.add_provisioning(parser)


def run(arguments: argparse.Namespace) -> int:
    """Apply the policy, and print which enclaves changed. Returns 0."""
    from keystore.formats.policy_xml import read_policy
    from keystore.steps.provisioning import apply_policy

    document = read_policy(arguments.policy)
    common.warn(document.warnings, arguments)
    wildcards = document.policy.wildcards()
    granted = (
        f"enclave {path} is granted by wildcard: {', '.join(names)}" for path, names in wildcards.items()
    )
    common.warn(granted, arguments)
    options = common.provision_options(arguments, domains=common.domains(arguments))
    report = apply_policy(arguments.keystore, document.policy, options=options)
    common.print_report(report, arguments)
    return 0
