"""10,000 robots with 50 enclaves each: what their certificates cost, and what happens when a part does not answer.

    python bench/fleet.py [ROBOTS] [ENCLAVES]

Two parts. MEASURED is real: keystores of two sizes are made, renewed, exported, imported and asked for their status
with this very code, and one robot's share is multiplied; the two sizes show how far that is linear. SIMULATED is a
model of time only:

    a bundle        made at half of its life, or when the CA answers again; old and new are both good until the old ends
    a robot         asks once an hour while it reaches the server; it imports at once and restarts its units in order
    out of reach    begins once in 4 days on average and lasts 6 hours on average; one in 20 times it is 10 days. The
                    robot works on meanwhile. 1 robot in 1,000 never comes back and is not counted
    a restart       of one unit fails once in 20,000; then the robot's units keep what they had until somebody repairs
                    it, after 2 days on average
    what is down    the CA for 3 days, or the server that hands out bundles for 1 day, from the first renewal after
                    day 60 on, when it hurts most
    ended           robots with an enclave whose certificate has ended: on Cyclone DDS it falls silent

Lengths are exponential, the seed is fixed, 180 days are simulated. What is assumed stands here; nothing was taken from
a real fleet. One keystore is assumed for 20 robots each (its register is read and written whole), with the same CAs.
"""

from __future__ import annotations

import math
import random
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from enclave_addons.deployment.fleet import fleet_status  # noqa: E402
from enclave_addons.deployment.host_bundles import BundleOptions, export_hosts, pinned  # noqa: E402
from enclave_addons.deployment.importing import ImportOptions, import_bundle  # noqa: E402
from keystore.formats.domains import Domains  # noqa: E402
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule  # noqa: E402
from keystore.steps.options import ProvisionOptions  # noqa: E402
from keystore.steps.provisioning import provision  # noqa: E402
from keystore.steps.renewal import RenewOptions, renew  # noqa: E402

TOPICS = 10  # of each enclave
DAYS, STEP = 180, 1 / 24  # a robot asks once an hour
LIVES = (90, 30, 7, 1)
OFFLINE_EVERY, OFFLINE_FOR, REPAIR_FOR, LONG = 4.0, 0.25, 10.0, 1 / 20
RESTART_FAILS, REPAIRED_IN = 1 / 20_000, 2.0


# Measured


def provisioned(root: Path, robots: int, enclaves: int) -> None:
    rules = tuple(Rule(Operation.PUBLISH, Qualifier.ALLOW, f"/topic{number}") for number in range(TOPICS))
    policies = [
        EnclavePolicy(f"/robot{robot}/node{number}", (Profile("/", "node", rules),))
        for robot in range(robots)
        for number in range(enclaves)
    ]
    provision(root, policies, options=ProvisionOptions(domains=Domains.single(0), durable=False))


class Costs(NamedTuple):
    """Seconds of processor time and bytes, for one robot."""

    make: float
    renew: float
    export: float
    import_one: float
    status: float
    size: float


def measured(robots: int, enclaves: int, folder: Path) -> Costs:
    names = {f"robot{robot}": [f"/robot{robot}/*"] for robot in range(robots)}
    ca, options = folder / "ca", BundleOptions(durable=False)
    make = seconds(lambda: provisioned(ca, robots, enclaves))
    again = RenewOptions(everything=True, provisioning=ProvisionOptions(durable=False))
    renewal = seconds(lambda: renew(ca, options=again))
    made = export_hosts(ca, folder / "first", names, options=options)
    renew(ca, options=again)
    export = seconds(lambda: export_hosts(ca, folder / "out", names, options=options))
    pins = ImportOptions("robot0", pinned(made[0].manifest))
    import_bundle(folder / "host", made[0].path, options=pins)
    one = seconds(lambda: import_bundle(folder / "host", folder / "out/robot0.bundle"))
    status = seconds(lambda: fleet_status([folder / "out"], keystore=ca))
    size = (folder / "out/robot0.bundle").stat().st_size
    return Costs(make / robots, renewal / robots, export / robots, one, status / robots, size)


def seconds(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


def print_measured(robots: int, enclaves: int) -> None:
    print(
        f"measured: processor time for one robot with {enclaves} enclaves, and for {robots} robots on one core"
    )
    print(f"{'':28}{'keystore of 5':>14}{'of 20':>12}{f'{robots} robots':>18}")
    with tempfile.TemporaryDirectory() as name:
        costs = [measured(count, enclaves, Path(name) / str(count)) for count in (5, 20)]
    rows = ("keys, certificates, permissions", "renew", "export", "import on the host", "fleet status")
    for row, few, many in zip(rows, costs[0][:5], costs[1][:5], strict=True):
        total = "each on its own" if row.startswith("import") else f"{many * robots / 60:.1f} min"
        print(f"{row:31}{few * 1000:8.1f} ms{many * 1000:9.1f} ms{total:>18}")
    size = costs[1].size
    print(f"{'bundle':31}{costs[0].size / 1000:8.0f} kB{size / 1000:9.0f} kB{size * robots / 1e9:15.2f} GB")
    print()


# Simulated


class Trouble(NamedTuple):
    """What does not answer, for how many days, and from which day on."""

    name: str
    ca: float = 0.0
    server: float = 0.0
    since: float = 60.0

    def at_a_renewal(self, life: float) -> Trouble:
        """Beginning with the first renewal after day 60."""
        return self._replace(since=math.ceil(60 / (life / 2)) * life / 2)


TROUBLES = (
    Trouble("nothing fails"),
    Trouble("CA down for 3 days", ca=3.0),
    Trouble("server down for 1 day", server=1.0),
)


class Outcome(NamedTuple):
    """``worst``: most robots with something ended at the same time; ``ever``: robots that had that at all;
    ``stuck``: robots of which a unit did not come up again, at least once."""

    bundles: int
    worst: int
    ever: int
    stuck: int
    lost_hours: float


def simulate(robots: int, enclaves: int, life: float, trouble: Trouble) -> Outcome:
    trouble = trouble.at_a_renewal(life)
    releases = list(release_times(life, trouble))
    spells: list[tuple[float, float]] = []
    ever = stuck = imports = 0
    for robot in range(robots):
        chance = random.Random(robot)
        if chance.random() < 0.001:
            continue
        own, took, failed = ended_spells(chance, enclaves, life, releases, trouble)
        spells += own
        imports += took
        ever += bool(own)
        stuck += failed
    lost = sum(max(0.0, end - begin) for begin, end in spells) * 24
    return Outcome(imports, most_at_once(spells), ever, stuck, lost)


def release_times(life: float, trouble: Trouble) -> Iterator[float]:
    """When each bundle is made; one that falls into the CA's outage comes when it answers again."""
    at = 0.0
    while at < DAYS:
        if trouble.since <= at < trouble.since + trouble.ca:
            at = trouble.since + trouble.ca
        yield at
        at += life / 2


def ended_spells(
    chance: random.Random, enclaves: int, life: float, releases: list[float], trouble: Trouble
) -> tuple[list[tuple[float, float]], int, bool]:
    """When something of one robot was ended; how many bundles it took; whether a restart ever failed."""
    online = list(online_times(chance))
    spells, end, took, failed, free = [], life, 0, False, 0.0
    position, released, counted = 0, 1, 0.0
    while released < len(releases):
        reached = contact(online, position, max(releases[released], free), trouble)
        if reached is None:
            break
        at, position = reached
        while released + 1 < len(releases) and releases[released + 1] <= at:
            released += 1  # only the latest counts
        in_force = at
        if chance.random() < RESTART_FAILS * enclaves:
            failed = True
            free = in_force = at + chance.expovariate(1 / REPAIRED_IN)
        if in_force > end:
            spells.append((max(end, counted), min(in_force, DAYS)))
            counted = in_force
        end, took, released = releases[released] + life, took + 1, released + 1
    if end < DAYS:
        spells.append((max(end, counted), float(DAYS)))
    return spells, took, failed


def online_times(chance: random.Random) -> Iterator[tuple[float, float]]:
    at = 0.0
    while at < DAYS:
        until = at + chance.expovariate(1 / OFFLINE_EVERY)
        yield at, until
        away = REPAIR_FOR if chance.random() < LONG else OFFLINE_FOR
        at = until + chance.expovariate(1 / away)


def contact(
    online: list[tuple[float, float]], position: int, since: float, trouble: Trouble
) -> tuple[float, int] | None:
    """The first hour from ``since`` on at which robot and server both answer, and where it lies in ``online``."""
    while position < len(online):
        begin, until = online[position]
        at = max(begin, since)
        if trouble.since <= at < trouble.since + trouble.server:
            at = trouble.since + trouble.server
        at += STEP
        if at <= until:
            return (at, position) if at < DAYS else None
        position += 1
    return None


def most_at_once(spells: list[tuple[float, float]]) -> int:
    real = [(begin, end) for begin, end in spells if end > begin]
    changes = sorted([(begin, 1) for begin, _ in real] + [(end, -1) for _, end in real])
    now = most = 0
    for _, change in changes:
        now += change
        most = max(most, now)
    return most


def revocation(robots: int, trouble: Trouble) -> list[float]:
    """Days until each robot has a CRL that was published when the outage begins, sorted."""
    found = []
    for robot in range(robots):
        chance = random.Random(robot)
        if chance.random() < 0.001:
            continue
        reached = contact(list(online_times(chance)), 0, trouble.since, trouble)
        found.append(reached[0] - trouble.since if reached is not None else DAYS - trouble.since)
    return sorted(found)


def print_simulated(robots: int, enclaves: int) -> None:
    print(f"simulated: {robots} robots, {enclaves} enclaves each, {DAYS} days; robots with something ended")
    heads = f"{'bundles':>10}{'most at once':>15}{'ever':>8}{'unit stuck':>12}{'robot hours':>13}"
    print(f"{'life':>8}  {'trouble':22}{heads}")
    for life in LIVES:
        for trouble in TROUBLES:
            seen = simulate(robots, enclaves, life, trouble)
            print(
                f"{life:>6} d  {trouble.name:22}{seen.bundles:>10}{seen.worst:>15}{seen.ever:>8}{seen.stuck:>12}"
                f"{seen.lost_hours:>13.0f}"
            )
    print()
    print("hours until a revocation (a new CRL) has reached this share of the robots that still answer")
    print(f"{'trouble':24}{'50 %':>10}{'99 %':>10}{'all':>10}")
    for trouble in (TROUBLES[0], TROUBLES[2]):
        days = revocation(robots, trouble)
        shown = [days[len(days) // 2], days[int(len(days) * 0.99)], days[-1]]
        print(f"{trouble.name:24}" + "".join(f"{one * 24:>10.1f}" for one in shown))


def main() -> None:
    robots, enclaves = (int(word) for word in (*sys.argv[1:], *("10000", "50")[len(sys.argv) - 1 :]))
    print_measured(robots, enclaves)
    print_simulated(robots, enclaves)


if __name__ == "__main__":
    main()
