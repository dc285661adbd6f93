"""Route the output of a process: ``output=`` of a process action (launch/logging, ``get_output_loggers``)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

Source = Literal["stdout", "stderr", "both"]
OutputSetting = str | Mapping[str, str | Iterable[str]]
Routes = Mapping[Source, frozenset[str]]  # source -> destinations out of DESTINATIONS

SOURCES: tuple[Source, ...] = ("stdout", "stderr", "both")
DESTINATIONS = frozenset({"screen", "log", "own_log"})
ALIASES: dict[str, dict[Source, set[str]]] = {
    "screen": {"both": {"screen"}},
    "log": {"both": {"log"}, "stderr": {"screen"}},
    "both": {"both": {"log", "screen"}},
    "own_log": {"both": {"own_log"}, "stdout": {"own_log"}, "stderr": {"own_log"}},
    "full": {"both": {"screen", "log", "own_log"}, "stdout": {"own_log"}, "stderr": {"own_log"}},
}


def output_routes(setting: OutputSetting) -> Routes:
    """Return where each stream goes; raises ValueError for what launch does not know."""
    if isinstance(setting, str):
        if setting not in ALIASES:
            raise ValueError(
                f'{setting} is not a valid standard output config i.e. "screen", "log" or "both"'
            )
        named: Mapping[str, Iterable[str]] = dict(ALIASES[setting].items())
    else:
        named = {source: {to} if isinstance(to, str) else set(to) for source, to in setting.items()}
    for source, destinations in named.items():
        if source not in SOURCES:
            raise ValueError(f'{source} is not a valid output source i.e. "stdout", "stderr" or "both"')
        for destination in destinations:
            if destination not in DESTINATIONS:
                raise ValueError(
                    f'{destination} is not a valid output destination i.e. "screen", "log" or "own_log"'
                )
    return {source: frozenset(named.get(source, ())) for source in SOURCES}
