"""The package ``my_robot`` of the how-to pages: its nodes really run and end by themselves."""

from __future__ import annotations

from pathlib import Path

_BRINGUP = """<launch>
  <arg name="robot" default="r1"/>
  <group>
    <push_ros_namespace namespace="$(var robot)"/>
    {nodes}
  </group>
</launch>
"""
DEMO_NODES = """<include file="$(find-pkg-share demo_nodes)/launch/talker_listener.launch.xml">
      <arg name="count" value="0"/>
      <arg name="seconds" value="$(env MY_ROBOT_SECONDS '0')"/>
    </include>"""
"""On Cyclone DDS with security; without a limit of their own they run until somebody ends the launch."""
RCLPY_NODES = """<node pkg="rclpy_nodes" exec="talker">
      <remap from="chatter" to="gossip"/>
    </node>
    <timer period="6"><shutdown/></timer>"""
"""On the rclpy wheels, which have no security."""


def make_my_robot(prefix: Path, nodes: str) -> None:
    """Install ``my_robot`` into ``prefix``, with a ``bringup.launch.xml`` of these elements, and a second launch."""
    index, share = (
        prefix / "share" / "ament_index" / "resource_index" / "packages",
        prefix / "share" / "my_robot",
    )
    index.mkdir(parents=True)
    (index / "my_robot").touch()
    (share / "launch").mkdir(parents=True)
    (share / "package.xml").write_text("<package><name>my_robot</name><version>1.0.0</version></package>\n")
    (share / "launch" / "bringup.launch.xml").write_text(_BRINGUP.format(nodes=nodes))
    (share / "launch" / "navigation.launch.xml").write_text("<launch/>\n")
