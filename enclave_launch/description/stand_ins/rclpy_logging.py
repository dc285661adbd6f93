"""The module ``rclpy.logging``, for launch files that log with it. It is used if rclpy cannot be imported.

Messages go where those of launch itself go. Nothing else of rclpy is here: a launch file that makes a node needs rclpy.
"""

from __future__ import annotations

from enum import IntEnum

from enclave_launch.description.logging import get_logger as launch_logger


class LoggingSeverity(IntEnum):
    """The levels of rcutils; those of Python's logging have the same numbers."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


class RclpyLogger:
    """A logger with the methods of rclpy's. ``once``, ``throttle_duration_sec`` and the like are not followed."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._logger = launch_logger(name)

    def get_child(self, name: str) -> RclpyLogger:
        """Return the logger ``PARENT.name``."""
        return RclpyLogger(f"{self.name}.{name}")

    def set_level(self, level: int) -> None:
        self._logger.setLevel(int(level))

    def get_effective_level(self) -> LoggingSeverity:
        return LoggingSeverity(self._logger.getEffectiveLevel())

    def is_enabled_for(self, severity: int) -> bool:
        return self._logger.isEnabledFor(int(severity))

    def log(self, message: str, severity: int, **_: object) -> bool:
        """Log; returns whether the level lets the message through."""
        self._logger.log(int(severity), "%s", message)
        return self.is_enabled_for(severity)

    def debug(self, message: str, **_: object) -> bool:
        return self.log(message, LoggingSeverity.DEBUG)

    def info(self, message: str, **_: object) -> bool:
        return self.log(message, LoggingSeverity.INFO)

    def warning(self, message: str, **_: object) -> bool:
        return self.log(message, LoggingSeverity.WARN)

    warn = warning

    def error(self, message: str, **_: object) -> bool:
        return self.log(message, LoggingSeverity.ERROR)

    def fatal(self, message: str, **_: object) -> bool:
        return self.log(message, LoggingSeverity.FATAL)


def get_logger(name: str) -> RclpyLogger:
    """Return the logger of that name; raises ValueError for an empty one."""
    if not name:
        raise ValueError("Logger name must not be empty.")
    return RclpyLogger(name)


def set_logger_level(name: str, level: int) -> None:
    """Set the level of the logger of that name."""
    get_logger(name).set_level(level)


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """Return the level that holds for the logger of that name."""
    return get_logger(name).get_effective_level()
