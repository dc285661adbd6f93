"""Reads the settings ``X-...`` of generated systemd units, which systemd itself ignores."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from keystore.disk import layout

MARK = "Written by secure-plan export"
"""In the first line of every generated file: such files are replaced and removed, others never."""
NODE_KEY = "X-Node"
ENCLAVE_KEY = "X-Enclave"
NO_CRL = "none"
"""Content of the credential ``crl.pem`` while the keystore has no CRL."""


class Unit(NamedTuple):
    """A generated unit.

    Attributes:
        name: Its file name.
        target: The target that it is part of; of a target, its own name.
        node: Fully qualified name of the node, or the process's name.
        enclave: None if the process has none.
        keystore: Where its enclave is.
        reads_crl: It loads the CRL of its enclave.
        wants: Of a target, the units it wants, in order.
    """

    name: str
    target: str
    node: str | None = None
    enclave: str | None = None
    keystore: str | None = None
    reads_crl: bool = True
    wants: tuple[str, ...] = ()

    @property
    def is_process(self) -> bool:
        """Return True for the service of a process of the launch."""
        return self.node is not None

    def is_called(self, name: str) -> bool:
        """Return True if ``name`` is the unit, its target, its node or its enclave."""
        files = (self.name, self.target)
        stems = (self.name.removesuffix(".service"), self.target.removesuffix(".target"))
        return name in (*files, *stems, self.node, self.enclave)


def parse_unit(name: str, text: str) -> Unit | None:
    """Return the unit in the file ``name``, None if we did not generate it."""
    lines = text.splitlines()
    if not lines or MARK not in lines[0]:
        return None
    settings = [line.partition("=")[::2] for line in lines if "=" in line and not line.startswith("#")]
    if name.endswith(".target"):
        wants = tuple(value for key, value in settings if key in ("Wants", "BindsTo"))
        return Unit(name, name, wants=wants)
    values = dict(settings)
    sources = dict(value.split(":", 1) for key, value in settings if key == "LoadCredential" and ":" in value)
    key = sources.get(layout.KEY, "").replace("%%", "%")
    keystore, _, place = key.partition(f"/{layout.ENCLAVES}/")
    enclave = "/" + place.removesuffix(layout.KEY).strip("/") if place else None
    return Unit(
        name,
        values.get("PartOf", ""),
        values.get(NODE_KEY) or None,
        values.get(ENCLAVE_KEY, enclave),
        keystore or None,
        enclave is None or layout.ENCLAVE_CRL in sources,
    )


def in_restart_order(units: Iterable[Unit]) -> list[Unit]:
    """Return the services of processes in the order in which their targets want them."""
    listed = list(units)
    order = [name for unit in listed for name in unit.wants]
    place = {name: number for number, name in enumerate(order)}
    processes = [unit for unit in listed if unit.is_process]
    return sorted(processes, key=lambda unit: place.get(unit.name, len(place)))
