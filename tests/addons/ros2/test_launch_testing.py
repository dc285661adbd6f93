"""A secured launch under ROS's own launch_testing: what runs in a robot's CI."""

from __future__ import annotations

import importlib.util

import pytest

from tests.addons.ros2.conftest import Workspace

pytestmark = pytest.mark.real_launch

TEST = """
import unittest

import launch_testing
from launch import LaunchDescription
from launch_ros.actions import Node
from launch_testing.actions import ReadyToTest

from enclave_addons.ros2.secured import secured


def generate_test_description():
    reporter = Node(package="nodes", executable="reporter", enclave="/voice", output="screen")
    return secured(LaunchDescription([reporter, ReadyToTest()]), "{keystore}"), {{"reporter": reporter}}


class WhileItRuns(unittest.TestCase):
    def test_it_has_its_enclave(self, proc_output, reporter):
        proc_output.assertWaitFor("{expected}", process=reporter, timeout={timeout}, stream="stdout")


@launch_testing.post_shutdown_test()
class Afterwards(unittest.TestCase):
    def test_it_ended_well(self, proc_info):
        launch_testing.asserts.assertExitCodes(proc_info, allowable_exit_codes=[0, -2])
"""
RUN = "import stand_ins; stand_ins.install(); from launch_testing.launch_test import main; main()"
MANIFEST = """<interface version="1"><node name="reporter" executable="reporter">
  <topic name="reports" type="std_msgs/msg/String" role="publisher"/>
</node></interface>"""


@pytest.mark.parametrize(("expected", "status"), [("enclave /voice", 0), ("enclave /other", 1)])
def test_a_launch_test_sees_a_secured_process(workspace: Workspace, expected: str, status: int) -> None:
    if importlib.util.find_spec("launch_testing") is None:
        pytest.skip("launch_testing is not on PYTHONPATH")
    prefix = workspace.directory / "nodes_prefix"
    program = workspace.add(
        "nodes_prefix/lib/nodes/reporter",
        '#!/bin/sh\nwhile [ "$1" != --enclave ]; do shift; done\necho "enclave $2"\nexec sleep 20\n',
    )
    program.chmod(0o755)
    workspace.add("nodes_prefix/share/ament_index/resource_index/packages/nodes", "")
    workspace.add("nodes_prefix/share/ament_index/resource_index/nodl/nodes", "share/nodes/nodes.nodl.xml")
    workspace.add("nodes_prefix/share/nodes/nodes.nodl.xml", MANIFEST)
    keystore = workspace.directory / "ks"
    timeout = 20 if status == 0 else 2
    test = workspace.add("test_it.py", TEST.format(keystore=keystore, expected=expected, timeout=timeout))
    ran = workspace.python(RUN, str(test), prefixes=(prefix,))
    assert (ran.returncode, (keystore / "enclaves" / "voice" / "permissions.p7s").exists()) == (
        status,
        True,
    ), ran.stdout
