"""The Zenoh router of a launch: ``rmw_zenohd``, started before the first process and ended after the last.

One router serves a keystore. Where one answers already, it is used if it is the keystore's and knows the present
rules: each change of them comes with a new certificate, so who connects sees it. A router of ours is started
again when its file changes, and when it ends by itself; clients come back to it by themselves.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from enclave_launch.errors import RuntimeFailure
from enclave_launch.runtime.warden import PR_SET_PDEATHSIG, load_libc

PROGRAM = "lib/rmw_zenoh_cpp/rmw_zenohd"
CONFIGURATION = "ZENOH_ROUTER_CONFIG_URI"
_PATIENCE = 30.0  # seconds until it answers
_INTERVAL = 0.1  # between two probes
_ANSWER = 5.0  # until a probe gives up
_PAUSE = 1.0  # before one that ended is started again
_LAST_LINES = 20
_PLAIN = {"ZENOH_CONFIG_OVERRIDE": "", "NO_COLOR": "1"}


class RouterPlace(NamedTuple):
    """The files of a router and where it listens. ``address``: host and port; the others are absolute paths.
    ``differences``: why the configuration must not be used; called before each start."""

    address: tuple[str, int]
    configuration: str
    certificate: str
    authorities: str
    differences: Callable[[], Sequence[str]]


class RouterAnswer(Enum):
    """The one who answers at the router's address."""

    NOBODY = "nobody"
    STRANGER = "a program that is not this keystore's router"
    EARLIER = "this keystore's router with earlier rules"
    PRESENT = "this keystore's router"


def find_router(prefixes: Sequence[str]) -> str | None:
    """Return the path of ``rmw_zenohd`` in the first of these ament prefixes that has it."""
    candidates = (os.path.join(prefix, PROGRAM) for prefix in prefixes)
    return next((path for path in candidates if os.access(path, os.X_OK)), None)


def who_answers(place: RouterPlace) -> RouterAnswer:
    """Connect with TLS, and judge who is there by the certificate that is presented."""
    context = ssl.create_default_context(cafile=place.authorities)
    host, port = place.address
    try:
        with (
            socket.create_connection((host, port), _ANSWER) as plain,
            context.wrap_socket(plain, server_hostname=host) as secured,
        ):
            presented = secured.getpeercert(binary_form=True)
    except ConnectionRefusedError:
        return RouterAnswer.NOBODY
    except (TimeoutError, ssl.SSLError, ConnectionError):
        return RouterAnswer.STRANGER
    except OSError:
        return RouterAnswer.NOBODY
    expected = ssl.PEM_cert_to_DER_cert(Path(place.certificate).read_text())
    return RouterAnswer.PRESENT if presented == expected else RouterAnswer.EARLIER


class ZenohRouter:
    """A context: within it a router with the present rules answers. ``program``: None where none is installed.
    ``heard``: gets each line that a router of ours prints, and says whether that was all that it is good for.

    :raises RuntimeFailure: on entering, when none answers and none can be started, or another program is there.
    """

    def __init__(
        self,
        place: RouterPlace,
        program: str | None,
        environment: Mapping[str, str],
        say: Callable[[str], None],
        heard: Callable[[str], bool] = lambda line: False,
    ) -> None:
        self._place = place
        self._program = program
        self._environment = {**environment, CONFIGURATION: place.configuration, **_PLAIN}
        self._say, self._heard = say, heard
        self._looks = 0
        self._printed: deque[str] = deque(maxlen=_LAST_LINES)
        self._stop = threading.Event()
        self._answered = threading.Event()
        self._failed = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> ZenohRouter:
        if self._probe() is RouterAnswer.NOBODY:
            self._start()
        self.wait()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def wait(self) -> None:
        """Wait until a router with the present rules answers. :raises RuntimeFailure: none does in time."""
        end = time.monotonic() + _PATIENCE
        answer = self._probe()
        while answer is not RouterAnswer.PRESENT:
            stranger = answer is RouterAnswer.STRANGER and not self._thread
            if stranger or self._failed.is_set() or time.monotonic() > end:
                self._stop.set()
                raise RuntimeFailure(self._failure(answer))
            time.sleep(_INTERVAL)
            answer = self._probe()
        self._answered.set()

    def _probe(self) -> RouterAnswer:
        self._looks += 1  # before the router can say a word of it
        answer = who_answers(self._place)
        self._looks -= answer is RouterAnswer.NOBODY
        return answer

    def _failure(self, answer: RouterAnswer) -> str:
        host, port = self._place.address
        where = f"tls/{host}:{port}"
        if self._thread is not None:
            said = "".join(f"\n  {line}" for line in self._printed) or " nothing"
            return f"the Zenoh router {self._program} does not answer at {where}; it said:{said}"
        if answer is RouterAnswer.EARLIER:
            return (
                f"the Zenoh router at {where} runs with earlier rules than those of the keystore: restart it there "
                f"(with {CONFIGURATION}={self._place.configuration})"
            )
        return (
            f"at {where}, where the Zenoh router should be, {answer.value} answers: stop it, or give the router "
            "another place with secure-keystore zenoh KEYSTORE --router HOST:PORT"
        )

    def _start(self) -> None:
        if self._program is None:
            raise RuntimeFailure(missing_router(self._place.address, self._place.configuration))
        if wrong := self._place.differences():
            raise RuntimeFailure(f"no Zenoh router is started: {'; '.join(wrong)}")
        self._thread = threading.Thread(target=self._supervise, name="zenoh router", daemon=True)
        self._thread.start()

    def _supervise(self) -> None:
        """Start and restart the router; all starts are in this thread, since the kernel ends the router with it."""
        while not self._stop.is_set():
            seen = _state(self._place.configuration)
            try:
                process = self._popen()
            except OSError as error:
                self._printed.append(f"{self._program}: {error.strerror}")
                self._failed.set()
                return
            reader = threading.Thread(target=self._read, args=(process,), daemon=True)
            reader.start()
            self._follow(process, seen)
            _end(process)
            reader.join(timeout=_PAUSE)
            if not self._answered.is_set():
                self._failed.set()
                return

    def _popen(self) -> subprocess.Popen[bytes]:
        assert self._program is not None, "looked for before"
        return subprocess.Popen(
            [self._program], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            env=self._environment, start_new_session=True, preexec_fn=_die_with_parent,
        )  # fmt: skip

    def _follow(self, process: subprocess.Popen[bytes], seen: object) -> None:
        refused = ""
        while not self._stop.wait(_INTERVAL):
            if process.poll() is not None and not self._answered.is_set():
                return
            if process.poll() is not None:
                self._say(f"the Zenoh router ended (exit status {process.returncode}); it is started again")
                self._stop.wait(_PAUSE)
                return
            if _state(self._place.configuration) != seen:
                wrong = "; ".join(self._place.differences())
                if not wrong:
                    return
                if wrong != refused:
                    refused = wrong
                    self._say(f"the rules of the Zenoh router remain unchanged: {wrong}")

    def _read(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None, "it is a pipe"
        with process.stdout:
            for line in process.stdout:
                text = line.decode(errors="replace").rstrip()
                if self._is_of_our_probe(text) or self._heard(text):
                    continue
                self._printed.append(text)
                print(f"[rmw_zenohd] {text}", file=sys.stderr)

    def _is_of_our_probe(self, text: str) -> bool:
        """Return True for the router's warning about a client without a certificate if ``who_answers`` was that
        client."""
        ours = self._looks > 0 and "peer sent no certificates" in text
        self._looks -= ours
        return ours


def missing_router(address: tuple[str, int], configuration: str) -> str:
    """Return the error if no router answers and none can be started: what to install or to start."""
    host, port = address
    return (
        f"processes of this launch are on Zenoh (rmw_zenoh_cpp), no router answers at tls/{host}:{port}, and none can "
        f"be started: no {PROGRAM} below AMENT_PREFIX_PATH. Install the package rmw_zenoh_cpp (apt: "
        f"ros-$ROS_DISTRO-rmw-zenoh-cpp) and source its setup file, or start a router elsewhere with "
        f"{CONFIGURATION}={configuration} (secure-keystore apply-policy writes it, from the policy that --dry-run "
        f"--format policy prints)"
    )


def _state(path: str) -> object:
    try:
        info = os.stat(path)
    except OSError:
        return None
    return info.st_ino, info.st_mtime_ns, info.st_size


def _end(process: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(signal.SIGINT)
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


_libc = load_libc()


def _die_with_parent() -> None:
    """Ask the kernel, in the child, to kill it when the launcher exits."""
    if _libc is not None:
        _libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
