"""``./dev fuzz [TARGET [MINUTES]]``: every target, or one, in turn until the time is over (default: 10 minutes).

The first input at which a parser does something else than give a value or refuse is printed, made as small as possible;
the exit status is then 1.
"""

from __future__ import annotations

import contextlib
import random
import sys
import time

from hypothesis import HealthCheck, given, seed, settings

from tests.fuzz.inputs import damaged
from tests.fuzz.targets import Target, targets

ROUND = 1_000  # inputs of one target before it is another one's turn


def main(arguments: list[str]) -> int:
    known = targets()
    chosen = arguments[:1] or list(known)
    if chosen[0] not in known:
        print(f"no target {chosen[0]!r}; there are: {' '.join(known)}", file=sys.stderr)
        return 2
    until = time.monotonic() + 60 * float(arguments[1] if len(arguments) > 1 else 10)
    count = 0
    while time.monotonic() < until:
        for name in chosen:
            try:
                one_round(known[name])
            except Exception as error:  # whatever it is, it is what we look for
                print(f"{name}: {type(error).__name__}: {error}", file=sys.stderr)
                raise
            count += ROUND
            print(f"\r{count} inputs, last {name:20}", end="", file=sys.stderr, flush=True)
    print(f"\n{count} inputs, no fault", file=sys.stderr)
    return 0


def one_round(target: Target) -> None:
    @seed(random.randrange(2**32))
    @settings(max_examples=ROUND, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(damaged(target.seeds, target.words))
    def run(document: bytes) -> None:
        with contextlib.suppress(*target.refusals):
            target.run(document)

    run()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
