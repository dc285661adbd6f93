"""``launch.logging.handlers``: handlers of the standard library with a format for each logger."""

from __future__ import annotations

import logging.handlers
from typing import Any

StreamHandler = logging.StreamHandler
FileHandler = logging.FileHandler


def with_per_logger_formatting(cls: type[Any]) -> type[Any]:
    """Derive a handler class with ``setFormatterFor(logger, formatter)``."""

    class PerLogger(cls):  # type: ignore[misc]
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            self._formatters: dict[str, logging.Formatter] = {}

        def setFormatterFor(self, logger: logging.Logger, formatter: logging.Formatter) -> None:
            self._formatters[logger.name] = formatter

        def unsetFormatterFor(self, logger: logging.Logger) -> None:
            self._formatters.pop(logger.name, None)

        def format(self, record: logging.LogRecord) -> str:
            formatter = self._formatters.get(record.name)
            return formatter.format(record) if formatter is not None else str(super().format(record))

    return PerLogger
