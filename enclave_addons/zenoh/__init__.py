"""Processes on Zenoh (``rmw_zenoh_cpp``), an add-on; the rest calls it through ``enclave_launch.add_ons``."""
