"""The only seam between evaluation and the world.

Actions and substitutions never look a package up, run a command, write a file or start a process themselves:
they ask ``context.host``. ``PlanHost`` records and writes nothing (the dry run); the runtime's host does it
for real, driven by the very same evaluation.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from enclave_launch.evaluation.distro import Release, choose_release
from enclave_launch.evaluation.virtual_loop import VirtualLoop
from nodl import ament_index

if TYPE_CHECKING:
    from enclave_launch.description.launch.actions.execute_local import ExecuteLocal
    from enclave_launch.description.launch.launch_context import LaunchContext
    from enclave_launch.description.launch_ros.actions.lifecycle_node import LifecycleNode
    from enclave_launch.evaluation.loading import LoadCache
    from enclave_launch.process import (
        LauncherCall,
        ResolvedComponent,
        ResolvedProcess,
        Unforeseeable,
    )

MISSING_PREFIX = "/missing"
"""``--allow-missing-packages``: package ``p`` is taken to be installed in ``/missing/p``, a program in
``/missing/bin``."""


class CommandResult(NamedTuple):
    returncode: int
    stdout: str
    stderr: str


class Completion(Protocol):
    """What tells that a process has ended. ``asyncio.Future`` is one."""

    def done(self) -> bool: ...
    def add_done_callback(self, callback: Callable[[Any], object], /) -> None: ...


class Host(Protocol):
    """What evaluation may ask of the world."""

    release: Release
    no_python: bool

    @property
    def loop(self) -> Any:
        """The event loop behind ``context.asyncio_loop``: asyncio's when live, a virtual clock in a dry run."""

    @property
    def loads(self) -> LoadCache:
        """Launch files parsed so far."""

    def prefixes(self) -> tuple[str, ...]:
        """Ament prefixes to search, first wins, from the environment of this moment."""

    def find_package_prefix(self, package: str) -> str:
        """Raises ``PackageNotFoundError`` (a ``KeyError``), ``ValueError`` for an impossible name."""

    def find_executable(self, package: str, executable: str) -> str:
        """The file in the package's libexec directory. Raises as ``find_package_prefix``, and
        ``ament_index.ExecutableNotFoundError``."""

    def is_missing(self, path: str) -> bool:
        """Is ``path`` inside the placeholder of a package that is not installed?"""

    def find_program(self, name: str) -> str | None:
        """Its path on the ``PATH``; ``None`` when it is not there."""

    def run_command(self, command: Sequence[str], *, merge_stderr: bool = False) -> CommandResult:
        """Run it without a shell, in our directory and environment. Raises ``FileNotFoundError``."""

    def write_parameter_file(self, text: str) -> str:
        """Keep ``text`` for a process about to start; give the path to pass (``<params:N>`` in a dry run)."""

    def parameter_file(self, path: str) -> str | None:
        """The text of a file written by ``write_parameter_file``, ``None`` for any other path."""

    def next_process_index(self) -> int:
        """N of the process name NAME-N, from 1."""

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        """Start ``process``; the result is done when it has ended for good. Does not wait."""

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        """Load them one after another, once their container's service is there. Does not wait."""

    def launcher_call(self, call: LauncherCall) -> None:
        """Note a ROS service that launch itself must call."""

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Ask a started lifecycle node for a transition. Does not wait."""

    def unforeseeable(self, item: Unforeseeable) -> None:
        """Note something only known at run time."""

    def warn(self, text: str) -> None:
        """Tell the person. The same text once."""

    def anonymous_name(self, name: str) -> str:
        """A name nobody else has, made from ``name``."""

    def log_directory(self) -> str:
        """Where this run's log files go. Creates nothing."""


class BaseHost:
    """What a dry run and a live run have in common: reading the ament index, running commands, warnings."""

    def __init__(
        self,
        *,
        distro: str | None = None,
        allow_missing_packages: bool = False,
        no_python: bool = False,
        anonymous_seed: int | None = None,
    ) -> None:
        self.release = choose_release(distro, os.environ.get("ROS_DISTRO"), ament_index.search_prefixes())
        self.allow_missing_packages = allow_missing_packages
        self.no_python = no_python
        self.warnings: list[str] = []
        self._warned: set[str] = set()
        self._process_count = 0
        self._anonymous_seed = anonymous_seed
        self._anonymous_random: Any = None
        self._loads: LoadCache | None = None
        self._prefix_cache: dict[tuple[str, str], str] = {}
        self._executable_cache: dict[tuple[str, str, str], str] = {}

    @property
    def loads(self) -> LoadCache:
        if self._loads is None:
            from enclave_launch.evaluation.loading import LoadCache

            self._loads = LoadCache()
        return self._loads

    def prefixes(self) -> tuple[str, ...]:
        return ament_index.search_prefixes()

    def find_package_prefix(self, package: str) -> str:
        key = (package, os.environ.get("AMENT_PREFIX_PATH", ""))
        known = self._prefix_cache.get(key)
        if known is None:
            known = self._prefix_cache[key] = self._find_package_prefix(package)
        return known

    def _find_package_prefix(self, package: str) -> str:
        try:
            return ament_index.package_prefix(package, self.prefixes())
        except ament_index.PackageNotFoundError:
            if not self.allow_missing_packages:
                raise
        self.warn(f"package '{package}' is not installed; using {MISSING_PREFIX}/{package} in its place")
        return f"{MISSING_PREFIX}/{package}"

    def find_executable(self, package: str, executable: str) -> str:
        prefix = self.find_package_prefix(package)
        key = (prefix, package, executable)
        known = self._executable_cache.get(key)
        if known is None:
            known = self._executable_cache[key] = self._find_executable(prefix, package, executable)
        return known

    def _find_executable(self, prefix: str, package: str, executable: str) -> str:
        if self.is_missing(prefix):
            return os.path.join(prefix, "lib", package, executable)
        return ament_index.executable_path(package, executable, [prefix])

    def is_missing(self, path: str) -> bool:
        return self.allow_missing_packages and path.startswith(f"{MISSING_PREFIX}/")

    def find_program(self, name: str) -> str | None:
        import shutil

        found = shutil.which(name)
        if found is None and self.allow_missing_packages:
            return f"{MISSING_PREFIX}/bin/{name}"
        return found

    def run_command(self, command: Sequence[str], *, merge_stderr: bool = False) -> CommandResult:
        """With ``--allow-missing-packages`` a program that is not there "writes" a marked placeholder."""
        if self.allow_missing_packages and command:
            import shutil

            if shutil.which(command[0]) is None:
                program = os.path.basename(command[0])
                self.warn(
                    f"program '{program}' is not installed; a placeholder stands for what it would write"
                )
                return CommandResult(0, f"<output of {program}, which is not installed>", "")
        return self._run_command(command, merge_stderr)

    def _run_command(self, command: Sequence[str], merge_stderr: bool) -> CommandResult:
        import subprocess

        result = subprocess.run(
            list(command),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT if merge_stderr else subprocess.PIPE,
            text=True,
            check=False,
        )
        return CommandResult(result.returncode, result.stdout, result.stderr or "")

    def next_process_index(self) -> int:
        self._process_count += 1
        return self._process_count

    def warn(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            self.warnings.append(text)

    def anonymous_name(self, name: str) -> str:
        """``name_host_pid_random``. Two hosts with the same seed give the same names in the same order, so
        that a live run has the names of the plan it follows."""
        import random
        import socket

        if self._anonymous_random is None:
            self._anonymous_random = random.Random(self._anonymous_seed)
        number = self._anonymous_random.randint(0, sys.maxsize)
        full = f"{name}_{socket.gethostname()}_{os.getpid()}_{number}"
        return full.translate(str.maketrans("-.:", "___"))

    def log_directory(self) -> str:
        from enclave_launch.description.launch.logging import launch_config

        return launch_config.log_dir


class PlanHost(BaseHost):
    """The dry run's world: everything is recorded, nothing is started or written."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.processes: list[ResolvedProcess] = []
        self.started: list[ExecuteLocal] = []  # action of each process, same order
        self.components: list[ResolvedComponent] = []
        self.calls: list[LauncherCall] = []
        self.unforeseen: list[Unforeseeable] = []
        self.parameter_files: dict[str, str] = {}
        self._loop = VirtualLoop()

    @property
    def loop(self) -> VirtualLoop:
        return self._loop

    def write_parameter_file(self, text: str) -> str:
        path = f"<params:{len(self.parameter_files) + 1}>"
        self.parameter_files[path] = text
        return path

    def parameter_file(self, path: str) -> str | None:
        return self.parameter_files.get(path)

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        self.processes.append(process)
        self.started.append(action)
        return self._loop.create_future()

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        self.components.extend(components)

    def launcher_call(self, call: LauncherCall) -> None:
        self.calls.append(call)

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Nothing is started in a dry run, so nothing changes its state."""

    def unforeseeable(self, item: Unforeseeable) -> None:
        self.unforeseen.append(item)


_current: ContextVar[Host | None] = ContextVar("enclave_launch_host", default=None)


def current_host() -> Host:
    """The host of the evaluation in progress; where none is, a fresh dry-run host (library use of the classes)."""
    host = _current.get()
    if host is None:
        host = PlanHost()
        _current.set(host)
    return host


def current_release() -> Release:
    """The release that parsing and construction follow; execution asks ``context.host.release``."""
    return current_host().release


@contextmanager
def active_host(host: Host) -> Iterator[Host]:
    """Make ``host`` the current one within the block; nests."""
    token = _current.set(host)
    try:
        yield host
    finally:
        _current.reset(token)
