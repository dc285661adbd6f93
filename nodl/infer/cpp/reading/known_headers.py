"""Headers whose classes are known to make no node, or are in the table of libraries."""

from __future__ import annotations

# Header folders whose classes make no node of their own: rclcpp's family is modelled, others know nothing of ROS.
KNOWN_HEADERS = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "rcl", "rcl_interfaces", "rcutils", "rmw",
    "rcpputils", "pluginlib", "class_loader", "message_filters", "tf2_ros", "tf2", "tf2_geometry_msgs", "tf2_eigen",
    "tf2_sensor_msgs", "tf2_kdl", "image_transport", "diagnostic_updater", "bondcpp", "bond", "cv_bridge",
    "ament_index_cpp", "realtime_tools", "urdf", "kdl", "laser_geometry", "interactive_markers", "camera_info_manager",
    "image_geometry", "angles", "rosidl_runtime_cpp", "kdl_parser", "rosidl_runtime_c", "rosidl_typesupport_cpp",
    "rosidl_typesupport_introspection_cpp", "Eigen", "opencv2", "boost", "pcl", "yaml-cpp", "nlohmann", "sys", "linux",
    "netinet", "arpa", "gtest", "gmock", "benchmark", "ompl", "ceres", "pcl_conversions", "urdf_parser", "suitesparse",
    "filters", "point_cloud_transport",
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
    "robin_hood",
})  # fmt: skip


# Of these, the ones with nodes among their classes: each class that is made is in the table, or a gap.
ROS_LIBRARIES = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "tf2_ros", "image_transport", "message_filters",
    "diagnostic_updater", "nav2_util", "interactive_markers", "camera_info_manager", "realtime_tools", "bond",
    "point_cloud_transport",
})  # fmt: skip
