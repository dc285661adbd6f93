"""The description model: our own ``launch``, ``launch_ros``, ``launch_xml``, ``launch_yaml`` and
``ament_index_python``, API-compatible with upstream's.

XML, YAML and Python launch files all build these objects; ``visit`` walks over them. Modules stand by subject:
``actions/``, ``substitutions/``, ``events/``, ``parameters/``, ``markup/`` (the front ends' classes). Where upstream
has each name is one table, ``upstream_paths``; ``install`` puts modules of those names in place while we evaluate.
"""
