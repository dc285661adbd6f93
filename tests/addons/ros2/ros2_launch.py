"""``ros2 launch`` on the public sources of launch, launch_ros and ros2launch: ``python ros2_launch.py
[options] ...``.

The command's own class parses the command line and runs the launch; only ROS itself is stood in for.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.addons.ros2 import stand_ins
else:
    import stand_ins


def main() -> int | str | None:
    stand_ins.install()
    from ros2launch.command.launch import LaunchCommand

    command = LaunchCommand()
    parser = argparse.ArgumentParser(prog="ros2 launch")
    command.add_arguments(parser, "ros2")
    result: int | str | None = command.main(parser=parser, args=parser.parse_args())
    return result


if __name__ == "__main__":
    sys.exit(main())
