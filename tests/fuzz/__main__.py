"""``./dev fuzz [TARGET [MINUTES]]``: every target, or one, in turn until the time is over (default: 10 minutes).

The first input at which a parser does something else than give a value or refuse is printed, made as small as possible;
the exit status is then 1. ``dds-documents`` asks Cyclone DDS and Fast DDS of changed
documents, and prints the first that ``verify`` calls good though one of them grants something else than we read in it.
"""

from __future__ import annotations

import contextlib
import random
import sys
import tempfile
import time
from pathlib import Path

from hypothesis import HealthCheck, given, seed, settings

from tests.dds.conftest import cyclone_probe, domain, fastdds_probe
from tests.dds.differential import Laboratory
from tests.fuzz.inputs import damaged
from tests.fuzz.targets import Target, targets

DDS_DOCUMENTS, DOCUMENTS = "dds-documents", 200
ROUND = 1_000  # inputs of one target before it is another one's turn


def main(arguments: list[str]) -> int:
    known = targets()
    others = {DDS_DOCUMENTS: dds_documents}
    names = [*known, *others]
    chosen = arguments[:1] or names
    if chosen[0] not in names:
        print(f"no target {chosen[0]!r}; there are: {' '.join(names)}", file=sys.stderr)
        return 2
    until = time.monotonic() + 60 * float(arguments[1] if len(arguments) > 1 else 10)
    count = 0
    while time.monotonic() < until:
        for name in chosen:
            try:
                count += others[name]() if name in others else one_round(known[name])
            except Exception as error:  # whatever it is, it is what we look for
                print(f"{name}: {type(error).__name__}: {error}", file=sys.stderr)
                raise
            print(f"\r{count} inputs, last {name:20}", end="", file=sys.stderr, flush=True)
    print(f"\n{count} inputs, no fault", file=sys.stderr)
    return 0


def dds_documents() -> int:
    """Judge some documents; ``AssertionError`` with the first that is read in different ways."""
    with domain() as chosen, tempfile.TemporaryDirectory() as folder:
        verdicts = Laboratory(Path(folder), chosen).judge(
            random.randrange(2**32), DOCUMENTS, (cyclone_probe(), fastdds_probe())
        )
    assert not verdicts.differences, verdicts.differences[0]
    return verdicts.made


def one_round(target: Target) -> int:
    @seed(random.randrange(2**32))
    @settings(max_examples=ROUND, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(damaged(target.seeds, target.words))
    def run(document: bytes) -> None:
        with contextlib.suppress(*target.refusals):
            target.run(document)

    run()
    return ROUND


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
