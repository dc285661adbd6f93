"""The ROS graph of a running DDS domain, whoever started it. All but the observers performs no I/O."""
