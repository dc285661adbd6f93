"""Say why processes of a keystore are silent on this machine: the first cause, and the repair that works here.

  secure-keystore why [ENCLAVE] KEYSTORE

Looks at the clock, owners, the CRL, domains, validity, the CAs, the other files, tokens, the middleware and discovery,
in this order, in the environment of this shell. Run it where the processes run, as their user. It reads only.

exit status: 0 no cause was found, 1 a cause was found, 2 wrong usage
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from enclave_addons.deployment.diagnosis import Diagnosis, diagnose, keystore_and_enclave
from keystore.errors import InvalidInputError
from keystore.verb import common

SETTINGS = {"usage": "secure-keystore why [options] [ENCLAVE] KEYSTORE"}
OPTIONS: common.Table = (
    (
        "words WORD",
        {"nargs": "+", "metavar": "[ENCLAVE] KEYSTORE"},
        "whose processes are silent (all), and the keystore",
    ),
    common.FORMAT,
)


def run(arguments: argparse.Namespace) -> int:
    """Print the first cause and its repair. Returns 1 if there is one."""
    if len(arguments.words) > 2:
        raise InvalidInputError("why takes one enclave at most, and the keystore")
    keystore, enclave = keystore_and_enclave(arguments.words)
    found = diagnose(keystore, enclave, os.environ, Path.cwd())
    content = {
        "keystore": str(found.keystore),
        "enclave": enclave,
        "passed": list(found.passed),
        "cause": asdict(found.cause) if found.cause else None,
    }
    common.print_answer(arguments, content, _lines(found))
    return 1 if found.cause else 0


def _lines(found: Diagnosis) -> Iterator[str]:
    if found.passed:
        yield f"well: {', '.join(found.passed)}"
    if found.cause is None:
        yield "nothing here keeps processes silent; ask the same on the machines of their peers"
        return
    yield f"cause ({found.cause.step}): {found.cause.text}"
    yield f"repair: {found.cause.repair}"
