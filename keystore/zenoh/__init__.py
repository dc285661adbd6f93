"""Zenoh's configuration from the same policy that makes DDS permissions: an add-on.

Zenoh has one place that enforces: the router's configuration, by the common name of each client's certificate. The
certificates are those of DDS.
"""
