"""Rules that ROS 2 itself fixes: for command lines, parameter files, names and the differences of releases."""
