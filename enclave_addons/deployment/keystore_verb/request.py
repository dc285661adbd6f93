"""On a host: make the keys of enclaves here, and a file with certificate requests for the CA.

The private keys stay on this host, in KEYSTORE.d/pending, until a bundle with their certificates is imported. With
--token the key is one that a PKCS#11 token holds: Fast DDS can use it, Cyclone DDS 0.10 cannot.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from enclave_addons.deployment.host_keys import RequestOptions, request, requests_text
from enclave_common.command_line import PATH, TEXT
from enclave_common.files import write_bytes
from keystore.errors import storage_errors
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("enclaves", {**common.ENCLAVES, "nargs": "+"}, ""),
    ("-o --output FILE", PATH, "where the requests go (standard output)"),
    ("--token URI", TEXT, "pkcs11: URI of the enclave's key in a token (RFC 7512)"),
    *common.SIGNING,
    common.LOCK,
)


def run(arguments: argparse.Namespace) -> int:
    """Make keys, print or write the requests for them. Returns 0."""
    options = RequestOptions(arguments.token, common.access(arguments), arguments.lock_timeout)
    made = request(arguments.keystore, arguments.enclaves, options=options)
    text = requests_text(made)
    if arguments.output is None:
        sys.stdout.write(text.decode())
    else:
        _write(arguments.output, text)
    for one in made:
        print(f"{one.enclave}: key SHA-256 {one.key}", file=sys.stderr)
    return 0


def _write(output: Path, text: bytes) -> None:
    with storage_errors("writing the requests"):
        write_bytes(output, text)
