"""Create enclaves: key, certificate and permissions that grant nothing, unless --allow-all.

Existing enclaves keep keys and permissions; what is missing or expired is created again.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import FLAG
from keystore.steps.provisioning import create_enclaves
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("enclaves ENCLAVE", {"nargs": "+"}, "absolute name, such as /front/camera"),
    ("--allow-all", FLAG, "grant every topic, service and action"),
    common.DOMAINS,
    *common.PROVISIONING,
)


def run(arguments: argparse.Namespace) -> int:
    """Create the enclaves, and print which are new. Returns 0."""
    options = common.provision_options(arguments, domains=common.domains(arguments))
    report = create_enclaves(
        arguments.keystore, arguments.enclaves, allow_all=arguments.allow_all, options=options
    )
    common.print_report(report, arguments)
    return 0
