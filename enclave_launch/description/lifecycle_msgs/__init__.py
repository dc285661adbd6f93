"""Constants of ``lifecycle_msgs``, which Python launch files import to name lifecycle transitions.

From ros2/rcl_interfaces ``lifecycle_msgs/msg/{State,Transition}.msg``. Put in place only where the real
package is not installed.
"""
