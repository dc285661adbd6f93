"""A derived policy, written out and given to real SROS2, yields the same grants as our permissions.

``golden_permissions/derived.policy.xml`` was put through sros2 (see the README there); this test holds
that file to what we derive, ``tests/keystore/test_permissions_golden.py`` compares the grants.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from enclave_launch.policy import RunningNode, derive_policy
from keystore.formats.policy_xml import policy_xml

GOLDEN = Path(__file__).parent.parent / "keystore" / "golden_permissions" / "derived.policy.xml"


def derived_policy(node: Callable[..., RunningNode]) -> bytes:
    """Two nodes of one enclave under a pushed namespace, remapped, with every kind of interface."""
    place = {"namespace": "/tester", "enclave": "/tester"}
    mouth = node(
        *("pub chatter", "serve ~/reset", "action count", "sub /tf"),
        name="mouth",
        remap=("chatter:=blather", "~/reset:=/reset"),
        parameters={"use_sim_time": True},
        **place,
    )
    ear = node(
        *("sub chatter", "call /reset", "goal count"),
        name="ear",
        original="listener",
        remap=("chatter:=blather",),
        role="lifecycle_node",
        **place,
    )
    return policy_xml(derive_policy([mouth, ear], distro="jazzy").policy)


def test_the_golden_policy_is_what_we_derive(node: Callable[..., RunningNode]) -> None:
    assert derived_policy(node) == GOLDEN.read_bytes()
