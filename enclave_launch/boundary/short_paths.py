"""Files below the working directory by the name that a person there would type. Looks at the file system."""

from __future__ import annotations

import os
import re

_REST = r"/([^\s:,;'\"()<>]+)"


def short_paths(text: str, folder: str) -> str:
    """``text`` without ``folder`` before the paths of files that are there.

    Only of files: a ROS name can begin like a folder (``/robot/cmd_vel`` seen from ``/robot``) and must stay whole.
    """
    root = folder.rstrip("/")
    if not root or root not in text:
        return text
    pattern = re.compile(rf"(?<![\w./-]){re.escape(root)}{_REST}")
    return pattern.sub(lambda found: found[1] if os.path.isfile(found[0]) else found[0], text)
