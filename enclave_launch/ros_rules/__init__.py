"""Rules that ROS 2 itself fixes: for command lines, parameter files, names and the differences of releases.

Below everything else: ``distro`` is the table of the releases, ``namespaces`` joins names,
``ros_arguments`` and ``rcl_parameters`` read what rcl reads.
"""
