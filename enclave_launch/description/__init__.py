"""The description model: our own ``launch``, ``launch_ros``, ``launch_xml``, ``launch_yaml`` and
``ament_index_python``, API-compatible with upstream's.

XML, YAML and Python launch files all build these objects; ``evaluation`` visits them. Every name lives in the
module where upstream has it, because launch files and third-party helpers import from there. ``install`` puts
the packages in place under their public names while we evaluate.
"""
