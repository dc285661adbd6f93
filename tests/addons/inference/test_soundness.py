"""Whatever a program creates when it runs is among what inference says it may create.

Hypothesis writes node programs; each is executed against a recording stand-in for rclpy, with a stream of
coin tosses that decides its conditions (inference knows nothing of them). Every recorded name must be
matched by an inferred one.
"""

from __future__ import annotations

import random
import re
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from enclave_addons.inference import infer_paths
from nodl.name_template import NameTemplate

VARIABLES = ("a", "b", "c")
MAX_EVENTS = 4_000


class OutOfTosses(BaseException):
    """Ends endless programs."""


class Recorder:
    """What the stand-in libraries see: endpoints by kind and name, and callbacks to call back."""

    def __init__(self, seed: int):
        self._random = random.Random(seed)
        self._left = 400
        self.seen: set[tuple[str, str]] = set()
        self.callbacks: list[Callable[[], object]] = []

    def choose(self) -> bool:
        self._left -= 1
        if self._left < 0:
            raise OutOfTosses
        return self._random.random() < 0.5

    def add(self, kind: str, name: object) -> None:
        if isinstance(name, str):
            self.seen.add((kind, name))
        if len(self.seen) > MAX_EVENTS:
            raise OutOfTosses

    def call_back(self) -> None:
        """Run callbacks in some order, several times, as an executor may."""
        for _ in range(12):
            if self.callbacks:
                try:
                    self._random.choice(self.callbacks)()
                except OutOfTosses:
                    return
                except Exception:
                    continue  # the generated program's own mistakes


def stand_in(recorder: Recorder) -> dict[str, types.ModuleType]:
    """Modules ``rclpy``, ``rclpy.node``, ``std_msgs.msg`` and ``tosses`` that only record."""

    class Node:
        def __init__(self, name: str) -> None:
            recorder.add("node", name)

        def create_publisher(self, _: object, topic: str, __: object) -> None:
            recorder.add("publisher", topic)

        def create_subscription(self, _: object, topic: str, callback: Any, __: object) -> None:
            recorder.add("subscription", topic)
            recorder.callbacks.append(lambda: callback("message"))

        def create_client(self, _: object, name: str) -> None:
            recorder.add("service_client", name)

        def create_timer(self, _: float, callback: Any) -> None:
            recorder.callbacks.append(callback)

    modules = {
        name: types.ModuleType(name) for name in ("rclpy", "rclpy.node", "std_msgs", "std_msgs.msg", "tosses")
    }
    vars(modules["rclpy"]).update(init=lambda: None, spin=lambda node: recorder.call_back())
    vars(modules["rclpy.node"]).update(Node=Node)
    vars(modules["std_msgs.msg"]).update(String=object)
    vars(modules["tosses"]).update(choose=recorder.choose)
    return modules


@contextmanager
def installed(modules: dict[str, types.ModuleType]) -> Iterator[None]:
    before = {name: sys.modules.get(name) for name in modules}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


# --- programs -----------------------------------------------------------------------------------------------

literals = st.sampled_from(["'x'", "'y1'", "'scan'", "'/abs'", "'p/q'"])


def expressions() -> st.SearchStrategy[str]:
    base = st.one_of(
        literals, st.sampled_from(VARIABLES), st.sampled_from(["self.f", "self.g", "TOPIC", "self.K"])
    )

    def compound(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        pair = st.tuples(inner, inner)
        return st.one_of(
            pair.map(lambda p: f"({p[0]} + {p[1]})"),
            pair.map(lambda p: f"f'{{{p[0]}}}_{{{p[1]}}}'" if "'" not in p[0] + p[1] else f"({p[0]} + '_')"),
            pair.map(lambda p: f"('%s-%s' % ({p[0]}, {p[1]}))"),
            pair.map(lambda p: f"'{{}}.{{}}'.format({p[0]}, {p[1]})"),
            pair.map(lambda p: f"'/'.join([{p[0]}, {p[1]}])"),
            pair.map(lambda p: f"({p[0]} if choose() else {p[1]})"),
            pair.map(lambda p: f"({p[0]} or {p[1]})"),
            inner.map(lambda e: f"str({e}).upper()"),
            inner.map(lambda e: f"{e}.strip('/')"),
            inner.map(lambda e: f"self.helper({e})"),
            inner.map(lambda e: f"table.get({e}, 'none')"),
            inner.map(lambda e: f"(lambda v: v + 'l')({e})"),
            inner.map(lambda e: f"[w + 'c' for w in items + [{e}]][-1]"),
            st.just("items[0]"),
            st.just("items[-1]"),
            st.just("table['k']"),
        )

    return st.recursive(base, compound, max_leaves=4)


EXPRESSION = expressions()


def simple_statements() -> st.SearchStrategy[list[str]]:
    variable = st.sampled_from(VARIABLES)
    single = st.one_of(
        st.tuples(variable, EXPRESSION).map(lambda p: f"{p[0]} = {p[1]}"),
        st.tuples(variable, EXPRESSION).map(lambda p: f"{p[0]} += {p[1]}"),
        EXPRESSION.map(lambda e: f"self.f = {e}"),
        EXPRESSION.map(lambda e: f"self.g = {e}"),
        EXPRESSION.map(lambda e: f"items.append({e})"),
        EXPRESSION.map(lambda e: f"table['k'] = {e}"),
        st.tuples(EXPRESSION, EXPRESSION).map(lambda p: f"table[{p[0]}] = {p[1]}"),
        EXPRESSION.map(lambda e: f"self.create_publisher(String, {e}, 10)"),
        EXPRESSION.map(lambda e: f"self.create_client(String, {e})"),
        EXPRESSION.map(lambda e: f"self.create_subscription(String, {e}, self.heard, 10)"),
        st.just("self.create_timer(1.0, self.tick)"),
        variable.map(
            lambda v: f"self.create_timer(1.0, lambda {v}={v}: self.create_publisher(String, {v}, 1))"
        ),
        variable.map(lambda v: f"self.create_timer(1.0, lambda: self.create_client(String, {v}))"),
        EXPRESSION.map(lambda e: f"a, *rest = [{e}, 'r1', 'r2']"),
        st.just("items.pop()"),
        st.just("items = items + ['more']"),
    )
    return single.map(lambda line: [line])


def indented(lines: list[str]) -> list[str]:
    return ["    " + line for line in lines]


def statements(depth: int, loop: bool = False) -> st.SearchStrategy[list[str]]:
    if depth == 0:
        return simple_statements()
    inner = blocks(depth - 1, loop)
    looped = blocks(depth - 1, True)
    options = [
        simple_statements(),
        st.tuples(inner, inner).map(
            lambda p: ["if choose():", *indented(p[0]), "else:", *indented(p[1])]
        ),
        inner.map(lambda body: ["if choose():", *indented(body)]),
        st.tuples(EXPRESSION, looped).map(
            lambda p: [f"for b in ['u', {p[0]}, 'w']:", *indented(p[1])]
        ),
        looped.map(lambda body: ["for c in list(items):", *indented(body)]),
        looped.map(lambda body: ["for n in range(3):", "    a = f'r{n}'", *indented(body)]),
        looped.map(lambda body: ["while choose():", *indented(body)]),
        st.tuples(inner, inner).map(
            lambda p: [
                "try:", *indented(p[0]), "    if choose():", "        raise ValueError", "    b = 'after'",
                "except ValueError:", *indented(p[1]),
            ]
        ),
        inner.map(lambda body: ["try:", *indented(body), "finally:", "    self.f = 'finally'"]),
        st.tuples(inner, EXPRESSION).map(
            lambda p: [
                "def inner(c, b='default'):", *indented(p[0]), "    return c + b",
                f"a = inner({p[1]})", "b = inner('i', b=a)",
            ]
        ),
        inner.map(
            lambda body: ["def change():", "    nonlocal c", *indented(body), "    c = a + 'n'", "change()"]
        ).filter(lambda lines: not any("def change" in line for line in lines[1:-1])),
        st.just(["if choose():", "    return 'early'"]),
    ]  # fmt: skip
    if loop:
        options.append(st.sampled_from([["if choose():", "    break"], ["if choose():", "    continue"]]))
    return st.one_of(options)


def blocks(depth: int, loop: bool = False) -> st.SearchStrategy[list[str]]:
    return st.lists(statements(depth, loop), min_size=1, max_size=3).map(
        lambda parts: [line for part in parts for line in part]
    )


@st.composite
def programs(draw: st.DrawFn) -> str:
    body, tick, heard = (draw(blocks(depth)) for depth in (2, 1, 1))
    prologue = ["a = 'a'; b = 'b'; c = 'c'", "items = ['i1', 'i2']", "table = {'k': 'v', 'x': 'tx'}"]
    lines = [
        "import rclpy",
        "from rclpy.node import Node",
        "from std_msgs.msg import String",
        "from tosses import choose",
        "TOPIC = 'constant'",
        "class Base(Node):",
        "    K = 'class_value'",
        "    def __init__(self, name):",
        "        super().__init__(name)",
        "        self.f = 'f0'",
        "class N(Base):",
        "    g = 'g0'",
        "    def __init__(self):",
        "        super().__init__('n')",
        "        self.work()",
        "    def work(self):",
        *indented(indented([*prologue, *body])),
        "        return 'done'",
        "    def tick(self):",
        *indented(indented([*prologue, *tick])),
        "    def heard(self, message):",
        *indented(indented([*prologue, *heard])),
        "    def helper(self, v):",
        "        if choose():",
        "            return v + '_h'",
        f"        return {draw(literals)}",
        "rclpy.init()",
        "try:",
        "    N()",
        "except Exception:",
        "    pass",
        "rclpy.spin(None)",
    ]
    return "\n".join(lines) + "\n"


def executed(program: str, seed: int) -> set[tuple[str, str]]:
    recorder = Recorder(seed)
    with installed(stand_in(recorder)), suppress(OutOfTosses):  # what it created before its end still counts
        exec(compile(program, "program.py", "exec"), {"__name__": "__main__"})
    return recorder.seen


def matcher(template: NameTemplate) -> re.Pattern[str]:
    pieces = (re.escape(part) if isinstance(part, str) else ".*" for part in template.parts)
    return re.compile("".join(pieces) + r"\Z", re.DOTALL)


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(programs(), st.integers(0, 1_000_000))
def test_everything_that_is_created_was_inferred(program: str, seed: int) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, "program.py")
        path.write_text(program, encoding="utf-8")
        system = infer_paths([path])
    inferred = {(e.kind.value, matcher(e.name)) for node in system.nodes for e in node.endpoints}
    for run in range(3):
        for kind, name in executed(program, seed + run):
            if kind == "node":
                assert name in {node.name for node in system.nodes}
                continue
            assert any(k == kind and pattern.match(name) for k, pattern in inferred), (
                f"{kind} {name}\n{program}"
            )
