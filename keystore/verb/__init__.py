"""``secure-keystore``: one file per verb, with ``OPTIONS``, ``run`` (one call, one report), and ``SETTINGS`` of its
parser where it has any.

Exit status: 0 done or all well; 1 an error, or findings of ``verify``; 2 wrong usage or input; 3
something ends soon and 4 something has ended (``status``); 75 the keystore is in use; 130 interrupted.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from importlib import import_module

from enclave_common.command_line import (
    CommandParser,
    add_absent_verb,
    add_verbosity,
    add_version,
    complete,
    complete_with,
    guarded,
    parsers,
    verb_head,
)
from enclave_common.terminal import safe_output
from keystore.errors import KeystoreError
from keystore.verb.common import FOLDED, add_table

VERBS = (
    "create", "create-enclave", "apply-policy", "list", "status", "verify", "renew", "remove", "export",
    "import", "units", "request", "sign", "fleet", "governance", "shares", "tool-enclave", "zenoh", "denials",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; errors become one line on stderr and an exit status, and nothing is printed twice."""
    with safe_output():
        parser = build_parser()
        complete(parser, _offer)
        arguments = parser.parse_args(argv)
        return guarded("secure-keystore", lambda: int(arguments.run(arguments)), KeystoreError)


def _offer(parser: argparse.ArgumentParser) -> None:
    existing = (each for each in parsers(parser) if not each.prog.endswith("create-enclave"))
    complete_with(existing, "enclaves", _enclaves)


def _enclaves(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    try:
        from keystore.steps.provisioning import list_enclaves  # cryptography

        return list_enclaves(parsed_args.keystore)
    except KeystoreError:
        return []


def build_parser() -> argparse.ArgumentParser:
    """Build one subparser for each verb, described by the head of its file."""
    parser = CommandParser(
        prog="secure-keystore",
        description="Create, check, renew and deploy SROS2 keystores. What was interrupted is completed by the same "
        "command.",
    )
    add_version(parser)
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for name in VERBS:
        try:
            module = import_module(f"keystore.verb.{name.replace('-', '_')}")
        except ModuleNotFoundError as error:
            add_absent_verb(verbs, name, error)
            continue
        settings = {**verb_head(module.__doc__)._asdict(), **getattr(module, "SETTINGS", {})}
        verb = verbs.add_parser(name, **settings)
        add_table(verb, module.OPTIONS)
        if name != "create":
            verb.fold(FOLDED, "secure-keystore create --help")
        verb.set_defaults(run=module.run)
    add_verbosity(parser)
    return parser
