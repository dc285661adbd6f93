"""Teach real launch the enclave vocabulary of the ROS 2 Security Enclaves design: in XML, YAML and Python.

* ``enclave=`` on ``node``, ``node_container``, lifecycle nodes and ``executable``;
* ``machine=`` on them, which says something to ``secure-plan hosts`` only: ``ros2 launch`` starts all on this host;
* ``enclave=`` on ``push_ros_namespace`` and the action ``push_ros_enclave`` for the enclave scope.

Upstream offers no hook for attributes of its own actions, so four methods are wrapped, once, and each does
exactly what it did for those who do not use the attribute. Loaded through the entry point
``launch.frontend.launch_extension``, when the first XML or YAML file is parsed, and by our other
extensions: in every ``ros2 launch`` of a workspace, so the rest of this project is imported where an
attribute is used.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import launch_ros.actions
from launch import Action
from launch.actions import ExecuteProcess
from launch.descriptions import Executable
from launch.frontend import expose
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions

from enclave_addons.ros2.observation import ATTRIBUTE, enclave_attribute, observe_executable
from enclave_addons.ros2.session import session_of
from enclave_launch.ros_rules.namespaces import push_enclave_scope

GRANT = "_enclave_launch_grant"
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


def install() -> None:
    """Let launch files use the attributes, secured or not; a second call does nothing."""
    if getattr(ExecuteProcess, WRAPPED, False):
        return
    setattr(ExecuteProcess, WRAPPED, True)
    ExecuteProcess.__init__ = _accepting_enclave(ExecuteProcess.__init__)
    Executable.prepare = _securing(Executable.prepare)
    # Subclasses, nodes and those of other packages, come here through super().
    ExecuteProcess.parse = classmethod(_reading_enclave_class(ExecuteProcess.parse.__func__))
    PushNamespace.__init__ = _accepting_enclave(PushNamespace.__init__)
    PushNamespace.execute = _pushing_enclave_scope(PushNamespace.execute)
    for tag, method in list(expose.action_parse_methods.items()):
        if getattr(getattr(method, "__wrapped__", None), "__self__", None) in (ExecuteProcess, PushNamespace):
            expose.action_parse_methods[tag] = _reading_enclave(method)
    for tag in ("push_ros_enclave", "push-ros-enclave"):
        expose.expose_action(tag)(PushRosEnclave)
    launch_ros.actions.PushRosEnclave = PushRosEnclave


def _accepting_enclave(init: Callable[..., None]) -> Callable[..., None]:
    @functools.wraps(init)
    def wrapped(self: Any, *args: Any, enclave: Any = None, machine: Any = None, **kwargs: Any) -> None:
        if enclave is not None:
            setattr(self, ATTRIBUTE, normalize_to_list_of_substitutions(enclave))
        init(self, *args, **kwargs)

    return wrapped


def _securing(prepare: Callable[..., None]) -> Callable[..., None]:
    """Wrap ``prepare`` so that a process gets its security variables last.

    That is after what the launch file set, and also if it replaced the environment (``env=``)."""

    @functools.wraps(prepare)
    def wrapped(self: Any, context: Any, action: Any) -> None:
        prepare(self, context, action)
        session = session_of(context)
        if session is not None:
            from enclave_launch.security_environment import OVERRIDE  # with the plan, the keystore

            grant = getattr(action, GRANT, None) or session.enter(observe_executable(action, context))
            self.final_env.pop(OVERRIDE, None)  # rcl lets it win over --enclave
            self.final_env.update(grant.environment)

    return wrapped


Parse = Callable[..., tuple[type, dict[str, Any]]]


def _reading_enclave(parse: Parse) -> Parse:
    """Read before upstream's parser, which refuses unread attributes."""

    @functools.wraps(parse)
    def wrapped(entity: Any, parser: Any, *args: Any, **kwargs: Any) -> tuple[type, dict[str, Any]]:
        enclave = entity.get_attr("enclave", optional=True)
        entity.get_attr("machine", optional=True)
        cls, options = parse(entity, parser, *args, **kwargs)
        if enclave is not None:
            options["enclave"] = parser.parse_substitution(enclave)
        return cls, options

    return wrapped


def _reading_enclave_class(parse: Parse) -> Parse:
    @functools.wraps(parse)
    def wrapped(cls: type, *args: Any, **kwargs: Any) -> tuple[type, dict[str, Any]]:
        return _reading_enclave(functools.partial(parse, cls))(*args, **kwargs)

    return wrapped


def _pushing_enclave_scope(execute: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(execute)
    def wrapped(self: Any, context: Any) -> Any:
        if session_of(context) is not None:  # otherwise the scope is not used
            enclave = enclave_attribute(self, context)
            namespace = perform_substitutions(context, self.namespace)
            push_enclave_scope(context.launch_configurations, enclave, namespace)
        return execute(self, context)

    return wrapped


install()
