"""Create enclaves: key, certificate and permissions that grant nothing, unless --allow-all.

Existing enclaves keep keys and permissions; what is missing or expired is made anew.
"""

from __future__ import annotations

import argparse

from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``secure-keystore create-enclave``."""
    common.add_keystore(parser)
    parser.add_argument("enclaves", metavar="ENCLAVE", nargs="+", help="absolute name, such as /front/camera")
    parser.add_argument("--allow-all", action="store_true", help="grant every topic, service and action")
    common.add_domains(parser)
    common.add_provisioning(parser)


def run(arguments: argparse.Namespace) -> int:
    """Create the enclaves, and print which are new. Returns 0."""
    from keystore.steps.provisioning import create_enclaves

    options = common.provision_options(arguments, domains=common.domains(arguments))
    report = create_enclaves(
        arguments.keystore, arguments.enclaves, allow_all=arguments.allow_all, options=options
    )
    common.print_report(report, arguments)
    return 0
