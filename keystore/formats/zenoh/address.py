"""Where the router is. Pure."""

from __future__ import annotations

import re
from typing import NamedTuple

from keystore.errors import InvalidInputError, printable

DEFAULT_PORT = 7447
_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_ADDRESS = re.compile(
    r"(?:\[([0-9A-Fa-f:.]+)\]|([A-Za-z0-9](?:[A-Za-z0-9.-]*[A-Za-z0-9])?))(?::([0-9]{1,5}))?\Z"
)


class RouterAddress(NamedTuple):
    """``host`` is what sessions connect to, and what the router's certificate says."""

    host: str = "localhost"
    port: int = DEFAULT_PORT

    @classmethod
    def parse(cls, text: str) -> RouterAddress:
        """``HOST``, ``HOST:PORT`` or ``[IPv6]:PORT``. Raises ``InvalidInputError``."""
        match = _ADDRESS.match(text)
        port = int(match[3] or DEFAULT_PORT) if match else 0
        if match is None or not 0 < port < 65536 or len(match[1] or match[2]) > 253:
            raise InvalidInputError(
                f"{printable(text)} is not where a router can be; write HOST or HOST:PORT"
            )
        return cls(match[1] or match[2], port)

    def __str__(self) -> str:
        return f"{self._bracketed}:{self.port}"

    @property
    def _bracketed(self) -> str:
        return f"[{self.host}]" if ":" in self.host else self.host

    @property
    def endpoint(self) -> str:
        """What sessions connect to."""
        return f"tls/{self}"

    @property
    def is_here(self) -> bool:
        """Whether only processes of the router's own host can reach it."""
        return self.host in _LOOPBACK

    @property
    def listens(self) -> str:
        """On loopback alone, or on every address of its host."""
        return self.endpoint if self.is_here else f"tls/[::]:{self.port}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """For its certificate."""
        return _LOOPBACK if self.is_here else (self.host,)
