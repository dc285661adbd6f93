"""``secure-keystore``: one file per verb, with ``OPTIONS``, ``run`` (one call, one report), and ``SETTINGS`` of its
parser where it has any.

Exit status: 0 done or all well; 1 an error, or findings of ``verify``; 2 wrong usage or input; 3
something ends soon and 4 something has ended (``status``); 75 the keystore is in use; 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.command_line import (
    CommandParser,
    add_verbosity,
    add_version,
    complete,
    guarded,
)
from enclave_common.terminal import safe_output
from keystore.errors import KeystoreError
from keystore.verb.common import FOLDED, add_table

VERBS = (
    "create", "create-enclave", "apply-policy", "list", "status", "verify", "renew", "remove", "governance", "shares",
    "tool-enclave",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; errors become one line on stderr and an exit status, and nothing is printed twice."""
    with safe_output():
        parser = build_parser()
        complete(parser)
        arguments = parser.parse_args(argv)
        return guarded("secure-keystore", lambda: int(arguments.run(arguments)), KeystoreError)


def build_parser() -> CommandParser:
    """Build one subparser for each verb, described by the head of its file."""
    parser = CommandParser(
        prog="secure-keystore",
        description="Create, check, renew and deploy SROS2 keystores. What was interrupted is completed by the same "
        "command.",
    )
    add_version(parser)
    parser.add_verbs()
    for verb, module in parser.add_verb_modules("keystore.verb", VERBS):
        add_table(verb, module.OPTIONS)
        if module.__name__ != "keystore.verb.create":
            verb.fold(FOLDED, "secure-keystore create --help")
    add_verbosity(parser)
    return parser
