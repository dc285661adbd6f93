"""API of ``launch_ros.actions``. ``TAGS``: the module that registers each element of XML and YAML."""

from enclave_launch.description.lazy import lazy_names
from enclave_launch.ros_rules.distro import Feature

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ComposableNodeContainer": "composable_node_container",
        "LifecycleNode": "lifecycle_node",
        "LifecycleTransition": "lifecycle_transition",
        "LoadComposableNodes": "load_composable_nodes",
        "Node": "node",
        "PushROSNamespace": "push_ros_namespace",
        "PushRosEnclave": "push_ros_enclave",
        "PushRosNamespace": "push_ros_namespace",
        "ROSTimer": "ros_timer",
        "RosTimer": "ros_timer",
        "SetParameter": "set_parameter",
        "SetParametersFromFile": "set_parameters_from_file",
        "SetROSLogDir": "set_ros_log_dir",
        "SetRemap": "set_remap",
        "SetUseSimTime": "set_use_sim_time",
    },
    submodules=(
        "composable_node_container",
        "lifecycle_node",
        "lifecycle_transition",
        "load_composable_nodes",
        "node",
        "push_ros_enclave",
        "push_ros_namespace",
        "ros_timer",
        "set_parameter",
        "set_parameters_from_file",
        "set_remap",
        "set_ros_log_dir",
        "set_use_sim_time",
    ),
    gates={
        "LifecycleTransition": Feature.LIFECYCLE_TRANSITION,
        "PushROSNamespace": Feature.CAPITAL_ROS_NAMES,
        "ROSTimer": Feature.CAPITAL_ROS_NAMES,
        "SetROSLogDir": Feature.SET_ROS_LOG_DIR,
    },
)

TAGS = {
    "lifecycle_node": "lifecycle_node",
    "load_composable_node": "load_composable_nodes",
    "node": "node",
    "node_container": "composable_node_container",
    "push-ros-enclave": "push_ros_enclave",
    "push-ros-namespace": "push_ros_namespace",
    "push_ros_enclave": "push_ros_enclave",
    "push_ros_namespace": "push_ros_namespace",
    "ros_timer": "ros_timer",
    "set_parameter": "set_parameter",
    "set_parameters_from_file": "set_parameters_from_file",
    "set_remap": "set_remap",
    "set_ros_log_dir": "set_ros_log_dir",
    "set_use_sim_time": "set_use_sim_time",
}
