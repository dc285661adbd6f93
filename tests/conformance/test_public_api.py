"""Every public name of real launch exists in ours and takes the same arguments, in each distribution."""

from __future__ import annotations

import importlib
import inspect
from typing import Any

import pytest

from enclave_launch.evaluation.evaluate import evaluation_surroundings
from enclave_launch.host.plan_host import PlanHost

from . import public_api
from .case_files import DISTROS, RECORDED_IN

# Inner workings that have public names upstream.
NOT_OURS = {
    "launch.LaunchService.event_loop",
    "launch.LaunchService.task",
    "launch.event_handlers.OnIncludeLaunchDescription.entities",
    "launch.substitutions.AnonName.compute_name",
}


@pytest.mark.parametrize("distro", DISTROS)
def test_names_and_arguments(distro: str) -> None:
    problems = []
    with evaluation_surroundings(PlanHost(distro=f"{distro}@{RECORDED_IN}")):
        for name, parameters in public_api.recorded(distro):
            problem = None if name in NOT_OURS else _problem(name, parameters)
            if problem:
                problems.append(f"{name}: {problem}")
    assert not problems


def test_what_upstream_lacks_is_gated() -> None:
    with evaluation_surroundings(PlanHost(distro="humble")):
        import launch_ros.actions

        assert not hasattr(launch_ros.actions, "SetROSLogDir")
        assert hasattr(launch_ros.actions, "PushRosEnclave")


def _problem(name: str, parameters: list[str]) -> str | None:
    try:
        value = _find(name)
    except (ImportError, AttributeError) as error:
        return str(error)
    if not parameters or not callable(value):
        return None
    ours = _parameters(value)
    missing = [item for item in parameters if item not in ours and not item.startswith("*")]
    return f"lacks {missing}, has {ours}" if missing and not _optional_instead(missing, ours) else None


def _optional_instead(missing: list[str], ours: list[str]) -> bool:
    """Is what upstream demands (or names otherwise) accepted by ours as ``*args`` or with a default?"""
    return all(item + "=" in ours or item.rstrip("=") in ours or "*args" in ours for item in missing)


def _find(name: str) -> Any:
    """Import the longest module that ``name`` begins with, then go on by attribute."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        module = ".".join(parts[:length])
        if module in public_api.MODULES:
            value: Any = importlib.import_module(module)
            for attribute in parts[length:]:
                value = getattr(value, attribute)
            return value
    raise ImportError(name)


def _parameters(value: Any) -> list[str]:
    if isinstance(value, type) and issubclass(value, BaseException):
        return ["*args", *public_api.parameters(value)]
    try:
        inspect.signature(value)
    except (TypeError, ValueError):
        return ["*args"]
    return public_api.parameters(value)
