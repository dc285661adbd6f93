"""``secure-keystore``: one file per verb, with ``describe`` (arguments) and ``run`` (one call, one report).

Exit status: 0 done or all well; 1 an error, or findings of ``verify``; 2 wrong usage or input; 3
something ends soon and 4 something has ended (``status``); 75 the keystore is in use; 130 interrupted.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from enclave_launch.boundary.dependencies import missing_dependency
from enclave_launch.boundary.terminal import safe_output
from keystore.errors import KeystoreError
from keystore.formats.policy import PolicyError

VERBS = (
    "create", "create-enclave", "apply-policy", "list", "status", "verify", "renew", "remove", "export",
    "import", "request", "sign", "fleet", "governance", "shares",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Errors become one line on stderr and an exit status; nothing is printed twice."""
    with safe_output():
        return _main(argv)


def _main(argv: Sequence[str] | None) -> int:
    arguments = _parser().parse_args(argv)
    try:
        status: int = arguments.run(arguments)
        sys.stdout.flush()
        return status
    except (KeystoreError, PolicyError) as error:
        print(f"secure-keystore: error: {error}", file=sys.stderr)
        return error.exit_status if isinstance(error, KeystoreError) else 2
    except ImportError as error:
        text = missing_dependency(error)
        if text is None:
            raise
        print(f"secure-keystore: error: {text}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        # The reader of our output left; without this the interpreter complains again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        print("secure-keystore: interrupted; run the same command again to complete it", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="secure-keystore",
        description="Create, check, renew and deploy SROS2 keystores.",
        allow_abbrev=False,
    )
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for name in VERBS:
        module = import_module(f"keystore.verb.{name.replace('-', '_')}")
        summary = (module.__doc__ or "").strip()
        verb = verbs.add_parser(name, help=summary.splitlines()[0], description=summary, allow_abbrev=False)
        module.describe(verb)
        verb.set_defaults(run=module.run)
    return parser
