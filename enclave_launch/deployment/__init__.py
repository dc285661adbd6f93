"""From a plan to what runs processes on robots: systemd units, a Compose file, Kubernetes objects.

    processes.py        the plan's JSON document → processes as an engine runs them, each with its name
    placement.py        which process belongs on which host, what flows between hosts, in which order to restart
    semantics.py        what of the launch file an engine cannot express
    material.py         the enclaves' files                                          reads a keystore
    deployment.py       all of it together: what the three writers take
    systemd.py compose.py kubernetes.py      deployment → text of files
    folder.py           those files, in the place of what was generated before       writes files

All but material.py and folder.py perform no I/O; nothing here starts anything.
"""
