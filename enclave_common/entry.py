"""The installed commands. Each imports its program here, so that an interruption or a missing package during the import
ends in one line as it does later."""

from __future__ import annotations

import sys
from importlib import import_module


def secure_launch() -> int:
    """Run ``secure-launch``."""
    return run("secure-launch", "enclave_launch.verb.secure_launch")


def secure_keystore() -> int:
    """Run ``secure-keystore``."""
    return run("secure-keystore", "keystore.verb")


def secure_nodl() -> int:
    """Run ``secure-nodl``."""
    return run("secure-nodl", "nodl.verb")


def run(command: str, module: str) -> int:
    """Import the program ``module`` and run its ``main`` as ``command``. Return the exit status."""
    try:
        import_module("enclave_common.own_packages").prefer_own_nodl()
        guarded = import_module("enclave_common.command_line").guarded
        return int(guarded(command, lambda: int(import_module(module).main())))
    except KeyboardInterrupt:  # while that module was imported
        print(f"{command}: interrupted", file=sys.stderr)
        return 130
