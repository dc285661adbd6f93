"""Other ways to run a launch, which options of add-ons choose: learning, auditing, watching.

Each is a module that an add-on names as an entry point of ``secure_launch.mode``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Protocol

from enclave_common.add_ons import add_on, add_ons
from enclave_common.command_line import CommandLine, Option
from enclave_launch.errors import UsageError
from enclave_launch.verb.target import LaunchTarget

GROUP = "secure_launch.mode"


class Mode(Protocol):
    """A way to run a launch."""

    @property
    def TITLE(self) -> str:
        """Return the heading of its options in the help."""

    @property
    def OPTIONS(self) -> tuple[Option, ...]:
        """Return its options."""

    def chosen(self, options: argparse.Namespace) -> str:
        """Return the option that chooses it, empty if none was given."""

    def plans(self, options: argparse.Namespace) -> bool:
        """Return True if it makes a plan without ``--secure``, so that options of the plan have an effect."""

    def check_options(self, line: CommandLine, actions: Sequence[argparse.Action]) -> None:
        """Raise ``UsageError`` for options of its own that have no effect."""

    def launch(self, target: LaunchTarget, options: argparse.Namespace, keystore: str | None) -> int:
        """Run the launch and return the exit status."""


def modes() -> tuple[Mode, ...]:
    """Return the modes of all add-ons that are installed, in the order of their names."""
    found = (add_on(GROUP, name) for name in add_ons(GROUP))
    return tuple(each for each in found if each is not None)


def chosen_mode(options: argparse.Namespace) -> Mode | None:
    """Return the mode that ``options`` choose. Raises ``UsageError`` if they choose two."""
    chosen = [(each.chosen(options), each) for each in modes() if each.chosen(options)]
    if len(chosen) > 1:
        flags = " and ".join(flag for flag, _ in chosen)
        raise UsageError(f"{flags} each run the launch in a way of their own: give one of them")
    return chosen[0][1] if chosen else None


def check_modes(line: CommandLine, actions: Sequence[argparse.Action], *, only_shown: bool) -> Mode | None:
    """Return the chosen mode. Raises ``UsageError`` for options of modes that have no effect."""
    mode = chosen_mode(line.options)
    for each in modes():
        each.check_options(line, actions)
    if mode is not None and only_shown:
        raise UsageError(
            f"{mode.chosen(line.options)} runs the launch: give it without options that only show"
        )
    if mode is not None and line.options.provision_only:
        raise UsageError(
            "--provision-only writes the keystore and starts nothing: give it with --secure alone"
        )
    return mode
