"""An enclave for a tool: what it needs on its target, for a short time, below ``/tools``."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from enclave_common.terminal import quoted
from enclave_common.words import did_you_mean
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import keystore_at
from keystore.errors import InvalidInputError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.permissions_patterns import can_meet
from keystore.formats.policy import EnclavePolicy, Policy
from keystore.formats.subject import Half, guid_prefix
from keystore.formats.tool_needs import (
    FOLDER,
    TOOLS,
    is_tool_enclave,
    tool_enclave_name,
    tool_policy,
    tool_targets,
)
from keystore.steps.inventory import granted
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import apply_policy, provision

DEFAULT_LIFETIME = timedelta(hours=8)
"""A working day: what is forgotten on a laptop ends by itself."""


class ToolEnclave(NamedTuple):
    """An enclave made for a tool. ``environment``: what rcl reads, so that any command uses it; ``command``: an
    example of one."""

    enclave: str
    policy: EnclavePolicy
    ends: datetime
    environment: Mapping[str, str]
    command: str
    remove: str
    report: ProvisionReport


def create_tool_enclave(
    keystore: Path | str,
    tool: str,
    targets: Sequence[str] = (),
    *,
    name: str | None = None,
    options: ProvisionOptions | None = None,
) -> ToolEnclave:
    """Create it, or renew it with its full validity. ``name`` must be below ``/tools``. The keystore must exist.

    Raises InvalidInputError for a tool or target that cannot be, and what provisioning raises.
    """
    if tool not in TOOLS:
        raise InvalidInputError(f"{quoted(tool)} is not a tool we know; choose from {', '.join(TOOLS)}")
    kind = TOOLS[tool]
    chosen = tool_targets(kind, tuple(targets))
    enclave = validate_enclave_name(name or tool_enclave_name(kind, chosen))
    if not enclave.startswith(f"{FOLDER}/"):
        raise InvalidInputError(f"{quoted(enclave)}: enclaves of tools are below {FOLDER}/")
    given = options or ProvisionOptions()
    if given.lifetime is None and given.valid_until is None:
        given = given._replace(lifetime=DEFAULT_LIFETIME)
    if not kind.node:
        # Of two implementations the one with the smaller GUID begins, which Cyclone DDS must be.
        given = given._replace(guid_halves={enclave: Half.LOW})
    policy = tool_policy(kind, chosen, enclave)
    report = apply_policy(keystore, Policy((policy,)), options=given)
    root = resolve_root(keystore)
    report = report._replace(warnings=(*report.warnings, *_unknown_targets(root, chosen)))
    example = kind.example.format(
        keystore=shlex.quote(str(root)),
        enclave=enclave,
        target=chosen[0] if chosen else kind.target.value,
        targets=" ".join(chosen),
    )
    environment = tool_environment(root, enclave)
    words = " ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items())
    return ToolEnclave(
        enclave,
        policy,
        report.validities[enclave].not_after,
        environment,
        f"{words} {example}" if kind.node else example,
        f"secure-keystore remove {shlex.quote(str(root))} {enclave}",
        report,
    )


def _unknown_targets(root: Path, targets: Sequence[str]) -> Iterator[str]:
    """Say which targets no enclave of the keystore may use: a slip, or a robot whose permissions are elsewhere."""
    rules = (
        rule for enclave, found in granted(root).items() if not is_tool_enclave(enclave) for rule in found
    )
    known = sorted({rule.expression for rule in rules})
    for target in targets if known else ():
        if not any(can_meet(name, target) or name.startswith(f"{target}/") for name in known):
            yield f"no enclave of this keystore may use {quoted(target)}{did_you_mean(target, known)}"


WATCHER = f"{FOLDER}/watch"


def provide_watcher(keystore: Path | str, options: ProvisionOptions, *, as_ros_node: bool = False) -> str:
    """Make the enclave of ``secure-launch --watch``, once for a keystore: it reads discovery and nothing else."""
    policy = tool_policy(TOOLS["list" if as_ros_node else "observe"], (), WATCHER)
    chosen = options._replace(launch=None, enclave_domains={}, guid_halves={WATCHER: Half.LOW}, create=False)
    provision(keystore, [policy], options=chosen)
    return WATCHER


def tool_environment(root: Path | str, enclave: str) -> dict[str, str]:
    """Return the variables that put a tool into its enclave (rcl ``security.c``)."""
    return {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": os.path.abspath(root),
        "ROS_SECURITY_ENCLAVE_OVERRIDE": enclave,
    }


def enclaves_by_guid(keystore: Path | str) -> dict[int, str]:
    """Map the first 48 bits of the GUIDs of its participants (DDS-Security 9.3.3) to each enclave of the keystore."""
    view = keystore_at(keystore)
    names = {enclave: view.common_name(enclave) for enclave in view.enclaves()}
    return {guid_prefix(name): enclave for enclave, name in names.items() if name}
