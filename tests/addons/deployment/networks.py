"""Two network namespaces on one machine, joined by a virtual cable: hosts that share nothing but it.

Made in a user namespace of our own, so that no privilege is needed and nothing of the machine changes. Where that is
not permitted (some container engines) there is one network, loopback, for both.
"""

from __future__ import annotations

import contextlib
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_LONGEST = "120"  # seconds; then they are gone, whatever happened to us
_CYCLONE = """<CycloneDDS><Domain Id="any"><General><Interfaces>{interface}</Interfaces>
<AllowMulticast>{multicast}</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>
<Peers>{peers}</Peers></Discovery></Domain></CycloneDDS>"""


@dataclass(frozen=True)
class Network:
    """``prefix`` runs a command there; ``address`` and ``peers`` for a DDS configuration."""

    prefix: tuple[str, ...]
    address: str
    peers: tuple[str, ...]

    @property
    def probe_environment(self) -> tuple[tuple[str, str], ...]:
        """For the probe of Fast DDS."""
        other = next((one for one in self.peers if one != self.address), self.address)
        return ("PROBE_ADDRESS", self.address), ("PROBE_PEER", other)

    @property
    def cyclonedds_uri(self) -> str:
        name = "lo" if self.address == "127.0.0.1" else "eth"
        peers = "".join(f'<Peer Address="{one}"/>' for one in self.peers)
        return _CYCLONE.format(
            interface=f'<NetworkInterface name="{name}"/>', multicast="false", peers=peers
        ).replace("\n", "")


LOOPBACK = Network((), "127.0.0.1", ("127.0.0.1",))


@contextlib.contextmanager
def two_networks() -> Iterator[tuple[Network, Network]]:
    """Both of them the loopback where namespaces are not permitted."""
    with contextlib.ExitStack() as stack:
        try:
            one, two = _joined(stack)
        except (OSError, subprocess.CalledProcessError):
            one = two = LOOPBACK
        yield one, two


def _joined(stack: contextlib.ExitStack) -> tuple[Network, Network]:
    first = _holder(stack, ("unshare", "--user", "--map-root-user", "--net"))
    enter = ("nsenter", "--target", str(first), "--user", "--preserve-credentials", "--net")
    second = _holder(stack, (*enter, "unshare", "--net"))
    both = [enter, (*enter[:2], str(second), *enter[3:])]
    _run(*enter, "ip", "link", "add", "eth", "type", "veth", "peer", "name", "eth", "netns", str(second))
    addresses = ("10.77.0.1", "10.77.0.2")
    for prefix, address in zip(both, addresses, strict=True):
        for command in (
            ("link", "set", "lo", "up"),
            ("address", "add", f"{address}/24", "dev", "eth"),
            ("link", "set", "eth", "up"),
            ("route", "add", "224.0.0.0/4", "dev", "eth"),
        ):
            _run(*prefix, "ip", *command)
    return tuple(Network(prefix, address, addresses) for prefix, address in zip(both, addresses, strict=True))  # type: ignore[return-value]


def _holder(stack: contextlib.ExitStack, command: tuple[str, ...]) -> int:
    """A process that keeps the namespace alive; its id."""
    held = subprocess.Popen([*command, "sleep", _LONGEST])
    stack.callback(held.wait)
    stack.callback(held.kill)
    ours = _network_of("self")
    for _ in range(200):
        if held.poll() is not None:
            raise OSError("namespaces are not permitted here")
        # Of ``unshare`` itself before it has done its work, the namespace is the one that it came from.
        if Path(f"/proc/{held.pid}/comm").read_text().strip() == "sleep" and _network_of(held.pid) != ours:
            return held.pid
        time.sleep(0.05)
    raise OSError("no namespace was made in time")


def _network_of(pid: int | str) -> str:
    return str(Path(f"/proc/{pid}/ns/net").readlink())


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, timeout=30)
