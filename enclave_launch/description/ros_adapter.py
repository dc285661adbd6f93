"""API of ``launch_ros.ros_adapters``: launch's own ROS node, made only while processes really run."""

from __future__ import annotations

import os
import threading
from typing import Any

from enclave_launch.description import read_only
from enclave_launch.description.events.handlers import OnShutdown
from enclave_launch.description.launch_context import LaunchContext


@read_only("ros_context", "ros_node", "ros_executor", "argv")
class ROSAdapter:
    """Holds an rclpy context and a node ``launch_ros_<pid>``, spun by a thread of its own."""

    ros_context: Any = None
    ros_node: Any = None
    ros_executor: Any = None
    argv: list[str]

    def __init__(self, *, argv: list[str] | None = None, autostart: bool = True):
        self.__argv = argv or []  # never None: rclpy would take sys.argv
        self.__thread: Any = None
        if autostart:
            self.start()

    def start(self) -> None:
        """Start the node; raises ``RuntimeError`` if already started, ``ImportError`` without rclpy."""
        if self.ros_node is not None:
            raise RuntimeError("Cannot start a ROS adapter that is already running")
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self.__ros_context = rclpy.Context()
        rclpy.init(args=self.__argv, context=self.__ros_context)
        self.__ros_node = rclpy.create_node(f"launch_ros_{os.getpid()}", context=self.__ros_context)
        self.__ros_executor = SingleThreadedExecutor(context=self.__ros_context)
        self.__ros_executor.add_node(self.__ros_node)
        self.__thread = threading.Thread(target=self.__ros_executor.spin, daemon=True)
        self.__thread.start()

    def shutdown(self) -> None:
        """Stop the node and its executor; raises ``RuntimeError`` if not started."""
        if self.ros_node is None:
            raise RuntimeError("Cannot shutdown a ROS adapter that is not running")
        self.__ros_executor.shutdown()
        self.__thread.join()
        self.__ros_node.destroy_node()
        self.__ros_context.try_shutdown()
        self.__ros_node = None


def get_ros_adapter(context: LaunchContext) -> ROSAdapter:
    """Return the adapter of this launch, made on first use and shut down with it."""
    adapter: ROSAdapter | None = getattr(context.locals, "ros_adapter", None)
    if adapter is None:
        adapter = started = ROSAdapter()
        context.extend_globals({"ros_adapter": adapter})
        context.register_event_handler(OnShutdown(on_shutdown=lambda *_: started.shutdown()))
    return adapter


def get_ros_node(context: LaunchContext) -> Any:
    """Return the rclpy node of this launch."""
    return get_ros_adapter(context).ros_node
