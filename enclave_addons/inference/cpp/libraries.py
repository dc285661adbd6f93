"""Registers of what libraries do, filled by ``models``. What is in none of them gets no node in silence."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from enclave_addons.inference.cpp.engine.frames import Frame
from enclave_addons.inference.cpp.engine.machine import Machine, registered
from enclave_addons.inference.cpp.engine.values import BOTTOM, Obj, Value
from enclave_addons.inference.cpp.findings import AllocatedNode
from enclave_addons.inference.cpp.reading.type_names import Type, ros_type
from enclave_addons.inference.cpp.syntax import Node


@dataclass(frozen=True)
class Call:
    """A call of a library's function. ``given``: the arguments as written."""

    node: Node
    frame: Frame
    values: Sequence[Value]
    types: Sequence[Type] = ()
    given: Sequence[Node] = ()
    receiver: Obj | None = None

    @property
    def this(self) -> Obj:
        """Return the object that is made, or whose method is called."""
        assert self.receiver is not None
        return self.receiver

    @property
    def record(self) -> AllocatedNode:
        """Return the node whose method is called."""
        assert self.this.node is not None
        return self.this.node

    @property
    def interface(self) -> str:
        """Return the interface type that is the first template argument; empty without one."""
        return ros_type(self.types[0]) if self.types else ""

    def key(self, what: str) -> tuple[object, ...]:
        """Return the key for the object that the call makes."""
        return what, self.frame.file.file, self.node.start_byte, self.frame.path

    def value(self, index: int) -> Value:
        return self.values[index] if index < len(self.values) else BOTTOM


ClassModel = Callable[[Machine, Call], Value | None]
FunctionModel = Callable[[Machine, Call], Value]

NODE_BASES: set[str] = set()
LIBRARY_CLASSES: dict[str, ClassModel] = {}
LIBRARY_FUNCTIONS: dict[str, FunctionModel] = {}
LIBRARY_METHODS: dict[tuple[str, str], FunctionModel] = {}
NODE_METHODS: dict[str, FunctionModel] = {}
IN_PLACE_OF_SOURCE: dict[str, Callable[[Machine, Call], Value | None]] = {}
"""Models of functions and methods, by their whole name, that run also where their source is in reach: everyday helpers
that a program calls a thousand times."""

# Classes that make no interface of their own, whoever they get. rclcpp: read in include/rclcpp of humble to rolling.
_HARMLESS_CLASSES = re.compile(
    r"sensor_msgs::PointCloud2\w+"
    r"|(?:std|Eigen|cv|boost|pcl|YAML|nlohmann|fmt|spdlog|tinyxml2|urdf|KDL|angles|grid_map|urcl|gtsam|ouster|dai|rs2|sl|asio|"
    r"gazebo::(?:transport|event|common|physics|sensors|rendering)|"
    r"websocketpp|gz|ignition|sdf|octomap|octomath|fcl|ceres|g2o|Sophus|torch|nvinfer1|zmq|google|absl|casadi|pinocchio|ompl|"
    r"mavconn|mavlink|zbar|open3d|tbb|Magick|xt|Ogre|libcamera|GeographicLib|proj|osqp|autoware_utils_(?:geometry|math|system|uuid|pcl)|lanelet|"
    r"cartographer|mcap|tl|gsl|CLI|toml|rtabmap|bosdyn|lcm)::.*"
    r"|controller_interface::(?!\w*ControllerInterface).*|hardware_interface::.*|semantic_components::.*"
    r"|BT::(?:Tree|Blackboard|NodeConfig(?:uration)?|StatusChangeLogger|StdCoutLogger|FileLogger2?|MinitraceLogger|"
    r"SqliteLogger|TreeObserver|Groot2Publisher|PublisherZMQ)"
    r"|rviz_common::properties::.*|rviz_rendering::.*"
    r"|nav2_util::LifecycleNode::(?:integer|floating_point)_range"
    r"|moveit::core::.*|moveit::planning_interface::MoveGroupInterface::\w+|robot_trajectory::.*|trajectory_processing::.*"
    r"|rclcpp::(?:Rate|WallRate|GenericRate|GenericTimer|WallTimer|\w*Handle|\w*Guard|Event|Clock|TimeSource|Time|Duration|QoS|\w*QoS|QoSInitialization|KeepLast|KeepAll|Logger|Parameter|"
    r"ParameterValue|NodeOptions|\w*Options|Context|TimerBase|CallbackGroup|MessageInfo|SerializedMessage|Serialization|"
    r"WaitSet|GuardCondition|PublisherEventCallbacks|SubscriptionEventCallbacks|NetworkFlow\w*|ParameterMap|ParameterType|"
    r"StaticWaitSet|ThreadSafeWaitSet|WaitSetTemplate|ParameterEventsFilter|"
    r"(?:experimental::)?executors::\w+|strategies::.*|memory_strategies::.*|message_memory_strategy::.*|Executor|FutureReturnCode|exceptions::.*|QOS\w+|AnySubscriptionCallback|\w*SubscriptionOptions\w*|\w*PublisherOptions\w*)"
    r"|rclcpp_lifecycle::(?:State|Transition)|rclcpp_components::NodeInstanceWrapper"
    r"|rclcpp_action::(?:\w*GoalHandle|ResultCode|GoalUUID|.*Options)"
    r"|tf2::.*|tf2_ros::(?:CreateTimerROS|CreateTimerInterface|AsyncBufferInterface)"
    r"|rcl\w*_\w+|rcutils_\w+|rmw_\w+|rcpputils::.*|class_loader::.*|builtin_interfaces::.*"
    r"|\w+::(?:msg|srv|action)::.*|Q[A-Z]\w*|qreal|emit|Ui::.*|U(?:Mutex|ScopeMutex|Timer|Semaphore|Directory|File)"
    r"|(?:unsigned |signed |long |short )*(?:bool|int|float|double|char|void|long|short|unsigned|size_t|auto)?(?:\[\])?"
    r"|u?int(?:8|16|32|64)_t|uint|byte|va_list|FILE|pthread_\w+|timespec|timeval|sigset_t|[A-Z]"
    r"|sockaddr(?:_\w+)?|in6?_addr|hostent|addrinfo|iovec|msghdr|pollfd|fd_set|termios2?|stat|dirent|epoll_event|itimerspec|"
    r"rusage|passwd|ifreq|ifaddrs|can(?:fd)?_frame|can_filter|v4l2_\w+|input_event|js_event|tm|winsize|utsname|cpu_set_t"
    r"|cu(?:da|blas|solver|rand|fft|sparse|dnn)[A-Z]\w*|(?:u?(?:char|short|int|long)|float|double|dim)[1-4]"
)
_HARMLESS_FUNCTIONS = re.compile(
    r"(?:std|Eigen|cv|boost|tf2|fmt|angles|YAML|nlohmann|pcl|rcpputils|rcutils|ament_index_cpp|KDL|cv_bridge|__builtin)::.*"
    r"|TRACEPOINT|TRACETOOLS_\w+|RCLCPP_\w+|RCUTILS_\w+|ROS_\w+|rc(?:l|utils|pputils)_(?!(?:publisher|subscription|client|service|action_\w+|node)_init)\w+|rmw_\w+|assert|ASSERT|printf|fprintf|memcpy|memset|signal|sqrt\w*|"
    r"f?abs|(?:a?sin|a?cos|a?tan2?|exp|log\w*|pow|floor|ceil|round|hypot|fmod|isnan|isinf|strcmp|strlen|atoi|atof|rand|srand|"
    r"usleep|sleep|exit|min|max|setvbuf|perror|puts|malloc|free|getenv|clamp|swap|isfinite|emplace_back|static_assert|connect|"
    r"tolower|toupper|isspace|strtol|strtod|fabsf|doTransform|toMsg|fromMsg|get_logger|now)"
    r"|rclcpp::(?:ok|shutdown|spin|spin_some|spin_until_future_complete|get_logger|Rate|sleep_for|on_shutdown|"
    r"expand_topic_or_service_name|to_string|remove_ros_arguments|uninstall_signal_handlers|install_signal_handlers|"
    r"signal_handlers_installed|contexts::.*|executors::.*|exceptions::.*|get_message_type_support_handle|extend_name_with_sub_namespace|"
    r"node_interfaces::get_node_(?:base|topics|services|parameters|timers|logging|clock|graph|time_source|waitables|type_descriptions)_interface|create_wall_timer|create_timer|get_typesupport_library|get_typesupport_handle|get_message_typesupport_handle|get_service_typesupport_handle|is_initialized|detail::.*|getLogger)"
    r"|(?:rclcpp|rclcpp_lifecycle|rclcpp_action)::\w*::\w+::(?:get_instance)"
    r"|rclcpp::(?!Node\b|create_|Async|Sync|wait_for|Generic)\w+(?:::\w+)*"
    r"|rclcpp_lifecycle::(?:State|Transition)\w*(?:::\w+)*"
    r"|rclcpp_action::(?:ServerGoalHandle|ClientGoalHandle|Client|Server|to_string|convert|ClientBase|ServerBase)(?:::.*)?"
    r"|\w+::(?:msg|srv|action)::.*"
)


def is_harmless_class(name: str) -> bool:
    """Return whether objects of this class make no interface, even of nodes that they get."""
    return _HARMLESS_CLASSES.fullmatch(name) is not None and name not in LIBRARY_CLASSES


def is_harmless_function(name: str) -> bool:
    """Return whether this function makes no interface; what it calls back is run all the same."""
    return _HARMLESS_FUNCTIONS.fullmatch(name) is not None


def library_class(*names: str) -> Callable[[ClassModel], ClassModel]:
    """Register the model of these classes, run if one is made, by itself or as a base; its result stands for the
    object.
    """
    return registered(LIBRARY_CLASSES, names)


def node_class(*names: str) -> Callable[[ClassModel], ClassModel]:
    """Register as ``library_class``, for classes that are nodes."""
    NODE_BASES.update(names)
    return library_class(*names)


def library_function(*names: str) -> Callable[[FunctionModel], FunctionModel]:
    """Register the model of these functions, run in place of the library's code."""
    return registered(LIBRARY_FUNCTIONS, names)


def library_method(cls: str, *names: str) -> Callable[[FunctionModel], FunctionModel]:
    """Register the model of these methods of ``cls``, run in place of the library's code."""
    return registered(LIBRARY_METHODS, [(cls, name) for name in names])


def node_method(*names: str) -> Callable[[FunctionModel], FunctionModel]:
    """Register the model of these methods on any node whose class has none of its own for them."""
    return registered(NODE_METHODS, names)
