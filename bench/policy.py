"""How long policies and permissions take: 1,000 nodes with 20 interfaces each, from values to bytes.

    python -m bench.policy [nodes] [interfaces]

Prints a table. The floor is the least that any implementation must do with the same names: put each
once into a set per enclave and sort it. The peer is SROS2's stylesheet from policy to permissions, where
the package ``sros2`` is importable (``PYTHONPATH``, ``AMENT_PREFIX_PATH``). Nothing is asserted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from datetime import datetime, timezone
from time import process_time

from enclave_common.source_location import SourceLocation
from enclave_launch.policy import RunningNode, derive_policy
from enclave_launch.report.explained import explain
from keystore.formats.domains import Domains
from keystore.formats.permissions import permissions_document
from keystore.formats.policy_xml import policy_xml
from keystore.formats.validity import Validity
from nodl.name_template import NameTemplate
from nodl.node_interface import Endpoint, EndpointKind, NodeInterface
from nodl.remap import RemapRules, parse_rule

NODES_PER_ENCLAVE = 20
KINDS = tuple(EndpointKind)


def nodes(count: int, interfaces: int) -> list[RunningNode]:
    """A mix of absolute, relative and private names, with a remap rule that matches in every node."""
    rules = RemapRules(process=(parse_rule("chatter0:=talk"), parse_rule("unused:=other")))
    return [_node(index, interfaces, rules) for index in range(count)]


def _node(index: int, interfaces: int, rules: RemapRules) -> RunningNode:
    source = SourceLocation("share/fleet/fleet.nodl.xml", index + 1)
    forms = ("chatter{}", "/fleet/state{}", "~/status{}", "sensors/range{}")
    endpoints = tuple(
        Endpoint(KINDS[i % len(KINDS)], NameTemplate.literal(forms[i % 4].format(i)), "x/msg/Y", source)
        for i in range(interfaces)
    )
    interface = NodeInterface("fleet", "worker", None, "worker", None, endpoints, source)
    namespace = f"/robot{index // NODES_PER_ENCLAVE}"
    return RunningNode(
        interface,
        "worker",
        f"worker{index}",
        namespace,
        rules,
        {},
        namespace,
        SourceLocation("fleet.launch.xml", index),
    )


def floor(fleet: list[RunningNode]) -> None:
    sets: dict[str, set[str]] = {}
    for node in fleet:
        names = sets.setdefault(node.enclave, set())
        for endpoint in node.interface.endpoints:
            names.add(f"{node.namespace}/{node.name}/{endpoint.name.parts[0]}")
    for names in sets.values():
        sorted(names)


def peer(policy: bytes) -> Callable[[], object] | None:
    """What ``ros2 security create_permission`` does with the policy before signing; ``None``: no sros2 here."""
    try:
        from sros2.policy import get_transport_template
    except (ImportError, OSError, KeyError):
        return None
    from lxml import etree

    stylesheet = etree.XSLT(etree.parse(str(get_transport_template("dds", "permissions.xsl"))))
    document = etree.fromstring(policy)
    return lambda: etree.tostring(stylesheet(document), pretty_print=True)


def best(action: Callable[[], object], repeat: int = 5) -> float:
    times = []
    for _ in range(repeat):
        start = process_time()
        action()
        times.append(process_time() - start)
    return min(times)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    interfaces = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    fleet = nodes(count, interfaces)
    derived = derive_policy(fleet, distro="jazzy")
    validity = Validity.starting(datetime.now(timezone.utc))
    enclaves = derived.policy.enclaves

    def all_permissions() -> None:
        for enclave in enclaves:
            permissions_document(f"CN={enclave.path}", enclave, validity=validity, domains=Domains.single(0))

    rules = sum(len(profile.rules) for enclave in enclaves for profile in enclave.profiles)
    base = best(lambda: floor(fleet))
    half = best(lambda: derive_policy(fleet[: count // 2], distro="jazzy"))
    rows = (
        ("floor: names into sets, sorted", base),
        ("derive_policy, half the nodes", half),
        ("derive_policy", best(lambda: derive_policy(fleet, distro="jazzy"))),
        (f"permissions of {len(enclaves)} enclaves", best(all_permissions)),
        ("policy as XML", best(lambda: policy_xml(derived.policy))),
        ("explain one node", best(lambda: explain(derived, "/robot0/worker0"))),
    )
    print(f"{count} nodes, {interfaces} interfaces each, {len(enclaves)} enclaves, {rules} rules")
    print(f"{'':38}{'CPU ms':>9}{'x floor':>10}")
    for label, seconds in rows:
        print(f"{label:38}{seconds * 1000:9.1f}{seconds / base:10.1f}")
    transform = peer(policy_xml(derived.policy))
    if transform is None:
        print(f"{'peer: sros2 permissions.xsl':38}  not available")
    else:
        seconds = best(transform, repeat=1)
        print(f"{'peer: sros2 permissions.xsl':38}{seconds * 1000:9.1f}{seconds / base:10.1f}")


if __name__ == "__main__":
    main()
