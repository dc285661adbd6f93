"""``launch.descriptions``."""

from enclave_launch.description.lazy import lazy_names

__getattr__, __dir__ = lazy_names(__name__, {"Executable": "executable"})
