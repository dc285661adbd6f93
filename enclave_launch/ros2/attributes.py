"""Teach real launch the enclave vocabulary of the ROS 2 Security Enclaves design: in XML, YAML and Python.

* ``enclave=`` on ``node``, ``node_container``, lifecycle nodes and ``executable``;
* ``enclave=`` on ``push_ros_namespace`` and the action ``push_ros_enclave`` for the enclave scope.

Upstream offers no hook for attributes of its own actions, so three methods are wrapped, once, and each does
exactly what it did for those who do not use the attribute. Loaded through the entry point
``launch.frontend.launch_extension``, when the first XML or YAML file is parsed, and by our other
extensions.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import launch_ros.actions
from launch import Action
from launch.actions import ExecuteProcess
from launch.frontend import expose
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

from enclave_launch.evaluation.namespaces import enclave_scope, push_enclave_scope

ATTRIBUTE = "_enclave_launch_enclave"
WRAPPED = "_enclave_launch_wrapped"
# Renamed after humble; the old name stays as an alias.
PushNamespace: Any = (
    getattr(launch_ros.actions, "PushROSNamespace", None) or launch_ros.actions.PushRosNamespace
)


class PushRosEnclave(Action):  # type: ignore[misc]  # untyped without ROS
    """The enclave scope of the actions that follow, until the end of the group."""

    def __init__(self, enclave: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.enclave = normalize_to_list_of_substitutions(enclave)

    @classmethod
    def parse(cls, entity: Any, parser: Any) -> tuple[type, dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["enclave"] = parser.parse_substitution(entity.get_attr("enclave"))
        return cls, kwargs

    def execute(self, context: Any) -> None:
        push_enclave_scope(context.launch_configurations, perform_substitutions(context, self.enclave))


def enclave_attribute(action: Any, context: Any) -> str | None:
    """The performed ``enclave`` of an action; None where the launch file gives none."""
    enclave = getattr(action, ATTRIBUTE, None)
    return None if enclave is None else perform_substitutions(context, enclave)


def scope_in_force(context: Any) -> str | None:
    return enclave_scope(context.launch_configurations)


def install() -> None:
    """Idempotent; afterwards launch files may use the attributes, secured or not."""
    if getattr(ExecuteProcess, WRAPPED, False):
        return
    setattr(ExecuteProcess, WRAPPED, True)
    ExecuteProcess.__init__ = _accepting_enclave(ExecuteProcess.__init__)
    PushNamespace.__init__ = _accepting_enclave(PushNamespace.__init__)
    PushNamespace.execute = _pushing_enclave_scope(PushNamespace.execute)
    for tag, method in list(expose.action_parse_methods.items()):
        owner = getattr(getattr(method, "__wrapped__", None), "__self__", None)
        if isinstance(owner, type) and issubclass(owner, (ExecuteProcess, PushNamespace)):
            expose.action_parse_methods[tag] = _reading_enclave(method)
    for tag in ("push_ros_enclave", "push-ros-enclave"):
        expose.expose_action(tag)(PushRosEnclave)
    launch_ros.actions.PushRosEnclave = PushRosEnclave


def _accepting_enclave(init: Callable[..., None]) -> Callable[..., None]:
    @functools.wraps(init)
    def wrapped(self: Any, *args: Any, enclave: Any = None, **kwargs: Any) -> None:
        init(self, *args, **kwargs)
        if enclave is not None:
            setattr(self, ATTRIBUTE, normalize_to_list_of_substitutions(enclave))

    return wrapped


def _reading_enclave(
    parse: Callable[..., tuple[type, dict[str, Any]]],
) -> Callable[..., tuple[type, dict[str, Any]]]:
    """Read before upstream's parser, which refuses attributes that nobody has read."""

    @functools.wraps(parse)
    def wrapped(entity: Any, parser: Any) -> tuple[type, dict[str, Any]]:
        enclave = entity.get_attr("enclave", optional=True)
        cls, kwargs = parse(entity, parser)
        if enclave is not None:
            kwargs["enclave"] = parser.parse_substitution(enclave)
        return cls, kwargs

    return wrapped


def _pushing_enclave_scope(execute: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(execute)
    def wrapped(self: Any, context: Any) -> Any:
        enclave = enclave_attribute(self, context)
        push_enclave_scope(
            context.launch_configurations, enclave, perform_substitutions(context, self.namespace)
        )
        return execute(self, context)

    return wrapped


install()
