"""``python -m enclave_addons.observation.graph.follow``: print the graph of a domain as a JSON line after each change.

It ends when standard input ends. It keeps DDS out of the process of a program that watches.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import sys
import time
from pathlib import Path

from enclave_addons.observation.graph.json_form import graph_document
from enclave_addons.observation.graph.observing import SOURCES, Where, in_own_process, observer
from nodl.errors import NoDLError

_BETWEEN = 1.0  # seconds between two lines at least; polls are more frequent
_INTERVAL = 0.2


def main() -> int:
    """Return 0 when the reader has gone, 1 with a message if the domain cannot be observed."""
    parser = argparse.ArgumentParser(prog="enclave_addons.observation.graph.follow")
    parser.add_argument("domain", type=int)
    parser.add_argument("--with", dest="source", choices=SOURCES, default="auto")
    parser.add_argument("--enclave-directory", type=Path)
    given = parser.parse_args()
    reader = os.dup(sys.stdin.fileno())  # multiprocessing closes standard input in the processes it starts
    where = Where(given.domain, given.source, given.enclave_directory)
    try:
        return in_own_process(lambda: _follow(where, reader))
    except (NoDLError, ImportError) as error:
        print(error, file=sys.stderr)
        return 1


def _follow(where: Where, reader: int) -> int:
    reported, last = -1, 0.0
    with observer(where, os.environ) as up:
        while not select.select([reader], [], [], _INTERVAL)[0]:
            changes = up.poll()
            if changes != reported and time.monotonic() - last >= _BETWEEN:
                reported, last = changes, time.monotonic()
                line = {"graph": graph_document(up.graph()), "forged": up.forged}
                try:
                    print(json.dumps(line), flush=True)
                except BrokenPipeError:
                    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                    return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
