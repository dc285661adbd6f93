"""Version check of ``launch_ros.node_action`` extensions."""

from __future__ import annotations


class PluginException(Exception):
    """An extension that was written for another version of the extension point."""


def satisfies_version(version: str, caret_range: str) -> None:
    """Raise ``PluginException`` unless ``version`` lies in ``^MAJOR.MINOR``: same major, for 0 same minor."""
    if not caret_range.startswith("^"):
        raise AssertionError("Only supports caret ranges")
    have, wanted = _numbers(version), _numbers(caret_range[1:])
    upper = (wanted[0] + 1, 0) if wanted[0] else (0, wanted[1] + 1)
    if have < wanted:
        raise PluginException(
            f"Extension point is too old ({version}), the extension requires {caret_range[1:]!r}"
        )
    if have >= upper:
        raise PluginException(
            f"Extension point is newer ({version}), than what the extension supports {caret_range[1:]!r}"
        )


def _numbers(version: str) -> tuple[int, int]:
    major, _, rest = version.partition(".")
    return int(major), int(rest.partition(".")[0] or 0)
