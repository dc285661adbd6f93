"""The lines of a record: JSON objects, one a line, distinguished by ``what``. Performs no I/O.

``loaded``, ``init``, ``node``, ``node_end``, ``state``, ``parameters``, ``ended`` and the six kinds of endpoints come
from the recorder in a process (``enclave_addons/recording/recorder.c``); they carry ``pid``, ``thread``, ``at``
(monotonic, nanoseconds) and ``n``, which counts the lines of a process from 1. ``run``, ``process`` and ``component``
come from the supervisor and say what it started. Unknown kinds and fields are passed over: newer recorders may say
more.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from nodl.node_interface import EndpointKind


class Loaded(NamedTuple):
    """The recorder is in a process. ``session`` leads to the process that a supervisor started; ``forked``: the
    process is a copy of its parent."""

    pid: int
    at: int
    parent: int
    session: int
    program: str
    forked: bool = False


class Initialised(NamedTuple):
    """A call of ``rcl_init``: the process uses ROS."""

    pid: int
    at: int
    rc: int
    middleware: str = ""
    by: str = ""
    error: tuple[str, ...] = ()


class NodeMade(NamedTuple):
    """A call of ``rcl_node_init``: ``name`` and ``namespace`` as the source gives them, ``fqn`` the final name."""

    pid: int
    thread: int
    at: int
    node: int
    rc: int
    name: str
    namespace: str
    fqn: str
    by: str = ""
    error: tuple[str, ...] = ()


class NodeEnded(NamedTuple):
    """A node was destroyed."""

    pid: int
    at: int
    node: int


class StateEntered(NamedTuple):
    """A lifecycle node is in ``state`` now: ``inactive``, ``active``, ``errorprocessing`` ..."""

    pid: int
    at: int
    node: int
    state: str


class ParametersDeclared(NamedTuple):
    """The node says that it declared parameters; ``values``: those that could be in a name."""

    pid: int
    at: int
    node: int
    values: Mapping[str, object]


class EndpointMade(NamedTuple):
    """An endpoint that was requested; ``rc`` 0 is granted, 1 refused or failed, others say that an argument is bad.

    ``written`` is the name as the source has it, ``final`` after expansion and remapping (empty when rcl could not
    say), ``by`` the library that called rcl, ``error`` all texts that passed, the first cause first. ``qos``:
    history, depth, reliability, durability as rmw numbers them.
    """

    kind: EndpointKind
    pid: int
    thread: int
    at: int
    node: int
    rc: int
    written: str
    fqn: str
    final: str
    type: str
    by: str
    qos: tuple[int, ...] = ()
    error: tuple[str, ...] = ()


class Ended(NamedTuple):
    """A process said that it ends."""

    pid: int
    at: int


class RecordedRun(NamedTuple):
    """The launch of a run, written once by the supervisor. ``id`` differs for each run."""

    id: str
    launch_file: str = ""
    distro: str = ""
    isolation: str = ""
    date: str = ""
    secured: bool = False


class StartedProcess(NamedTuple):
    """A process of the launch. ``arguments``: the words behind the program that are no ROS arguments; ``rules``:
    remap rules ``FROM:=TO`` of its command line."""

    pid: int
    process: str
    package: str
    executable: str
    kind: str = "node"
    fqn: str = ""
    enclave: str = ""
    location: str = ""
    arguments: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()
    parameters: Mapping[str, object] = MappingProxyType({})


class LoadedComponent(NamedTuple):
    """A composable node that the launch asks ``container`` to load, ``name`` and ``namespace`` as requested."""

    container: str
    package: str
    plugin: str
    name: str = ""
    namespace: str = ""
    location: str = ""
    rules: tuple[str, ...] = ()
    parameters: Mapping[str, object] = MappingProxyType({})


Line = (
    Loaded
    | Initialised
    | NodeMade
    | NodeEnded
    | StateEntered
    | ParametersDeclared
    | EndpointMade
    | Ended
    | RecordedRun
    | StartedProcess
    | LoadedComponent
)


class Complaint(NamedTuple):
    """Why a record is not complete: a line that is missing, cut or unreadable. ``pid`` 0: not known whose."""

    pid: int
    why: str


_ENDPOINTS = {kind.value: kind for kind in EndpointKind}
_MOST_MISSING = 100_000


class LineReader:
    """Bytes in any portions → lines. Keeps what it could not read as ``complaints``."""

    def __init__(self) -> None:
        self.complaints: list[Complaint] = []
        self._rest = b""
        self._highest: dict[int, int] = {}
        # Threads number their lines in one order and write them in another.
        self._missing: dict[int, set[int]] = {}

    def feed(self, data: bytes) -> list[Line]:
        """Return the lines that ``data`` completes."""
        *whole, self._rest = (self._rest + data).split(b"\n")
        return [line for text in whole if (line := self._line(text)) is not None]

    def close(self) -> None:
        """Report what is missing: a last line without its end was cut, and what has not come by now is lost."""
        if self._rest.strip():
            self._complain(0, f"a line was cut off: {_shown(self._rest)}")
        self._rest = b""
        for pid in list(self._missing):
            self._settle(pid)

    def _line(self, text: bytes) -> Line | None:
        if not text.strip():
            return None
        try:
            fields = json.loads(text)
            line = _parse(fields)
        except (ValueError, KeyError, TypeError, RecursionError):
            self._complain(0, f"a line cannot be read: {_shown(text)}")
            return None
        self._check_number(fields)
        return line

    def _check_number(self, fields: Mapping[str, Any]) -> None:
        pid, number = fields.get("pid"), fields.get("n")
        if not isinstance(pid, int) or not isinstance(number, int):
            return
        # The first line of a program; one process may run several, one after another.
        if fields["what"] == "loaded":
            self._settle(pid)
            self._highest[pid] = 0
        highest = self._highest.get(pid, 0)
        missing = self._missing.setdefault(pid, set())
        missing.update(range(highest + 1, min(number, highest + _MOST_MISSING)))
        missing.discard(number)
        self._highest[pid] = max(highest, number)
        if fields.get("cut") is True:
            self._complain(pid, f"line {number} of process {pid} has a text that was too long and is cut")

    def _settle(self, pid: int) -> None:
        missing = self._missing.pop(pid, set())
        if missing:
            lines = f"line {min(missing)}" if len(missing) == 1 else f"lines {min(missing)} to {max(missing)}"
            self._complain(pid, f"{len(missing)} of the lines of process {pid} are missing: {lines}")

    def _complain(self, pid: int, why: str) -> None:
        self.complaints.append(Complaint(pid, why))


def read_lines(text: bytes) -> tuple[list[Line], list[Complaint]]:
    """Read a whole record at once."""
    reader = LineReader()
    lines = reader.feed(text)
    reader.close()
    return lines, reader.complaints


def line_text(line: RecordedRun | StartedProcess | LoadedComponent) -> bytes:
    """Return a line of the supervisor, ready to be appended."""
    what = {RecordedRun: "run", StartedProcess: "process", LoadedComponent: "component"}[type(line)]
    fields = {name: dict(v) if isinstance(v, Mapping) else v for name, v in line._asdict().items()}
    text = json.dumps({"what": what, **fields}, ensure_ascii=True, default=_plain)
    return text.encode() + b"\n"


def _plain(value: object) -> object:
    """Return byte strings of parameters as ROS parameter files write them."""
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _parse(fields: Mapping[str, Any]) -> Line | None:
    what = fields["what"]
    if what in _ENDPOINTS:
        named = {**fields, "written": fields.get("name")}
        return EndpointMade(_ENDPOINTS[what], *_values(EndpointMade._fields[1:], named))
    if what == "parameters":
        values = declared_values(bytes.fromhex(_str(fields, "cdr")))
        return ParametersDeclared._make([*_values(("pid", "at", "node"), fields), values])
    kind = _KINDS.get(what)
    return kind(*_values(kind._fields, fields)) if kind else None


_KINDS: dict[str, Any] = {
    "loaded": Loaded,
    "init": Initialised,
    "node": NodeMade,
    "node_end": NodeEnded,
    "state": StateEntered,
    "ended": Ended,
    "run": RecordedRun,
    "process": StartedProcess,
    "component": LoadedComponent,
}


def _values(names: Iterable[str], fields: Mapping[str, Any]) -> list[Any]:
    """Return fields of these names in this order, each of the type that its name has in every line."""
    return [_READERS.get(name, _str)(fields, name) for name in names]


def _int(fields: Mapping[str, Any], name: str) -> int:
    value = fields.get(name, 0)
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(name)
    return value


def _str(fields: Mapping[str, Any], name: str) -> str:
    value = fields.get(name) or ""
    if not isinstance(value, str):
        raise TypeError(name)
    return value


def _texts(fields: Mapping[str, Any], name: str) -> tuple[str, ...]:
    return tuple(str(text) for text in fields.get(name) or ())


def _parameters(fields: Mapping[str, Any], name: str) -> Mapping[str, object]:
    given = fields.get(name) or {}
    if not isinstance(given, dict):
        raise TypeError(name)
    return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


_READERS: dict[str, Callable[[Mapping[str, Any], str], object]] = {
    **dict.fromkeys(("pid", "thread", "at", "node", "rc", "parent", "session"), _int),
    **dict.fromkeys(("error", "arguments", "rules"), _texts),
    **dict.fromkeys(("forked", "secured"), lambda fields, name: fields.get(name) is True),
    "parameters": _parameters,
    "qos": lambda fields, name: tuple(int(number) for number in fields.get(name, ())),
}  # what is not here is a text


def _shown(text: bytes) -> str:
    return ascii(text[:60].decode(errors="replace"))


_LONGEST_NAME = 255  # of a ROS name; a longer value is none
_INTEGER, _STRING, _STRING_LIST = 2, 4, 9  # rcl_interfaces/msg/ParameterType


def declared_values(event: bytes) -> Mapping[str, object]:
    """Return by name the declared parameters that hold a text, an integer or a list of texts."""
    found: dict[str, object] = {}
    if event[:2] not in (b"\0\0", b"\0\1"):
        return found
    cursor = _Cursor(event[4:], "<" if event[1] else ">")
    try:
        cursor.number("I"), cursor.number("I"), cursor.text()  # time and node
        for _ in range(cursor.number("I")):
            name, value = cursor.text(), cursor.value()
            if value is not None:
                found[name] = value
    except (struct.error, UnicodeDecodeError):
        pass
    return found


class _Cursor:
    """Reads classic CDR (DDSI-RTPS, 10.2): each number stands at a multiple of its size; texts have their length."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order, self._place = data, order, 0

    def number(self, form: str) -> int:
        size = struct.calcsize(form)
        self._place += -self._place % size
        (value,) = struct.unpack_from(self._order + form, self._data, self._place)
        self._place += size
        return int(value)

    def text(self) -> str:
        length = self.number("I")
        if self._place + length > len(self._data):
            raise struct.error("cut")
        text = self._data[self._place : self._place + length]
        self._place += length
        return text.rstrip(b"\0").decode()

    def value(self) -> object:
        """Read a rcl_interfaces/msg/ParameterValue: all its fields are there, whichever counts."""
        kind, _, integer, _ = self.number("B"), self.number("B"), self.number("q"), self.number("Q")
        text = self.text()
        for form in "BBQQ":
            self._skip_list(form)
        texts = tuple(self.text() for _ in range(self.number("I")))
        if kind == _STRING and len(text) <= _LONGEST_NAME:
            return text
        return {_INTEGER: integer, _STRING_LIST: texts}.get(kind)

    def _skip_list(self, form: str) -> None:
        for _ in range(self.number("I")):
            self.number(form)
