"""The process that receives at a UDP address of this machine is found; those of others and doubtful ones are not."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from enclave_addons.observation.graph.udp_ports import UdpPorts

ELSEWHERE = "203.0.113.7"  # documentation's (RFC 5737): of no machine


def has_ipv6() -> bool:
    """Whether the loopback interface has ::1: then it must be found, in CI as elsewhere."""
    addresses = Path("/proc/net/if_inet6")
    return addresses.exists() and f"{1:032x}" in addresses.read_text()


@pytest.mark.parametrize("bound", ["127.0.0.1", "0.0.0.0", "::1", "::"])
def test_the_holder_of_a_socket_is_found_by_its_address_and_port(bound: str) -> None:
    family = socket.AF_INET6 if ":" in bound else socket.AF_INET
    at = "[::1]" if ":" in bound else "127.0.0.1"
    with socket.socket(family, socket.SOCK_DGRAM) as held:
        if family == socket.AF_INET6 and not has_ipv6():
            pytest.skip("this kernel has no IPv6")
        held.bind((bound, 0))
        port = held.getsockname()[1]
        ours = f"udp{6 * (':' in bound) or ''}/{at}:{port}@4"
        assert UdpPorts().pid([ours]) == os.getpid()
        assert UdpPorts().pid([f"udp/{ELSEWHERE}:{port}@4", ours]) == os.getpid()
        assert UdpPorts().pid([f"udp/{ELSEWHERE}:{port}@4"]) is None, "the same port of another machine"
    assert UdpPorts().pid([ours]) is None, "it is closed"


def test_a_socket_bound_at_another_address_of_this_machine_is_not_taken() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        held.bind(("127.0.0.2", 0))
        port = held.getsockname()[1]
        assert UdpPorts().pid([f"udp/127.0.0.1:{port}"]) is None
        assert UdpPorts().pid([f"udp/127.0.0.2:{port}"]) == os.getpid()


def test_a_socket_that_two_processes_hold_is_of_neither() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as held:
        held.bind(("127.0.0.1", 0))
        locator = f"udp/127.0.0.1:{held.getsockname()[1]}"
        child = subprocess.Popen(
            [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=[held.fileno()]
        )
        try:
            assert UdpPorts().pid([locator]) is None
        finally:
            child.communicate(b"\n")
        assert UdpPorts().pid([locator]) == os.getpid()


@pytest.mark.parametrize(
    "locator", ["", "localprocess", "tcp/127.0.0.1:80", "udp/127.0.0.1", "udp/x:99999999"]
)
def test_what_is_no_locator_of_udp_names_nobody(locator: str) -> None:
    assert UdpPorts().pid([locator]) is None
