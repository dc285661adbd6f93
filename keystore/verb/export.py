"""Write a bundle for one host: the chosen enclaves, no CA keys, no other enclaves' keys.

OUT is a new directory, or an archive when it ends in .tar or .tar.gz (the same keystore gives the same
bytes).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    common.add_keystore(parser)
    parser.add_argument("-o", "--output", metavar="OUT", type=Path, required=True)
    parser.add_argument(
        "--enclave", metavar="PATTERN", action="append", required=True,
        help="name or fnmatch pattern such as '/robot1/*'; repeatable",
    )  # fmt: skip
    parser.add_argument(
        "--public", choices=("link", "copy"), default="link",
        help="link: public/ once and links to it (default); copy: each enclave directory stands alone",
    )  # fmt: skip
    parser.add_argument(
        "--accept-exposures", action="store_true",
        help="export although verify finds exposures (errors are never exported)",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    from keystore.steps.bundle import PublicFiles, export

    names = export(
        arguments.keystore, arguments.output, arguments.enclave,
        public=PublicFiles(arguments.public), accept_exposures=arguments.accept_exposures,
    )  # fmt: skip
    common.print_lines(names)
    print(f"to pin its CAs where it is unpacked: {_pinned(arguments.keystore)}", file=sys.stderr)
    return 0


def _pinned(keystore: Path) -> str:
    """The command; a bundle has no register that could tell a foreign CA."""
    from keystore.disk.safe_files import resolve_root
    from keystore.disk.view import KeystoreView
    from keystore.formats.role import Role
    from keystore.signing.public_key import fingerprint

    view = KeystoreView(resolve_root(keystore))
    found = dict.fromkeys(fingerprint(ca.der) for role in Role for ca in view.ca_bundle(role))
    return " ".join(("secure-keystore verify BUNDLE", *(f"--require-ca {one}" for one in found)))
