"""Matchers of actions, for events that are about one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.launch.action import Action


def matches_action(target_action: Action) -> Callable[[Action], bool]:
    """Is it exactly this action?"""
    return lambda action: action == target_action
