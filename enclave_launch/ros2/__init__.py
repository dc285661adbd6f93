"""A guest in real ``ros2 launch``, and in programs that run upstream's ``LaunchService``.

    option          ``ros2launch.option``: the command line; a secured launch is handed to ``flow``
    attributes      ``enclave`` on nodes, executables and namespaces, ``push_ros_enclave``   (launch.frontend)
    secured         a ``launch.LaunchDescription`` in a program of your own, under upstream's engine
    session         the enclaves of such a description
    observation     what upstream's actions are about to start, as our ``ResolvedProcess``
    node_action     ``launch_ros.node_action``: the enclave of each node before its process

Only these modules import ``launch`` and ``launch_ros``, and only in a workspace that has them.
"""
