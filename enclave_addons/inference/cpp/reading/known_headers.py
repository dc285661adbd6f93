"""Headers whose classes are known to make no node, or are in the table of libraries."""

from __future__ import annotations

import os
import re

# Header folders whose classes make no node of their own: rclcpp's family is modelled, others know nothing of ROS.
KNOWN_HEADERS = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "rcl", "rcl_interfaces", "rcutils", "rmw",
    "rcpputils", "pluginlib", "class_loader", "message_filters", "tf2_ros", "tf2", "tf2_geometry_msgs", "tf2_eigen",
    "tf2_sensor_msgs", "tf2_kdl", "image_transport", "diagnostic_updater", "bondcpp", "bond", "cv_bridge",
    "ament_index_cpp", "realtime_tools", "urdf", "kdl", "laser_geometry", "interactive_markers", "camera_info_manager",
    "image_geometry", "angles", "rosidl_runtime_cpp", "kdl_parser", "rosidl_runtime_c", "rosidl_typesupport_cpp",
    "rosidl_typesupport_introspection_cpp", "Eigen", "eigen3", "opencv2", "boost", "pcl", "yaml-cpp", "nlohmann", "sys",
    "linux", "netinet", "arpa", "gtest", "gmock", "benchmark", "ompl", "ceres", "pcl_conversions", "urdf_parser",
    "suitesparse", "filters", "point_cloud_transport",
    "resource_retriever", "tracetools", "tinyxml2", "behaviortree_cpp", "behaviortree_cpp_v3", "nanoflann",
    "geographic_msgs", "GeographicLib", "eigen3_cmake_module", "rsl", "fmt", "parameter_traits", "control_toolbox",
    "urdf_model", "sdf", "lifecycle_msgs", "OGRE", "tbb", "xtensor", "Magick++", "GraphicsMagick", "console_bridge",
    "ruckig", "octomap", "fcl", "grid_map_core", "libstatistics_collector", "libphidget22", "urg_c", "rttest",
    "ur_client_library", "gtsam", "ouster", "depthai", "librealsense2", "sl", "libobsensor", "apriltag", "asio", "zmq",
    "websocketpp", "open3d", "gz", "ignition", "cartographer", "Sophus", "sophus", "g2o", "torch", "absl", "glog",
    "gflags", "google", "mavconn", "mavlink", "async_web_server_cpp", "dynamixel_sdk", "serial", "serial_driver",
    "io_context", "udp_driver", "libcamera", "nlohmann_json", "spdlog", "casadi", "pinocchio", "osqp", "gps", "libgps",
    "mcap", "zstd", "rosbag2_storage", "geometric_shapes", "eigen_stl_containers", "random_numbers", "srdfdom",
    "controller_interface", "hardware_interface", "semantic_components",
    "rviz_rendering", "rviz_ogre_vendor", "polyclipping", "backward_ros", "range", "magic_enum", "tl_expected",
    "SDL", "SDL2", "SDL3", "libusb-1.0", "lcm", "Poco", "thrust", "cub", "metavision",
    "GL", "GLFW", "X11", "experimental", "robin_hood", "tsl", "sensor_msgs", "rosbag2_cpp", "libavcodec", "libavformat",
    "libavutil", "libswscale", "librealsense2-gl", "ecl", "kobuki_core", "create", "sick_safetyscanners_base",
})  # fmt: skip


# Of these, the ones with nodes among their classes: each class that is made is in the table, or a gap.
ROS_LIBRARIES = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "tf2_ros", "image_transport", "message_filters",
    "diagnostic_updater", "nav2_util", "interactive_markers", "camera_info_manager", "realtime_tools", "bond",
    "point_cloud_transport", "moveit",
})  # fmt: skip

_INTERFACES = re.compile(r"/(?:msg|srv|action)/")

# Headers of C and POSIX, those of CUDA, and of libraries that know nothing of ROS, which lie in no folder.
_WITHOUT_FOLDER = frozenset({
    "assert", "ctype", "cxxabi", "dirent", "dlfcn", "errno", "execinfo", "fcntl", "float", "fnmatch", "getopt", "glob",
    "grp", "ifaddrs", "inttypes", "libgen", "limits", "locale", "malloc", "math", "memory", "ncurses", "netdb", "poll",
    "pthread", "pwd", "sched", "semaphore", "setjmp", "signal", "stdarg", "stdbool", "stddef", "stdint", "stdio",
    "stdlib", "string", "strings", "syslog", "termio", "termios", "time", "unistd", "wchar", "wctype",
    "cublas_v2", "cuda", "cuda_runtime", "cuda_runtime_api", "cudnn", "device_launch_parameters", "NvInfer",
})  # fmt: skip


def is_reviewed(header: str) -> bool:
    """Return whether the classes of a header, as ``#include`` names it, are known to make no node, or are modelled."""
    folder, slash, _ = header.partition("/")
    if slash:
        return folder in KNOWN_HEADERS or _INTERFACES.search(header) is not None
    stem, ending = os.path.splitext(header)
    return not ending or stem in KNOWN_HEADERS or stem in _WITHOUT_FOLDER
