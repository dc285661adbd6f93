"""Zenoh's configuration for 1,000 nodes with 20 interfaces each: size, and time from signed permissions to a router.

    python -m bench.zenoh [nodes] [interfaces]

Each node is in an enclave of its own. The last lines start a real router (eclipse-zenoh) with the file and measure what
a message costs on its way through it, with these rules and with the rules of two enclaves. Nothing is asserted.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

from enclave_addons.zenoh.grants import grants_of_policy
from enclave_addons.zenoh.rules import access_rules
from enclave_addons.zenoh.writing import write_zenoh
from keystore.formats.domains import Domains
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule
from keystore.steps.creation import CreateOptions, create_keystore
from keystore.steps.options import ProvisionOptions
from keystore.steps.provisioning import provision

_OPERATIONS = tuple(Operation)
_MESSAGES = 20_000


def policies(nodes: int, interfaces: int) -> list[EnclavePolicy]:
    """All six kinds of interfaces in turn; topics are shared by neighbours."""
    return [_policy(index, interfaces) for index in range(nodes)]


def _policy(index: int, interfaces: int) -> EnclavePolicy:
    names = [f"/robot{(index + i) // 20}/part{(index + i) % 20}/state{i}" for i in range(interfaces)]
    rules = [Rule(_OPERATIONS[i % 6], Qualifier.ALLOW, name) for i, name in enumerate(names)]
    if index < 2:
        rules.append(Rule(_OPERATIONS[index], Qualifier.ALLOW, "/chatter"))
    return EnclavePolicy(f"/robot{index}", (Profile("/", f"node{index}", tuple(rules)),))


def timed(what: str, function: Callable[[], Any]) -> Any:
    began = process_time()
    result = function()
    print(f"{what:60} {process_time() - began:8.2f} s CPU")
    return result


def main(nodes: int = 1000, interfaces: int = 20) -> None:
    wanted = policies(nodes, interfaces)
    domains = Domains.single(0)
    print(f"{nodes} nodes with {interfaces} interfaces each, one enclave for each")
    timed("rules of all enclaves (pure)", lambda: [
        access_rules(one.path, grants_of_policy(one), domains) for one in wanted])  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "ks"
        create_keystore(root, CreateOptions(durable=False))
        timed("provision (certificates and DDS permissions)", lambda: provision(
            root, wanted, options=ProvisionOptions(durable=False)))  # fmt: skip
        paths = [one.path for one in wanted]
        timed(
            "secure-keystore zenoh, for the first time",
            lambda: write_zenoh(
                root, paths, router="localhost:17447", options=ProvisionOptions(durable=False)
            ),
        )
        timed(
            "secure-keystore zenoh, nothing changed",
            lambda: write_zenoh(
                root, paths, router="localhost:17447", options=ProvisionOptions(durable=False)
            ),
        )
        _sizes(root)
        _router(root, "router with the rules of all")
        few = Path(folder) / "few"
        create_keystore(few, CreateOptions(durable=False))
        provision(few, wanted[:2], options=ProvisionOptions(durable=False))
        write_zenoh(few, paths[:2], router="localhost:17447", options=ProvisionOptions(durable=False))
        _router(few, "router with the rules of two")


def _sizes(root: Path) -> None:
    text = (root / "zenoh/router.json5").read_bytes()
    control = json.loads(text)["access_control"]
    keys = sum(len(rule["key_exprs"]) for rule in control["rules"])
    print(
        f"{'router.json5':60} {len(text) / 1e6:8.2f} MB, {len(control['rules'])} rules, {keys} key expressions"
    )
    sessions = [path.stat().st_size for path in root.glob("enclaves/**/zenoh.json5")]
    print(f"{'zenoh.json5 of a process':60} {sum(sessions) / len(sessions):8.0f} bytes")


def _router(root: Path, what: str) -> None:
    try:
        import zenoh
    except ImportError:
        print("eclipse-zenoh is not installed: no router")
        return
    router = timed(
        f"{what}: start", lambda: zenoh.open(zenoh.Config.from_file(str(root / "zenoh/router.json5")))
    )
    one, other = (
        zenoh.open(zenoh.Config.from_file(str(root / f"enclaves/robot{i}/zenoh.json5"))) for i in (0, 1)
    )
    came: list[int] = []
    key = "0/chatter/std_msgs::msg::dds_::String_/RIHS01_0"
    kept = other.declare_subscriber(key, lambda _: came.append(1))
    publisher = one.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
    while not came:
        publisher.put("first")
        time.sleep(0.01)
    came.clear()
    began, elapsed = process_time(), time.monotonic()
    for _ in range(_MESSAGES):
        publisher.put(b"x" * 100)
    while len(came) < _MESSAGES:
        time.sleep(0.001)
    spent, passed = process_time() - began, time.monotonic() - elapsed
    label = f"{what}: a message, both ends and router"
    print(f"{label:60} {spent / _MESSAGES * 1e6:8.1f} us CPU, {passed / _MESSAGES * 1e6:.1f} us")
    del kept, publisher
    for session in (one, other, router):
        session.close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
