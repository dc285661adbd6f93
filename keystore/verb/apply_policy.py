"""Give every enclave of an SROS2 policy file exactly its permissions, creating enclaves that are missing."""

from __future__ import annotations

import argparse

from enclave_launch.boundary.command_line import PATH
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("policy POLICY.xml", PATH, "SROS2 policy, version 0.2.0"),
    common.DOMAINS,
    *common.PROVISIONING,
)


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
