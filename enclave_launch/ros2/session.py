"""The enclaves of one secured launch under upstream's engine.

Kept in the launch context, so that several launches in one program stay apart. ``enter`` is called for every process
just before it starts and returns when its enclave is complete on disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from enclave_launch.process import ResolvedComponent, ResolvedProcess
from enclave_launch.runtime.gate import EnclaveGate, Grant

KEY = "enclave_launch_session"


class EnclaveSession:
    """``gate`` decides; ``environment`` is for every process of the launch."""

    def __init__(self, gate: EnclaveGate) -> None:
        self._gate = gate

    def install(self, context: Any) -> None:
        context.extend_globals({KEY: self})

    def enter(self, process: ResolvedProcess, components: Sequence[ResolvedComponent] = ()) -> Grant:
        """:raises EnclaveLaunchError: not foreseen in the plan, or its enclave cannot be completed."""
        return self._gate.ensure(process)


def session_of(context: Any) -> EnclaveSession | None:
    session = context.get_locals_as_dict().get(KEY)
    return session if isinstance(session, EnclaveSession) else None
