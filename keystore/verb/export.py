"""Write a bundle for one host: the chosen enclaves, no CA keys, no other enclaves' keys.

OUT is a new directory, or an archive when it ends in .tar or .tar.gz (the same keystore gives the same
bytes).
"""

from __future__ import annotations

import argparse
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
    return 0
