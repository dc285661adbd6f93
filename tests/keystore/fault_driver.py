"""Run as a program: some keystore work, with a fault at the N-th step that touches the file system.

    python -m tests.keystore.fault_driver WORK KEYSTORE FAULT N

The seam is Python's own audit hook: it sees every open, mkdir, rename, symlink, unlink, rmdir, chmod below the
keystore, wherever in the code it happens, and needs nothing in the code under test. FAULT is ``kill``
(the process is gone at once, as with SIGKILL), ``full`` or ``read-only`` (the step fails so).
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path

from keystore import (
    CreateOptions,
    KeystoreError,
    LaunchHold,
    RemoveOptions,
    RenewOptions,
    Role,
    Step,
    create_keystore,
    provision,
    remove,
    renew,
    roll_over,
)
from tests.keystore.kit import filled, options, policy

KILLED = 97
REPORTED = 3
NAMES = tuple(f"/robot{number % 5}/node{number}" for number in range(12))
_STEPS = {"open", "os.mkdir", "os.rename", "os.symlink", "os.remove", "os.rmdir", "os.chmod"}
_ERRORS = {"full": errno.ENOSPC, "read-only": errno.EROFS}


def install_fault(root: str, fault: str, at: int) -> Callable[[], int]:
    """Arm the fault; returns a function that tells how many steps were taken."""
    taken = 0

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal taken
        if event not in _STEPS or not str(arguments[0]).startswith(root):
            return
        if event == "open" and not _writes(arguments):
            return
        taken += 1
        if taken != at:
            return
        if fault == "kill":
            os._exit(KILLED)
        raise OSError(_ERRORS[fault], os.strerror(_ERRORS[fault]), str(arguments[0]))

    sys.addaudithook(hook)
    return lambda: taken


def _writes(arguments: tuple[object, ...]) -> bool:
    flags = arguments[2] if len(arguments) > 2 else 0
    return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))


def work(name: str, root: Path) -> None:
    if name == "create":
        create_keystore(root, CreateOptions(durable=False))
    elif name == "provision":
        filled(root, NAMES)
    elif name == "renew":
        renew(root, NAMES[:3], options=RenewOptions(new_keys=True, provisioning=options()))
    elif name == "repair":
        renew(root, options=RenewOptions(provisioning=options()))
    elif name == "remove":
        remove(root, NAMES[:2], options=RemoveOptions(durable=False))
    elif name == "take over":
        filled(root, NAMES[:6])
    elif name == "reduce":
        provision(root, [policy(one, "/other") for one in NAMES[:3]], options=options())
    elif name == "share":
        hold = LaunchHold(root, "/second.launch.xml")
        provision(root, [policy(one, "/other") for one in NAMES[:3]], options=options(launch=hold))
        hold.close()
    else:
        roll_over(root, Step(name), tuple(Role), options=options())


def main() -> int:
    name, root, fault, at = sys.argv[1:]
    taken = install_fault(root, fault, int(at))
    try:
        work(name, Path(root))
    except KeystoreError as error:
        print(error, file=sys.stderr)
        return REPORTED
    print(taken())
    return 0


if __name__ == "__main__":
    sys.exit(main())
