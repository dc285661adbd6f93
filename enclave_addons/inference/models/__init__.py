"""What foreign code does, as far as names are concerned: ROS client libraries, Python's own library."""
