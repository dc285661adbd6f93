"""Install, remove, restart or look at the systemd units that secure-plan export wrote, on the host that runs them.

  secure-keystore units install DIR         copy what changed, stop and remove what the launch lost, enable the target
  secure-keystore units restart [NAME...]   one after the other, sources first; stops at the first that does not stay up
  secure-keystore units status [NAME...]    what does not run
  secure-keystore units remove TARGET       stop and remove all of them

NAME is a unit, a target, a node or an enclave.

exit status: 0 done or all well, 1 something does not run, 2 wrong usage
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_addons.deployment.host_units import (
    UNITS as UNITS_FOLDER,
)
from enclave_addons.deployment.host_units import (
    UnitOptions,
    chosen_units,
    install,
    installed_units,
    restart,
    uninstall,
    unit_problems,
)
from enclave_common.command_line import FLAG, PATH, TIME
from keystore.errors import InvalidInputError
from keystore.verb import common

if TYPE_CHECKING:
    from enclave_addons.deployment.units import Unit

UNIT_OPTIONS: common.Table = (
    ("--settle TIME", {**TIME, "default": UnitOptions().settle},
     "how long a process must run before it counts as up (5s)"),
    ("--units DIR", {**PATH, "default": UNITS_FOLDER}, "where systemd reads units (/etc/systemd/system)"),
)  # fmt: skip
"""Of each verb that looks at systemd units; read by ``unit_options``."""

OPTIONS: common.Table = (
    (
        "what WHAT",
        {"choices": ("install", "restart", "status", "remove")},
        "install, restart, status or remove",
    ),
    (
        "names NAME",
        {"nargs": "*"},
        "DIR of install, TARGET of remove; else units, targets, nodes or enclaves",
    ),
    ("--restart", FLAG, "with install: restart what changed or is new"),
    *UNIT_OPTIONS,
)


def unit_options(arguments: argparse.Namespace) -> UnitOptions:
    """Return what ``UNIT_OPTIONS`` was given."""
    return UnitOptions(units=arguments.units, settle=arguments.settle)


def run(arguments: argparse.Namespace) -> int:
    """Do what ``what`` says. Returns 1 if something does not run."""
    options = unit_options(arguments)
    if arguments.what == "install":
        return _install(arguments, options)
    if arguments.what == "remove":
        report = uninstall(_only(arguments, "TARGET"), options)
        common.print_lines(f"{name}: removed" for name in report.removed)
        return 0
    units = chosen_units(installed_units(options), arguments.names)
    if arguments.what == "restart":
        return restarted(units, options)
    problems = [(unit, problem) for unit, problem in unit_problems(units)]
    common.print_lines(f"{unit.name}: runs" if problem is None else problem for unit, problem in problems)
    return 1 if any(problem for _, problem in problems) else 0


def _install(arguments: argparse.Namespace, options: UnitOptions) -> int:
    report = install(Path(_only(arguments, "DIR")), options)
    common.print_lines(f"{name}: installed" for name in report.changed)
    common.print_lines(f"{name}: stopped and removed" for name in report.removed)
    if not report.changed and not report.removed:
        print("nothing changed")
    if not arguments.restart:
        return 0
    units = [
        unit
        for unit in chosen_units(installed_units(options), [report.target])
        if unit.name in report.changed
    ]
    return restarted(units, options)


def restarted(units: Sequence[Unit], options: UnitOptions, *, together: bool = False) -> int:
    """Restart ``units`` and print each that is up. Returns 1 if one is not."""
    report = restart(units, options, together=together, report=lambda name: print(f"{name}: up", flush=True))
    if report.failed is None:
        return 0
    print(f"secure-keystore: error: {report.failed}", file=sys.stderr)
    print(
        f"not restarted: {len(report.left)} of {len(units)}. When it is repaired, go on with\n"
        f"    secure-keystore units restart {' '.join(report.left)}",
        file=sys.stderr,
    )
    return 1


def _only(arguments: argparse.Namespace, what: str) -> str:
    if len(arguments.names) != 1:
        raise InvalidInputError(f"secure-keystore units {arguments.what} needs one {what}")
    return str(arguments.names[0])
