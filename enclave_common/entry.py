"""The installed commands. Each imports its program here, so that an interruption or a missing package during the import
ends in one line as it does later."""

from __future__ import annotations

import sys
from importlib import import_module


def secure_launch() -> int:
    """Run ``secure-launch``."""
    return _run("secure-launch", "enclave_launch.verb.secure_launch")


def secure_plan() -> int:
    """Run ``secure-plan``."""
    return _run("secure-plan", "enclave_launch.verb.secure_plan")


def secure_keystore() -> int:
    """Run ``secure-keystore``."""
    return _run("secure-keystore", "keystore.verb")


def secure_nodl() -> int:
    """Run ``secure-nodl``."""
    return _run("secure-nodl", "nodl.verb")


def _run(command: str, module: str) -> int:
    try:
        import_module("enclave_common.own_packages").prefer_own_nodl()
        guarded = import_module("enclave_common.command_line").guarded
        return int(guarded(command, lambda: int(import_module(module).main())))
    except KeyboardInterrupt:  # while that module was imported
        print(f"{command}: interrupted", file=sys.stderr)
        return 130
