"""``launch.logging``: loggers of the standard library below ``launch``, and the directory of the log files."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Mapping
from datetime import datetime
from importlib import import_module
from typing import TYPE_CHECKING, Any

from enclave_launch.host.current import current_host

if TYPE_CHECKING:
    import logging


def get_logger(name: str | None = None) -> logging.Logger:
    """Return the logger of this name, ``launch`` without one; silent unless the application sets logging up."""
    root = logging.getLogger("launch")
    if not root.handlers:
        root.addHandler(logging.NullHandler())
    logger = root if name is None else logging.getLogger(name)
    results = current_host().user_code_results
    if results is not None:
        results.listen(logger)
    return logger


def get_output_loggers(process_name: str, output_config: object) -> tuple[logging.Logger, logging.Logger]:
    """Return loggers for stdout and stderr of a process."""
    return get_logger(f"{process_name}-stdout"), get_logger(f"{process_name}-stderr")


class LaunchConfig:
    """Settings of launch's logging. ``level`` of the root logger, ``log_dir`` of this run. Other settings are kept and
    have no effect here."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self._log_dir: str | None = None
        self.screen_handler: Any = None
        self.file_handlers: dict[str, Any] = {}

    @property
    def level(self) -> int:
        return get_logger().level

    @level.setter
    def level(self, new_level: int) -> None:
        get_logger().setLevel(new_level)

    @property
    def log_dir(self) -> str:
        """Return the folder of this run below ``ROS_LOG_DIR``, else ``ROS_HOME/log``, else ``~/.ros/log``."""
        if self._log_dir is None:
            self._log_dir = os.path.join(log_base_directory(os.environ), _run_name())
        return self._log_dir

    @log_dir.setter
    def log_dir(self, new_log_dir: str) -> None:
        self._log_dir = os.path.abspath(os.path.expanduser(new_log_dir))

    def get_log_file_path(self, file_name: str = "launch.log") -> str:
        return os.path.join(self.log_dir, file_name)

    def set_screen_format(self, *_: Any, **__: Any) -> None:
        """Ignore the format; the name exists for compatibility."""

    def set_log_format(self, *_: Any, **__: Any) -> None:
        """Ignore the format; the name exists for compatibility."""


launch_config = LaunchConfig()


def log_launch_config(*, logger: logging.Logger | None = None) -> None:
    """Log where the log files of this run are."""
    (logger or get_logger()).info("All log files can be found below %s", launch_config.log_dir)


def reset() -> None:
    """Forget the log directory and all settings."""
    launch_config.reset()


def log_base_directory(environment: Mapping[str, str]) -> str:
    """Return ``$ROS_LOG_DIR``, else ``$ROS_HOME/log``, else ``~/.ros/log``; an empty variable counts as unset."""
    chosen = environment.get("ROS_LOG_DIR")
    if not chosen:
        chosen = os.path.join(environment.get("ROS_HOME") or os.path.join("~", ".ros"), "log")
    return os.path.normpath(os.path.expanduser(chosen))


def _run_name() -> str:
    return f"{datetime.now():%Y-%m-%d-%H-%M-%S-%f}-{socket.gethostname()}-{os.getpid()}"


def __getattr__(name: str) -> Any:
    if name == "LaunchLogger":
        return logging.getLoggerClass()
    if name == "handlers":
        return import_module(f"{__name__}.handlers")
    raise AttributeError(f"module 'launch.logging' has no attribute {name!r}")
