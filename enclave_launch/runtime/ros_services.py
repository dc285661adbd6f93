"""Calls of the launcher's own ROS node: load components, ask for lifecycle transitions, hear of state
changes.

Needs rclpy, which is imported when a launch needs it and never otherwise. The node has a context of its
own, in the launcher's own enclave, and spins in a thread of its own; results come back as futures of the
launch's loop. Source of the calls: launch_ros/actions/load_composable_nodes.py, lifecycle_node.py,
ros_adapters.py.
"""

from __future__ import annotations

import asyncio
import importlib.util
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from enclave_common.dependencies import ros_import_failure
from enclave_common.environment import environment_with
from enclave_launch.errors import RuntimeFailure
from enclave_launch.policy.launcher import LAUNCHER_NODE
from enclave_launch.process import ResolvedComponent
from enclave_launch.ros_rules.parameter_value import ParameterValue
from enclave_launch.runtime.gate import StartAdditions
from enclave_launch.runtime.launch_log import Level

ALTERNATIVE = (
    "it needs ROS services (loading components, lifecycle transitions), and rclpy is not importable here. "
    "Source a ROS 2 workspace, or launch with ROS's own engine: "
    "ros2 launch --secure --keystore KEYSTORE PACKAGE LAUNCH_FILE"
)


def rclpy_available() -> bool:
    """Return True if ``rclpy`` can be found, without importing it."""
    return importlib.util.find_spec("rclpy") is not None


def require_rclpy() -> None:
    """Raise RuntimeFailure unless rclpy, and what its messages need (numpy), can be imported here."""
    if not rclpy_available():
        raise RuntimeFailure(f"cannot run this launch file: {ALTERNATIVE}")
    why = ros_import_failure()
    if why:
        raise RuntimeFailure(f"cannot run this launch file: the launcher's own node needs rclpy, and {why}")


class RosServices:
    """The launcher's own ROS node.

    :raises RuntimeFailure: no rclpy, or none that works; said before anything starts.
    """

    def __init__(self, grant: StartAdditions | None, say: Callable[[Level, str], None]) -> None:
        require_rclpy()
        import rclpy
        import rclpy.executors

        self._say = say
        self._loop = asyncio.get_running_loop()
        self._closing = threading.Event()
        self._closed = False
        grant = grant or StartAdditions()
        words = [word for word in grant.arguments if word != "--ros-args"]
        with environment_with(grant.environment):
            try:
                self._ros = rclpy.Context()
                rclpy.init(args=["--ros-args", *words], context=self._ros)
                # By the name that its permissions are for.
                self._node = rclpy.create_node(LAUNCHER_NODE, context=self._ros)
            except Exception as error:
                # A half installed ROS, a middleware that refuses: rclpy has no common class.
                raise RuntimeFailure(
                    f"rclpy cannot make the launcher's own node, which this launch file needs: {error}"
                ) from error
        self._executor = rclpy.executors.SingleThreadedExecutor(context=self._ros)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name="ros-services", daemon=True)
        self._thread.start()

    def load(self, components: Sequence[ResolvedComponent]) -> asyncio.Future[None]:
        """Load components one after another; one that cannot be loaded is logged, as launch does, and the rest
        goes on."""
        return self._loop.run_in_executor(None, self._load_all, tuple(components))

    def change_state(self, node: str, transition: int) -> asyncio.Future[bool]:
        """Request a lifecycle transition, a constant of ``lifecycle_msgs/msg/Transition``."""
        return self._loop.run_in_executor(None, self._change_state, node, transition)

    def watch_state(self, node: str, on_transition: Callable[[Any], None]) -> None:
        """Call ``on_transition`` in the launch's loop for each ``lifecycle_msgs/msg/TransitionEvent`` of ``node``."""
        from lifecycle_msgs.msg import TransitionEvent

        self._node.create_subscription(
            TransitionEvent,
            f"{node}/transition_event",
            lambda message: self._loop.call_soon_threadsafe(on_transition, message),
            10,
        )

    def abandon(self) -> None:
        """Give up all calls that still wait for a service: the launch is ending."""
        self._closing.set()

    def close(self) -> None:
        import rclpy

        self.abandon()
        self._closed = True
        self._executor.shutdown()
        self._thread.join(5.0)
        self._node.destroy_node()
        rclpy.shutdown(context=self._ros)

    def _spin(self) -> None:
        while not self._closed:
            self._executor.spin_once(timeout_sec=0.1)

    def _load_all(self, components: tuple[ResolvedComponent, ...]) -> None:
        from composition_interfaces.srv import LoadNode

        for component in components:
            service = f"{component.container}/_container/load_node"
            response = self._call(LoadNode, service, _load_request(component))
            if response is None:
                return
            self._report_load(component, response)

    def _report_load(self, component: ResolvedComponent, response: Any) -> None:
        name = response.full_node_name or component.name
        if response.success:
            self._report("INFO", f"Loaded node '{name}' in container '{component.container}'")
        else:
            self._report(
                "ERROR",
                f"Failed to load node '{name}' of type '{component.plugin}' in container "
                f"'{component.container}': {response.error_message}",
            )

    def _change_state(self, node: str, transition: int) -> bool:
        from lifecycle_msgs.srv import ChangeState

        request = ChangeState.Request()
        request.transition.id = transition
        response = self._call(ChangeState, f"{node}/change_state", request)
        if response is not None and not response.success:
            self._report("ERROR", f"Failed to make transition '{transition}' for LifecycleNode '{node}'")
        return response is not None and bool(response.success)

    def _call(self, kind: Any, service: str, request: Any) -> Any:
        client = self._node.create_client(kind, service)
        try:
            if not self._wait(lambda: client.wait_for_service(timeout_sec=0.2), f"'{service}' service"):
                return None
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: answered.set())
            if not self._wait(lambda: answered.wait(0.2), f"'{service}' service response"):
                return None
            return future.result()
        finally:
            self._node.destroy_client(client)

    def _wait(self, come: Callable[[], bool], what: str) -> bool:
        while not come():
            if self._closing.is_set():
                self._report("WARNING", f"Abandoning wait for the {what}, due to shutdown.")
                return False
        return True

    def _report(self, level: Level, message: str) -> None:
        self._loop.call_soon_threadsafe(self._say, level, message)


def _load_request(component: ResolvedComponent) -> Any:
    from composition_interfaces.srv import LoadNode

    request = LoadNode.Request()
    request.package_name = component.package
    request.plugin_name = component.plugin
    request.node_name = component.name
    request.node_namespace = component.namespace
    request.remap_rules = [f"{rule.source}:={rule.target}" for rule in component.remaps]
    request.parameters = _parameters(component.parameters)
    request.extra_arguments = _parameters(component.extra_arguments)
    return request


def _parameters(values: Mapping[str, ParameterValue]) -> list[Any]:
    from rclpy.parameter import Parameter

    return [
        Parameter(name, value=list(value) if isinstance(value, tuple) else value).to_parameter_msg()
        for name, value in values.items()
    ]
