"""Explain what a Zenoh router refused, from its log: who, what, why, and the policy that allows it.

Zenoh reports a denial to neither side. Start the router with RUST_LOG=zenoh::net::routing::interceptor=trace (a router
that secure-launch starts inherits it, and secure-launch explains its log), and give its log here, or pipe it:

  RUST_LOG=zenoh::net::routing::interceptor=trace ros2 run rmw_zenoh_cpp rmw_zenohd 2>&1 | secure-keystore denials ks

exit status: 0 nothing was refused, 1 something was
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from enclave_addons.zenoh.denials import RouterLogExplainer
from enclave_common.command_line import PATH
from keystore.errors import InvalidInputError, printable
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("log LOG", {"nargs": "*", **PATH}, "its output, in order (default: stdin)"),
    common.FORMAT,
)


def run(arguments: argparse.Namespace) -> int:
    """Report each refusal once; return 1 if there is one. Raises a ``KeystoreError`` for what cannot be read."""
    explainer, found = RouterLogExplainer(arguments.keystore), []
    for said in filter(None, map(explainer.read, _lines(arguments.log))):
        found.append(said)
        if arguments.format == "text":
            common.print_lines(said.lines)
    if arguments.format == "json":
        common.print_json({"version": 1, "denials": [said._asdict() for said in found]})
    return 1 if found else 0


def _lines(logs: Iterable[Path]) -> Iterator[str]:
    files = list(logs)
    if not files:
        yield from (line.decode(errors="replace") for line in sys.stdin.buffer)
    for file in files:
        try:
            with file.open("rb") as opened:
                yield from (line.decode(errors="replace") for line in opened)
        except OSError as error:
            raise InvalidInputError(f"{printable(file)}: {error.strerror}") from None
