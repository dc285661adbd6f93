"""Where the CA is: certify keys that hosts made (secure-keystore request); then export and import their bundle.

The enclaves must exist here with their permissions. Compare the printed fingerprints with those of the host: a
request proves who holds the key, not who asks.
"""

from __future__ import annotations

import argparse

from enclave_addons.deployment.host_keys import parse_requests
from enclave_addons.deployment.request_signing import accept_certificates, sign_requests
from enclave_common.command_line import PATH
from keystore.formats.given_file import read_given
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("requests FILE", PATH, "what secure-keystore request wrote"),
    common.REVOKE_OLD,
    ("--issued FILE", PATH,
     "PEM certificates that another identity CA issued for the requests: install these, issue none"),
    *common.PROVISIONING,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Certify the requests, and print for which keys. Returns 0."""
    requests = parse_requests(read_given(arguments.requests), str(arguments.requests))
    provisioning = common.provision_options(arguments)
    if arguments.issued is not None:
        issued = read_given(arguments.issued)
        accept_certificates(arguments.keystore, requests, issued, options=provisioning)
        common.print_lines(f"{one.enclave}: certificate taken, key SHA-256 {one.key}" for one in requests)
        return 0
    report = sign_requests(
        arguments.keystore, requests, revoke_old=arguments.revoke_old, options=provisioning
    )
    common.print_lines(f"{one.enclave}: key SHA-256 {one.key}" for one in requests)
    common.print_report(report, arguments)
    return 0
