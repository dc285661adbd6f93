"""Where the logs of a run go, laid out as launch does it. Touches the world: makes the directory and a link.

Source: launch/logging/__init__.py (``_get_logging_directory``, ``_make_unique_log_dir``,
``_renew_latest_log_dir``).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from enclave_launch.errors import RuntimeFailure


def log_base_directory(environment: Mapping[str, str]) -> Path:
    """``$ROS_LOG_DIR``, else ``$ROS_HOME/log``, else ``~/.ros/log``; an empty variable counts as unset."""
    chosen = environment.get("ROS_LOG_DIR")
    if not chosen:
        chosen = os.path.join(environment.get("ROS_HOME") or os.path.join("~", ".ros"), "log")
    return Path(os.path.normpath(os.path.expanduser(chosen)))


def make_log_directory(base: Path, now: datetime, host: str, pid: int) -> Path:
    """A new ``<date>-<host>-<pid>`` below ``base``, with the link ``latest`` beside it renewed.

    :raises RuntimeFailure: it cannot be written.
    """
    directory = base / f"{now.strftime('%Y-%m-%d-%H-%M-%S-%f')}-{host}-{pid}"
    try:
        directory.mkdir(parents=True)
    except OSError as error:
        raise RuntimeFailure(
            f"cannot create the log directory {directory}: {error.strerror}; "
            "set ROS_LOG_DIR to a directory that can be written"
        ) from error
    _renew_latest(base / "latest", directory)
    return directory


def _renew_latest(link: Path, directory: Path) -> None:
    """Atomically, since other launches do the same; what is not a link is left alone, a failure is
    passed over.
    """
    if link.exists() and not link.is_symlink():
        return
    fresh = link.with_name(f".latest-{os.getpid()}")
    try:
        fresh.symlink_to(directory, target_is_directory=True)
        fresh.replace(link)
    except OSError:
        fresh.unlink(missing_ok=True)
