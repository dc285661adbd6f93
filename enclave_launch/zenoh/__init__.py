"""Processes on Zenoh (``rmw_zenoh_cpp``), an add-on; the rest calls it through ``enclave_launch.add_ons``.

planning    what a plan says of them: diagnostics, types, what --explain prints
start       their router's files, and the router of a launch
router      the process ``rmw_zenohd``
"""
