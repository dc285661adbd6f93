"""Make ``nodl`` mean our package: ROS's nodl_python, which comes with ros2launch_security, has the same import name."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

_HOME = str(Path(__file__).resolve().parents[1])
_NAME = "nodl"


def prefer_own_nodl() -> None:
    """Import our ``nodl`` wherever it is on the path, and in the place of another one that was imported before.

    Modules that imported the other one keep what they have of it. What is imported later finds ours, which has the
    functions of NoDL's own Python API under their names.
    """
    if not Path(_HOME, _NAME).is_dir():
        return  # the package keystore alone
    loaded = sys.modules.get(_NAME)
    if loaded is not None and str(Path(loaded.__file__ or "").resolve().parent.parent) == _HOME:
        return
    for name in [name for name in sys.modules if name.partition(".")[0] == _NAME]:
        del sys.modules[name]
    sys.path.insert(0, _HOME)
    try:
        import_module(_NAME)
    finally:
        sys.path.remove(_HOME)
