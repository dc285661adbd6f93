"""The error of a file that no loader could read."""

from __future__ import annotations

from collections.abc import Sequence


class InvalidLaunchFileError(Exception):
    """``likely_errors``: what each loader said, the likeliest first."""

    def __init__(self, extension: str = "", *, likely_errors: Sequence[BaseException] | None = None) -> None:
        self._extension = extension
        self._likely_errors = likely_errors
        self._error_message = _message(extension, likely_errors or ())
        if extension and likely_errors:
            self.__cause__ = likely_errors[0]

    @property
    def likely_errors(self) -> Sequence[BaseException]:
        return self._likely_errors or ()

    def __str__(self) -> str:
        return self._error_message


def _message(extension: str, errors: Sequence[BaseException]) -> str:
    if not extension or not errors:
        return "The launch file may have a syntax error, or its format is unknown"
    count = "multiple exceptions" if len(errors) > 1 else "exception"
    lines = [f"\n - {type(error).__name__}: {error}" for error in errors]
    return f"Caught {count} when trying to load file of format [{extension}]:{''.join(lines)}"
