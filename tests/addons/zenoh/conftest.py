"""One keystore, one router and a session for each enclave, shared by the tests of a module: opening them takes longer
than what they test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.zenoh.writing import write_zenoh
from keystore import (
    CreateOptions,
    Domains,
    EnclavePolicy,
    Operation,
    Policy,
    Profile,
    ProvisionOptions,
    Qualifier,
    Rule,
    apply_policy,
    create_keystore,
)
from tests.addons.zenoh import kit

Grants = dict[str, dict[str, tuple[str, ...]]]
SYSTEM: Grants = {
    "/talker": {"publish": ("/chatter", "/latched", "/rosout")},
    "/listener": {"subscribe": ("/chatter", "/latched", "/clock")},
    "/spy": {"publish": ("/gossip",), "subscribe": ("/gossip", "/chatter/below")},
    "/server": {"reply": ("/add", "/server/get_parameters", "/server/set_parameters")},
    "/client": {"request": ("/add", "/server/get_parameters")},
    "/robot/planner": {"execute": ("/plan",), "publish": ("/clock",)},
    "/robot/pilot": {"call": ("/plan",)},
    "/tools": {"subscribe": ("/fleet/*",), "publish": ("/fleet/*",)},
    "/elsewhere": {"publish": ("/chatter",), "subscribe": ("/chatter",)},
}
"""Operations of the policy by enclave; each may also publish and subscribe ``BARRIER``, behind which tests wait."""
BARRIER = "/barrier"
OTHER_DOMAIN = {"/elsewhere": Domains.single(1)}


def policy_of(system: Grants) -> Policy:
    def profile(grants: dict[str, tuple[str, ...]]) -> Profile:
        grants = {**grants, **{way: (*grants.get(way, ()), BARRIER) for way in ("publish", "subscribe")}}
        rules = (
            Rule(Operation(one), Qualifier.ALLOW, name) for one, names in grants.items() for name in names
        )
        return Profile("/", "n", tuple(rules))

    return Policy(tuple(EnclavePolicy(path, (profile(grants),)) for path, grants in sorted(system.items())))


def keystore_of(root: Path, system: Grants) -> Path:
    create_keystore(root, CreateOptions(durable=False))
    domains = {path: OTHER_DOMAIN.get(path, Domains.single(0)) for path in system}
    options = ProvisionOptions(Domains(((0, 1),)), enclave_domains=domains, durable=False)
    apply_policy(root, policy_of(system), options=options)
    write_zenoh(root, system, router=f"localhost:{kit.free_port()}", options=ProvisionOptions(durable=False))
    return root


class System:
    """The keystore, its router while the module runs, and one session for each enclave that is asked for."""

    def __init__(self, keystore: Path):
        self.keystore = keystore
        self.router = kit.router(keystore)
        self._sessions: dict[str, Any] = {}
        self._kept: list[Any] = []
        self._barriers: dict[str, kit.Heard] = {}

    def __getitem__(self, enclave: str) -> Any:
        if enclave not in self._sessions:
            self._sessions[enclave] = kit.opened(kit.session_text(self.keystore, enclave))
        return self._sessions[enclave]

    def hears(self, enclave: str, key: str) -> kit.Heard:
        """What arrives at the enclave under ``key``, until the module ends."""
        heard = kit.Heard()
        self._kept.append(self[enclave].declare_subscriber(key, heard))
        return heard

    def flush(self, sender: Any, receiver: str, domain: int = 0) -> None:
        """Everything that ``sender`` sent before has been delivered to ``receiver``, or dropped."""
        if receiver not in self._barriers:
            self._barriers[receiver] = self.hears(receiver, kit.topic(BARRIER, domain))
        assert kit.passes(sender, kit.topic(BARRIER, domain), self._barriers[receiver])

    def close(self) -> None:
        self._kept.clear()
        for session in (*self._sessions.values(), self.router):
            session.close()


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    made = System(keystore_of(tmp_path_factory.mktemp("zenoh") / "ks", SYSTEM))
    yield made
    made.close()
