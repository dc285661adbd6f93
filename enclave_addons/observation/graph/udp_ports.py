"""Find the local process that receives at a UDP address: ``/proc/net/udp`` has the socket, ``/proc/<pid>/fd`` who holds
it. For participants that do not say their pid, as secured ones on Cyclone DDS. Acts.

Only processes whose descriptors may be read are found: of the same user, or all for root.
"""

from __future__ import annotations

import os
import re
import socket
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from ipaddress import ip_address
from pathlib import Path

# Of Cyclone DDS's __NetworkAddresses.
_LOCATOR = re.compile(r"udp6?/\[?([0-9a-fA-F.:]+?)\]?:(\d+)(?:@\d+)?\Z")
_FORMATS = {"udp": 4, "udp6": 16}
_SOCKET = re.compile(r"socket:\[(\d+)\]\Z")


class UdpPorts:
    """As they are when first read."""

    def pid(self, locators: Iterable[str]) -> int | None:
        """Return the one process that receives at one of ``locators``, such as ``udp/192.0.2.2:7411@4``, or None."""
        addresses = [
            (match[1], int(match[2])) for each in locators if (match := _LOCATOR.match(each.strip()))
        ]
        inodes = {
            inode
            for address, port in addresses
            if _is_ours(address)
            for bound, inode in self._sockets.get(port, ())
            if bound in (address, "0.0.0.0", "::")
        }
        pids = {pid for inode in inodes for pid in self._holders.get(inode, ())}
        return pids.pop() if len(pids) == 1 else None

    @cached_property
    def _sockets(self) -> dict[int, list[tuple[str, str]]]:
        found: dict[int, list[tuple[str, str]]] = {}
        for name, size in _FORMATS.items():
            for fields in _rows(Path("/proc/net", name)):
                address, port = fields[1].split(":")
                found.setdefault(int(port, 16), []).append((_address(address, size), fields[9]))
        return found

    @cached_property
    def _holders(self) -> dict[str, set[int]]:
        found: dict[str, set[int]] = {}
        for process in os.scandir("/proc"):
            if process.name.isdigit():
                for inode in _sockets_of(process.path):
                    found.setdefault(inode, set()).add(int(process.name))
        return found


def _rows(path: Path) -> Iterator[list[str]]:
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError:  # a kernel without IPv6
        return
    yield from (line.split() for line in lines[1:])


def _address(digits: str, size: int) -> str:
    """Read an address: the kernel prints words of 32 bits in the machine's own order (proc(5))."""
    raw = bytes.fromhex(digits)
    words = (raw[at : at + 4] for at in range(0, size, 4))
    return str(ip_address(b"".join(w[::-1] if sys.byteorder == "little" else w for w in words)))


def _sockets_of(process: str) -> Iterator[str]:
    with suppress(OSError):  # it has ended, or belongs to another user
        for each in os.scandir(f"{process}/fd"):
            with suppress(OSError):  # closed meanwhile
                if match := _SOCKET.match(os.readlink(each.path)):
                    yield match[1]


def _is_ours(address: str) -> bool:
    """Return True if this machine (this network namespace) has the address, which no other machine can bind."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((address, 0))
    except OSError:
        return False
    return True
