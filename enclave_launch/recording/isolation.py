"""A launch for learning kept apart from other robots and from other nodes of this machine. Changes our own process.

A learning run is a real run, unsecured: what it says must not reach a robot next door. A network namespace of its own
keeps everything in but devices; where that is not allowed (or nodes need the network), discovery stays on this machine
and in a DDS domain that nobody else uses. Both must happen before any thread or process is started.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import random
import socket
import struct
from enum import Enum

_NEW_USER, _NEW_NET = 0x10000000, 0x40000000  # linux/sched.h
_GET_FLAGS, _SET_FLAGS, _UP = 0x8913, 0x8914, 0x1  # linux/sockios.h, linux/if.h
# Those whose ports lie below the ephemeral ones (ROS 2 documentation, ROS_DOMAIN_ID).
_DOMAINS = range(1, 101)

DEVICES_STAY_REAL = "motors, sensors and device files are not isolated: what the nodes do to them is real"


class Isolation(str, Enum):
    """What keeps a launch apart; the value is the text for a reader."""

    NAMESPACE = "network namespace"
    LOCAL = "discovery on this machine only, in a DDS domain of its own"
    NONE = "nothing: it communicates with other nodes of its domain"


def isolate(wanted: str = "auto") -> Isolation:
    """Isolate this process (``auto``: a namespace if allowed, else local discovery); return what was done."""
    if wanted == "none":
        return Isolation.NONE
    if wanted == "auto" and _a_child_can() and _enter_namespace():
        return Isolation.NAMESPACE
    os.environ.update(local_discovery(os.environ.get("ROS_DOMAIN_ID", "0")))
    os.environ.pop("ROS_STATIC_PEERS", None)  # a peer that is named here is talked to all the same
    return Isolation.LOCAL


def local_discovery(domain_in_use: str) -> dict[str, str]:
    """Return variables for all releases: the first one since iron, the second one before."""
    others = [str(domain) for domain in _DOMAINS if str(domain) != domain_in_use]
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOCALHOST_ONLY": "1",
        "ROS_DOMAIN_ID": random.SystemRandom().choice(others),
    }


def _a_child_can() -> bool:
    """Return True if it works in a child: half of it, done to ourselves, could not be undone."""
    child = os.fork()
    if child == 0:
        os._exit(0 if _enter_namespace() else 1)
    return os.waitpid(child, 0)[1] == 0


def _enter_namespace() -> bool:
    """Enter a network namespace with its loopback up; as an ordinary user in a user namespace with the same user."""
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.geteuid(), os.getegid()
    if user == 0:
        entered = libc.unshare(_NEW_NET) == 0
    else:
        entered = libc.unshare(_NEW_USER | _NEW_NET) == 0 and _map_us(user, group)
    return bool(entered) and _loopback_up()


def _map_us(user: int, group: int) -> bool:
    try:
        for file, text in (
            ("setgroups", "deny"),
            ("uid_map", f"{user} {user} 1"),
            ("gid_map", f"{group} {group} 1"),
        ):
            with open(f"/proc/self/{file}", "w", encoding="ascii") as stream:
                stream.write(text)
    except OSError:
        return False
    return True


def _loopback_up() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            request = struct.pack("16sh22x", b"lo", 0)
            flags = struct.unpack("16sh22x", fcntl.ioctl(probe, _GET_FLAGS, request))[1]
            fcntl.ioctl(probe, _SET_FLAGS, struct.pack("16sh22x", b"lo", flags | _UP))
        except OSError:
            return False
    return True
