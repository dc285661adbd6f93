"""Headers whose classes are known to make no node, or are in the table of libraries; types of C headers. Pure.

Making a structure of C runs no code, so that it makes no interface. Sources: POSIX.1-2017 (headers of the base
definitions), Linux uapi headers, SDL 2, libusb 1.0, FFmpeg, libcurl.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

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
    "rviz_rendering", "rviz_ogre_vendor", "polyclipping", "backward_ros", "range", "magic_enum", "tl_expected",
})  # fmt: skip


# Of these, the ones with nodes among their classes: each class that is made is in the table, or a gap.
ROS_LIBRARIES = frozenset({
    "rclcpp", "rclcpp_lifecycle", "rclcpp_action", "rclcpp_components", "tf2_ros", "image_transport", "message_filters",
    "diagnostic_updater", "nav2_util", "interactive_markers", "camera_info_manager", "realtime_tools", "bond",
    "point_cloud_transport",
})  # fmt: skip


_TYPES_OF: tuple[tuple[str, str], ...] = (
    (r"c?time(?:\.h)?|sys/time\.h",
     r"time_t|clock_t|clockid_t|timer_t|tm|timespec|timeval|timezone|itimer(?:val|spec)"),
    (r"linux/videodev2\.h", r"v4l2_\w+"),
    (r"linux/media\.h", r"media_(?:device_info|(?:entity|pad|link)_desc|links_enum|v2_\w+)"),
    (r"linux/(?:input|joystick|uinput)\.h",
     r"input_(?:event|id|absinfo|keymap_entry|mask)|js_(?:event|corr)|uinput_(?:setup|user_dev|abs_setup)|"
     r"ff_(?:effect|envelope|replay|trigger|(?:constant|ramp|condition|periodic|rumble)_effect)"),
    (r"linux/can(?:/\w+)?\.h", r"can(?:fd)?_frame|can_(?:filter|err_mask_t|bittiming)|sockaddr_can|canid_t"),
    (r"linux/(?:i2c(?:-dev)?|spi/spidev|serial|gpio|fb|usbdevice_fs)\.h",
     r"i2c_(?:msg|rdwr_ioctl_data|smbus_\w+)|spi_ioc_transfer|serial_(?:\w+_struct|struct|rs485)|"
     r"gpio(?:_v2_\w+|handle_\w+|event_\w+|chip_info|line_info)|fb_(?:var|fix)_screeninfo|fb_cmap|usbdevfs_\w+"),
    (r"(?:asm/|asm-generic/|sys/)?termios?\.h|asm/termbits\.h", r"termios2?|termio|winsize|speed_t|tcflag_t|cc_t"),
    (r"sys/(?:types|stat|statvfs|file|ioctl|mman|resource|times|utsname|wait|sysinfo|vfs)\.h|unistd\.h|fcntl\.h",
     r"stat(?:64|vfs|fs)?|flock|winsize|rlimit|rusage|tms|utsname|sysinfo|"
     r"(?:pid|uid|gid|off|mode|dev|ino|s?size|nlink|blkcnt|blksize|id|key|s?useconds|time)_t"),
    (r"sys/(?:socket|un|uio)\.h|netinet/\w+\.h|arpa/inet\.h|netdb\.h|net/if\.h|ifaddrs\.h",
     r"sockaddr(?:_\w+)?|in6?_addr|in_addr_t|addrinfo|hostent|servent|protoent|ip\w*_mreqn?|ipv6_mreq|msghdr|cmsghdr|iovec|linger|"
     r"ifreq|ifconf|ifaddrs|socklen_t|sa_family_t|in_port_t|ucred|iphdr|udphdr|tcphdr"),
    (r"dirent\.h", r"DIR|dirent"),
    (r"(?:sys/)?poll\.h|sys/(?:select|epoll|eventfd|inotify|signalfd)\.h",
     r"pollfd|nfds_t|fd_set|epoll_event|epoll_data_t|inotify_event|signalfd_siginfo"),
    (r"c?signal(?:\.h)?", r"sigaction|siginfo_t|sigset_t|sigevent|sigval|stack_t|sig_atomic_t|sighandler_t"),
    (r"pthread\.h|sched\.h|semaphore\.h", r"pthread_\w+|sched_\w+|cpu_set_t|sem_t"),
    (r"c?(?:stdio|stdlib|setjmp|locale|stdarg|stddef|stdint)(?:\.h)?",
     r"FILE|fpos_t|l?l?div_t|jmp_buf|lconv|va_list|(?:size|ptrdiff|wchar|max_align|u?int\w*)_t"),
    (r"pwd\.h|grp\.h|regex\.h|glob\.h|ftw\.h|getopt\.h|spawn\.h|syslog\.h",
     r"passwd|group|regex_t|regmatch_t|glob_t|FTW|option|posix_spawn\w*"),
    (r"(?:SDL2?/)?SDL\w*\.h", r"SDL_\w+"),
    (r"(?:libusb-1\.0/)?libusb\.h", r"libusb_\w+"),
    (r"libav\w+/\w+\.h|libsw\w+/\w+\.h", r"AV\w+|Sws\w+|Swr\w+"),
    (r"curl/\w+\.h", r"CURL\w*|curl_\w+"),
)  # fmt: skip
_TABLE = tuple(
    (re.compile(header), re.compile(rf"(?:struct |union |::)?(?:{name})")) for header, name in _TYPES_OF
)


def is_of_c(name: str, headers: Iterable[str]) -> bool:
    """Return whether one of ``headers``, as ``#include`` names them, is a header of C that defines the type
    ``name``.
    """
    fitting = [header for header, names in _TABLE if names.fullmatch(name)]
    return any(pattern.fullmatch(header) for pattern in fitting for header in headers) if fitting else False
