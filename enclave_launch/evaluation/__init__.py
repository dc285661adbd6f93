"""From launch files to processes: visiting a description, the seam to the world, events.

    frontend text / Python file -> description objects -> **evaluation** -> process.Evaluation

``host`` is the only way out to the world, ``distro`` the table of what differs between ROS releases,
``events`` the queue and handler rules that the dry run and the live runtime share.
"""
