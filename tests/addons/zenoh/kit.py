"""Real Zenoh for the tests: a router that reads the keystore's file, sessions that read an enclave's, all on loopback.

A session of eclipse-zenoh in mode ``router`` is a full router with access control. Keys and QoS are those of rmw_zenoh
(docs/design.md, rmw_publisher_data.cpp, rmw_subscription_data.cpp). Nothing here waits for a time: what should come is
waited for, what should not is followed by something allowed on the same way, which overtakes nothing.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import zenoh
import zenoh.ext

PATIENCE = 30.0
STRING = "std_msgs::msg::dds_::String_/RIHS01_df668c74"
TRIGGER = "std_srvs::srv::dds_::Trigger_/RIHS01_eeff2cd6"
_marks, _ports = itertools.count(), itertools.count()


def wait_for(condition: Callable[[], object]) -> bool:
    """Whether ``condition`` became true; only a failing test waits for long."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True


def free_port() -> int:
    """Below those that the system gives to outgoing connections, so that it is still free when a router wants it; each
    test process begins elsewhere."""
    for _ in range(1000):
        port = 20_000 + (os.getpid() * 37 + next(_ports)) % 12_000
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("no free port between 20000 and 32000")


def router(keystore: Path, text: str | None = None) -> Any:
    """With the keystore's configuration, or ``text`` in its place."""
    content = json.loads(text or (keystore / "zenoh/router.json5").read_text())
    content["scouting"]["delay"] = 0
    return zenoh.open(zenoh.Config.from_json5(json.dumps(content)))


def session_text(keystore: Path, enclave: str) -> str:
    return (keystore / f"enclaves{enclave}/zenoh.json5").read_text()


def opened(text: str, **changes: object) -> Any:
    """A session of a configuration; ``changes`` by path: ``mode="peer"``, ``**{"connect/timeout_ms": 0}``."""
    config = zenoh.Config.from_json5(text)
    for path, value in changes.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def opens(text: str, **changes: object) -> bool:
    """Whether the router lets it in; no second try, since it refuses each alike."""
    try:
        session = opened(text, **{"connect/timeout_ms": 0, **changes})
    except zenoh.ZError:
        return False
    try:
        return bool(session.info.routers_zid())
    finally:
        session.close()


class Heard:
    """What a subscription got, as text by key."""

    def __init__(self) -> None:
        self.samples: list[tuple[str, str]] = []

    def __call__(self, sample: Any) -> None:
        self.samples.append((str(sample.key_expr), sample.payload.to_string()))

    def texts(self) -> list[str]:
        return [text for _, text in self.samples]

    def waits_for(self, text: str) -> bool:
        return wait_for(lambda: text in self.texts())


def mark() -> str:
    """A text that nobody else sends."""
    return f"mark {next(_marks)}"


def topic(name: str, domain: int = 0, type_and_hash: str = STRING) -> str:
    return f"{domain}{name}/{type_and_hash}"


def flushed(sender: Any, receiver_heard: Heard, allowed: str) -> None:
    """Everything that ``sender`` sent before has been delivered or dropped: one session keeps its order."""
    text = mark()
    sender.put(allowed, text)
    assert receiver_heard.waits_for(text), f"{allowed} is not delivered"


def passes(sender: Any, key: str, heard: Heard) -> bool:
    """Whether a message gets through; repeated, since a subscription takes a moment to be known."""
    text = mark()

    def arrived() -> bool:
        sender.put(key, text)
        return text in heard.texts()

    return wait_for(arrived)


def answers(client: Any, key: str) -> list[str]:
    """What a query gives, sent whether or not a server is known; it ends as soon as the router knows of none."""
    replies = client.get(key, payload="request", target=zenoh.QueryTarget.ALL_COMPLETE, timeout=PATIENCE)
    return [reply.ok.payload.to_string() for reply in replies if reply.ok is not None]


def client_of(session: Any, key: str) -> Any:
    """As rmw_zenoh makes a client of a service."""
    return session.declare_querier(key, target=zenoh.QueryTarget.ALL_COMPLETE, timeout=PATIENCE)


def called(client: Any) -> list[str]:
    """What a call of ``client_of`` gives; nothing is sent where its session knows of no server."""
    return [reply.ok.payload.to_string() for reply in client.get(payload="request") if reply.ok is not None]


def serving(session: Any, key: str, text: str) -> Any:
    return session.declare_queryable(key, lambda query: query.reply(query.key_expr, text), complete=True)


def transient_local_publisher(session: Any, key: str, *, heartbeats: bool = True) -> Any:
    """As rmw_zenoh makes them for TRANSIENT_LOCAL, with heartbeats those that are RELIABLE."""
    detection = zenoh.ext.MissDetectionConfig(sporadic_heartbeat=0.05)  # type: ignore[call-arg]
    return zenoh.ext.declare_advanced_publisher(
        session, key, cache=zenoh.ext.CacheConfig(max_samples=10), publisher_detection=True,
        sample_miss_detection=detection if heartbeats else None,
    )  # fmt: skip


def transient_local_subscription(session: Any, key: str, heard: Heard) -> Any:
    return zenoh.ext.declare_advanced_subscriber(
        session, key, heard, subscriber_detection=True,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=10),
        recovery=zenoh.ext.RecoveryConfig(heartbeat=True),  # type: ignore[call-arg]
    )  # fmt: skip


def token(
    enclave: str, kind: str, name: str = "", *, domain: int = 0, node: str = "n", type_and_hash: str = STRING
) -> str:
    """A liveliness token as rmw_zenoh makes it."""
    head = f"@ros2_lv/{domain}/{next(_marks):x}/0/0/{kind}/{enclave.replace('/', '%')}/%/{node}"
    return f"{head}/{name.replace('/', '%')}/{type_and_hash}/::,10:,:,:,," if name else head


def graph(session: Any, asked: str) -> set[str]:
    """The tokens that a session is shown."""
    return {str(one.ok.key_expr) for one in session.liveliness().get(asked, timeout=PATIENCE) if one.ok}


@contextlib.contextmanager
def closing(*sessions: Any) -> Iterator[None]:
    """Clients before the router: the other way round its end is an error of theirs."""
    try:
        yield
    finally:
        for session in sessions:
            session.close()
