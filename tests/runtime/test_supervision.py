"""One process over its life: respawn, escalation, and the messages that launch writes."""

from __future__ import annotations

import asyncio
import os
import re
import time
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

from enclave_launch import ProvisionError
from enclave_launch.runtime import supervision
from enclave_launch.runtime.launch_log import Level
from enclave_launch.runtime.process_tree import Hold, ProcessSpec, ProcessTree, Stream
from enclave_launch.runtime.supervision import (
    TOLERATED,
    LifeRules,
    Patience,
    ProcessEnd,
    SupervisedProcess,
    pause_after,
)
from tests.runtime.conftest import alive, eventually, read_pid

STUBBORN = "trap '' INT TERM; echo ready; while true; do sleep 0.05; done"
QUICK = Patience(0.2, 0.2)


class Story:
    """What happened to one process, in order."""

    def __init__(self) -> None:
        self.pids: list[int] = []
        self.exits: list[int] = []
        self.output = b""
        self.lines: list[tuple[Level, str]] = []

    waits_for: Mapping[Stream, frozenset[Hold]] = MappingProxyType({})

    def on_started(self, pid: int) -> None:
        self.pids.append(pid)

    def on_output(self, stream: Stream, data: bytes) -> None:
        self.output += data

    def on_exited(self, pid: int, returncode: int) -> None:
        self.exits.append(returncode)

    def say(self, level: Level, message: str) -> None:
        self.lines.append(
            (level, re.sub(r"pid \[?\d+", lambda found: found[0].rstrip("0123456789") + "PID", message))
        )

    async def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 10
        while not condition():
            assert time.monotonic() < deadline, self.lines
            await asyncio.sleep(0.005)


Steps = Callable[[SupervisedProcess, Story], Awaitable[None]]


def lived(
    script: str, rules: LifeRules | None = None, steps: Steps | None = None
) -> tuple[ProcessEnd, Story]:
    story = Story()

    async def prepare() -> ProcessSpec:
        return ProcessSpec((script,), dict(os.environ), shell=True)

    async def main() -> ProcessEnd:
        async with ProcessTree() as tree:
            process = SupervisedProcess("a-1", prepare, tree, rules or LifeRules(), story, story.say)
            running = asyncio.create_task(process.run())
            if steps is not None:
                await steps(process, story)
            return await asyncio.wait_for(running, 20)

    return asyncio.run(main()), story


def test_a_bad_end() -> None:
    outcome, story = lived("exit 7")
    assert outcome == ProcessEnd(7, requested_to_end=False)
    assert story.lines[-1] == ("ERROR", "process has died [pid PID, exit code 7, cmd 'exit 7'].")


def test_a_program_that_cannot_be_started() -> None:
    story = Story()

    async def prepare() -> ProcessSpec:
        return ProcessSpec(("/no/such/program",), {})

    async def main() -> ProcessEnd:
        async with ProcessTree() as tree:
            return await SupervisedProcess(
                "a-1", prepare, tree, LifeRules(respawn=True), story, story.say
            ).run()

    assert asyncio.run(main()) == ProcessEnd(None, requested_to_end=False)
    assert story.lines == [("ERROR", "cannot start process: No such file or directory: '/no/such/program'")]


def test_the_delay_before_a_respawn_is_kept_and_cut_short_by_the_end() -> None:
    async def steps(process: SupervisedProcess, story: Story) -> None:
        await story.until(lambda: bool(story.exits))
        await asyncio.sleep(0.2)
        assert len(story.pids) == 1
        process.end(QUICK)

    start = time.monotonic()
    _, story = lived("true", LifeRules(respawn=True, respawn_delay=30.0), steps)
    assert len(story.pids) == 1
    assert time.monotonic() - start < 10


def test_a_successor_does_not_meet_what_its_predecessor_left(tmp_path: Path) -> None:
    script = f"cp {tmp_path}/now {tmp_path}/before; sleep 60 >/dev/null & echo $! > {tmp_path}/now"
    survived: list[bool] = []

    async def steps(process: SupervisedProcess, story: Story) -> None:
        await story.until(lambda: len(story.exits) == 2)
        first = await asyncio.to_thread(read_pid, tmp_path / "before")
        gone = await asyncio.to_thread(eventually, lambda: not alive(first))
        survived.append(not gone)

    (tmp_path / "now").write_text("0")
    lived(script, LifeRules(respawn=True, max_retries=1, respawn_delay=0.05), steps)
    assert survived == [False]


def test_sigint_ends_it_and_says_so() -> None:
    async def steps(process: SupervisedProcess, story: Story) -> None:
        await story.until(lambda: story.output == b"ready\n")
        process.end(Patience())

    _, story = lived("trap 'exit 0' INT; echo ready; while true; do sleep 0.05; done", steps=steps)
    assert story.lines[1:] == [
        ("INFO", "sending signal 'SIGINT' to process[a-1]"),
        ("INFO", "process has finished cleanly [pid PID]"),
    ]


def test_a_child_that_ignores_sigint_and_sigterm_is_killed() -> None:
    async def steps(process: SupervisedProcess, story: Story) -> None:
        await story.until(lambda: story.output == b"ready\n")
        process.end(QUICK, quiet=True)

    outcome, story = lived(STUBBORN, steps=steps)
    assert outcome == ProcessEnd(-9, requested_to_end=True)
    assert story.lines[1:-1] == [
        (
            "ERROR",
            "process[a-1] failed to terminate '0.2' seconds after receiving 'SIGINT', escalating to 'SIGTERM'",
        ),
        ("INFO", "sending signal 'SIGTERM' to process[a-1]"),
        (
            "ERROR",
            "process[a-1] failed to terminate '0.4' seconds after receiving 'SIGTERM', escalating to 'SIGKILL'",
        ),
        ("INFO", "sending signal 'SIGKILL' to process[a-1]"),
    ]


def test_requested_to_end_before_it_was_started() -> None:
    async def steps(process: SupervisedProcess, story: Story) -> None:
        process.end(QUICK)

    outcome, story = lived("exec sleep 60", steps=steps)
    assert outcome.requested_to_end
    assert story.exits in ([], [-2])


def test_a_refusal_to_prepare_starts_nothing_and_reaches_the_caller() -> None:
    story = Story()

    async def prepare() -> ProcessSpec:
        raise ProvisionError("keystore is read-only")

    async def main() -> None:
        async with ProcessTree() as tree:
            await SupervisedProcess("a-1", prepare, tree, LifeRules(), story, story.say).run()

    with pytest.raises(ProvisionError, match="read-only"):
        asyncio.run(main())
    assert story.pids == []


def test_the_first_short_lives_are_answered_at_once_and_then_the_pauses_grow_to_five_seconds() -> None:
    assert [pause_after(lives) for lives in range(TOLERATED + 1)] == [0.0] * (TOLERATED + 1)
    assert [pause_after(TOLERATED + n) for n in range(1, 9)] == [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0]
    assert pause_after(10**9) == 5.0


def test_a_process_that_ends_at_once_again_and_again_is_started_at_growing_distances_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(supervision, "SHORT_LIFE", 60.0)  # on a busy machine the shell may live for a second
    _, story = lived("exit 1", LifeRules(respawn=True, max_retries=TOLERATED + 1))
    put_off = [text for level, text in story.lines if level == "WARNING"]
    assert put_off == [
        f"process ended within 60 s of its start {TOLERATED + 1} times in a row; the next start is in 0.1 s"
    ]
    assert len(story.exits) == TOLERATED + 2


def test_a_respawn_delay_of_the_launch_file_that_is_longer_stands() -> None:
    _, story = lived("exit 1", LifeRules(respawn=True, respawn_delay=0.12, max_retries=TOLERATED + 1))
    assert [text for level, text in story.lines if level == "WARNING"] == []


@pytest.mark.parametrize("cmd", [("echo", "a\0b"), ("ec\0ho",)], ids=["argument", "program"])
def test_a_nul_character_is_told_and_never_taken_for_a_start(cmd: tuple[str, ...]) -> None:
    story = Story()

    async def prepare() -> ProcessSpec:
        return ProcessSpec(cmd, dict(os.environ))

    async def main() -> ProcessEnd:
        async with ProcessTree() as tree:
            return await SupervisedProcess("a-1", prepare, tree, LifeRules(), story, story.say).run()

    assert asyncio.run(main()) == ProcessEnd(returncode=None, requested_to_end=False)
    assert story.pids == []
    assert "holds a NUL character" in story.lines[0][1]
