"""What ROS 2 itself fixes: how rcl reads a command line and a parameter file, how names join, what releases differ in.

Rules over text, below everything else: ``distro`` is the table of the releases, ``namespaces`` joins names,
``ros_arguments`` and ``rcl_parameters`` read what rcl reads.
"""
