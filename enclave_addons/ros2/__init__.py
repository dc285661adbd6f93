"""A guest in real ``ros2 launch``, and in programs that run upstream's ``LaunchService``.

Only these modules import ``launch`` and ``launch_ros``, and only in a workspace that has them.
"""
