"""A guest in real ``ros2 launch``: upstream's engine launches, ours decides enclaves and permissions.

    attributes      ``enclave`` on nodes, executables and namespaces, ``push_ros_enclave``   (launch.frontend)
    context         where a secured launch is kept
    observation     what upstream's actions are about to start, as our ``ResolvedProcess``
    session         the enclaves of one ``ros2 launch --secure``
    node_action     ``launch_ros.node_action``: the enclave of each node before its process
    option          ``ros2launch.option``: the command line
    secured         the same for a ``launch.LaunchDescription`` in a program of your own

Only these modules import ``launch`` and ``launch_ros``, and only in a workspace that has them.
"""
