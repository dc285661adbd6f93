"""The ROS graph of a running DDS domain, whoever started it.

    wire_names.py       DDS topic and type names → what a ROS node means by them
    discovery_info.py   messages of ``ros_discovery_info``, with identifiers of 16 and of 24 bytes
    quality.py          quality of service, and whether two endpoints can meet
    seen.py             participants and endpoints as they were announced
    state.py            announcements, as they come and go → what is there now, or was
    model.py            announcements → processes, nodes and their interfaces
    json_form.py        a graph ⇄ JSON
    inverse.py          a final name → the names that the source may write
    sources.py          observed runs → what a manifest of each program says
    policy.py           an observed graph → an SROS2 policy
    cyclone.py          listens to a domain with the Python binding of Cyclone DDS
    rclpy_graph.py      asks rclpy, where that is installed
    observing.py        chooses one of the two, and waits until the graph is quiet

All but the last three are pure.
"""
