"""Zenoh's configuration from the same policy that makes DDS permissions: an add-on.

    grants           what an enclave may do, as topics and services     <- DDS topics of its permissions
    key_expressions  ROS names and types -> key expressions             (rmw_zenoh docs/design.md)
    types            which types its launches know
    rules            grants -> the access-control rules of one enclave
    configuration    all enclaves -> the file of ``rmw_zenohd``, which enforces; the file of one enclave's processes,
                     clients of that router; where the router is
    meaning          key expressions -> ROS words: the way back
    comparison       two files -> who may do what else, and which protection is gone
    trace            the router's log -> what it refused

Where DDS-Security signs a document for each participant and every participant checks its peers, Zenoh has one
place that enforces: the router's own configuration, by the common name of each client's certificate. The
certificates are the same.
"""
