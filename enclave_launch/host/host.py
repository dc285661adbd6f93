"""The interface of evaluation to the world: actions and substitutions ask ``context.host``, which records or acts.

A dry run and a live run read the ament index, run commands and warn alike; what they do with processes differs.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import socket
import subprocess
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

from enclave_common.files import read_text
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics.evaluation import (
    command_without_its_file,
    executable_not_built,
    package_not_installed,
    program_not_installed,
    ros_distro_unknown,
)
from enclave_launch.host.environment import environment_snapshot
from enclave_launch.ros_rules.distro import Distro, Versions, WatchedRelease, choose_release
from enclave_launch.ros_rules.parameter_file import MAX_BYTES
from nodl import ament_index
from nodl.ament_index import MISSING_PREFIX

if TYPE_CHECKING:
    import logging

    from enclave_launch.process import LauncherCall, ResolvedComponent, ResolvedProcess, Unforeseeable

# Types of ``description``, which is the floor above and knows this one.
LaunchContext = Any
ExecuteLocal = Any
LifecycleNode = Any
LifecycleComponent = Any

T = TypeVar("T")


class HostOptions(NamedTuple):
    """Properties of the world that an evaluation knows, in a dry run and live.

    ``distro``: whose rules to follow, as in ``--distro``, ``None`` for that of the environment.
    ``versions``: those of the packages of that distribution, in the place of installed ones.
    ``anonymous_seed``: two hosts with the same
    seed give the same names at random, in the same order.
    """

    distro: str | None = None
    allow_missing_packages: bool = False
    no_python: bool = False
    anonymous_seed: int | None = None
    versions: Versions = ()


_PACKAGE_MISSING = re.compile(r"package '([A-Za-z0-9_]+)' not found")  # as ament_index_python says it


class CommandResult(NamedTuple):
    """The result of a command: its exit status and what it wrote."""

    returncode: int
    stdout: str
    stderr: str


class Completion(Protocol):
    """A future of a process's end. ``asyncio.Future`` is one."""

    def done(self) -> bool: ...
    def add_done_callback(self, callback: Callable[[Any], object], /) -> None: ...


class UserCodeResults(Protocol):
    """Results of the user's code, recorded in a dry run and given again by the start that follows it."""

    def call(
        self,
        key: Hashable,
        function: Callable[[], T],
        context: LaunchContext | None = None,
    ) -> T:
        """Call ``function``, or return what it gave when it was called with ``key`` before."""

    def keep(self, *objects: object) -> tuple[int, ...]:
        """Return the ids of the objects, as part of a key."""

    def remember_state(self, entity: object) -> None:
        """Record the state of an object that is about to be visited."""

    def listen(self, logger: logging.Logger) -> None:
        """Record what user code logs."""

    def stop_listening(self) -> None:
        """End the recording of logs."""


class DescriptionSource(Protocol):
    """The source of a launch description."""

    def location_without_context(self) -> str | None: ...
    def try_get_launch_description_without_context(self) -> Any: ...


class Host(ABC):
    """The world as evaluation reaches it.

    ``loop`` is behind ``context.asyncio_loop``: asyncio's when live, a virtual clock in a dry run.
    """

    loop: Any

    def __init__(self, options: HostOptions, user_code_results: UserCodeResults | None = None) -> None:
        named = os.environ.get("ROS_DISTRO")
        self.release = WatchedRelease.of(
            choose_release(options.distro, named, ament_index.search_prefixes(), options.versions)
        )
        self.allow_missing_packages = options.allow_missing_packages
        self.no_python = options.no_python
        self.user_code_results = user_code_results
        self.warnings: list[Diagnostic] = []
        known = [distro.value for distro in Distro]
        if named and not options.distro and named not in known:
            self.warnings.append(ros_distro_unknown(named, known, self.release.distro.value))
        self._warned: set[Diagnostic] = set()
        self._process_count = 0
        self._anonymous_seed = options.anonymous_seed
        self._anonymous_random: Any = None
        self.loads = LoadCache()
        self.parameter_file_sources: dict[str, str] = {}  # written file -> the one it was made from
        self._prefix_cache: dict[tuple[str, str], str] = {}
        self._executable_cache: dict[tuple[str, str, str], str] = {}

    def prefixes(self) -> tuple[str, ...]:
        """Return ament prefixes to search, first wins, from the present environment."""
        return ament_index.search_prefixes()

    def find_package_prefix(self, package: str) -> str:
        """Return the prefix; raises ``PackageNotFoundError`` (a ``KeyError``), ``ValueError`` for an invalid name."""
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
        placeholder = f"{MISSING_PREFIX}/{package}"
        self.warn(package_not_installed(package, placeholder))
        return placeholder

    def find_executable(self, package: str, executable: str) -> str:
        """Return the file in the package's libexec directory; raises ExecutableNotInstalledError."""
        prefix = self.find_package_prefix(package)
        key = (prefix, package, executable)
        known = self._executable_cache.get(key)
        if known is None:
            known = self._executable_cache[key] = self._find_executable(prefix, package, executable)
        return known

    def _find_executable(self, prefix: str, package: str, executable: str) -> str:
        if self.is_missing(prefix):
            return os.path.join(prefix, "lib", package, executable)
        try:
            return ament_index.executable_path(package, executable, [prefix])
        except ament_index.ExecutableNotInstalledError:
            if not self.allow_missing_packages:
                raise
        placeholder = os.path.join(MISSING_PREFIX, package, "lib", package, os.path.basename(executable))
        self.warn(executable_not_built(package, executable, placeholder))
        return placeholder

    def is_missing(self, path: str) -> bool:
        """Return True if ``path`` is inside the placeholder of a package that is not installed."""
        return self.allow_missing_packages and path.startswith(f"{MISSING_PREFIX}/")

    def find_program(self, name: str) -> str | None:
        """Return its path on the ``PATH``; None if it is not there."""
        found = shutil.which(name)
        if found is None and self.allow_missing_packages:
            return f"{MISSING_PREFIX}/bin/{name}"
        return found

    def run_command(
        self, command: Sequence[str], *, merge_stderr: bool = False, at_event: bool = False
    ) -> CommandResult:
        """Run it, once for plan and start together unless ``at_event``.

        With ``--allow-missing-packages`` a marked placeholder stands for its output if the program, or a package with a
        file that it is given, is not installed.
        """
        if not self.allow_missing_packages or not command:
            return self._run_command(command, merge_stderr, at_event)
        program = os.path.basename(command[0])
        if shutil.which(command[0]) is None:
            self.warn(program_not_installed(program))
            return CommandResult(0, f"<output of {program}, which is not installed>", "")
        result = self._run_command(command, merge_stderr, at_event)
        absent = [word for word in command if f"{MISSING_PREFIX}/" in word]
        if result.returncode != 0 and absent:
            self.warn(command_without_its_file(program, absent[0]))
            return CommandResult(0, f"<output of {program}, whose {absent[0]} is not installed>", "")
        missing = _PACKAGE_MISSING.search(result.stderr or result.stdout) if result.returncode else None
        if missing and missing[1] not in ament_index.installed_packages(self.prefixes()):
            self.warn(command_without_its_file(program, f"package {missing[1]}"))
            return CommandResult(0, f"<output of {program}, whose package {missing[1]} is not installed>", "")
        return result

    def _run_command(self, command: Sequence[str], merge_stderr: bool, at_event: bool) -> CommandResult:
        if self.user_code_results is None or at_event:
            return self._run_now(command, merge_stderr)
        key = ("command", tuple(command), merge_stderr)
        return self.user_code_results.call(key, lambda: self._run_now(command, merge_stderr))

    def _run_now(self, command: Sequence[str], merge_stderr: bool) -> CommandResult:
        result = subprocess.run(
            list(command),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT if merge_stderr else subprocess.PIPE,
            text=True,
            check=False,
        )
        return CommandResult(result.returncode, result.stdout, result.stderr or "")

    def next_process_index(self) -> int:
        """Return N of the process name NAME-N, from 1."""
        self._process_count += 1
        return self._process_count

    @abstractmethod
    def note_namespace(self, later: object, context: LaunchContext) -> None:
        """Note the namespace in which a handler or a timer is written; only a plan uses it."""

    def warn(self, warning: Diagnostic) -> None:
        """Warn the person; of the same once."""
        if warning not in self._warned:
            self._warned.add(warning)
            self.warnings.append(warning)

    def anonymous_name(self, name: str) -> str:
        """Return a unique name made from ``name``."""
        # Two hosts with the same seed give the same names in the same order: a live run has those of its plan.
        if self.user_code_results is None:
            return self._new_anonymous_name(name)
        return self.user_code_results.call(("anonymous name", name), lambda: self._new_anonymous_name(name))

    def _new_anonymous_name(self, name: str) -> str:
        if self._anonymous_random is None:
            self._anonymous_random = random.Random(self._anonymous_seed)
        number = self._anonymous_random.randint(0, sys.maxsize)
        full = f"{name}_{socket.gethostname()}_{os.getpid()}_{number}"
        return full.translate(str.maketrans("-.:", "___"))

    def log_directory(self) -> str | None:
        """Return the folder of this run's log files; None in a dry run, which makes none."""
        return None

    @abstractmethod
    def write_parameter_file(self, text: str) -> str:
        """Keep ``text`` for a process about to start; give the path to pass (``<params:N>`` in a dry run)."""

    @abstractmethod
    def parameter_file(self, path: str) -> str | None:
        """Return the text of a file written by ``write_parameter_file``; None for any other path."""

    def has_parameter_file(self, path: str) -> bool:
        """Return True if ``path`` is a file that ``write_parameter_file`` wrote, or one on disk."""
        return self.parameter_file(path) is not None or os.path.isfile(path)

    def read_parameter_file(self, path: str) -> str:
        """Return the text of such a file; raises ``OSError``, ``UnicodeDecodeError`` if it cannot be read."""
        written = self.parameter_file(path)
        return read_text(path, MAX_BYTES) if written is None else written

    @abstractmethod
    def started_so_far(self) -> int:
        """Return a number that grows with everything that is started or scheduled."""

    @abstractmethod
    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        """Start ``process``; the result is done when it has ended for good. Does not wait."""

    @abstractmethod
    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        """Load them one after another, once their container's service is there. Does not wait."""

    @abstractmethod
    def launcher_call(self, call: LauncherCall) -> None:
        """Record a ROS service that launch itself must call."""

    @abstractmethod
    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Ask a started lifecycle node for a transition. Does not wait."""

    @abstractmethod
    def watch_states(self, component: LifecycleComponent, context: LaunchContext) -> None:
        """Emit an event for each change of state of a component that launch takes through its states."""

    @abstractmethod
    def unforeseeable(self, item: Unforeseeable) -> None:
        """Record something only known at run time."""


Key = tuple[type, str]


class LoadCache:
    """Valid while the environment stays the same: paths and Python files may depend on it."""

    def __init__(self) -> None:
        self._seen: dict[str, str] | None = None
        self._summaries: dict[Key, Any] = {}
        self._unvisited: dict[Key, Any] = {}
        self._in_progress: set[Key] = set()

    def summary(self, source: DescriptionSource, summarize: Callable[[Any], T]) -> T | None:
        """Return what ``source`` declares; None if it cannot be loaded without a context, or is being summed up.

        A file may include itself under a condition that ends. It declares nothing new then. A Python file that does
        so by a path without a context ends upstream's scan, which asks no condition: ``RecursionError``.
        """
        self._drop_outdated()
        location = source.location_without_context()
        if location is None:
            description = source.try_get_launch_description_without_context()
            return None if description is None else summarize(description)
        key = (type(source), location)
        if key in self._in_progress:
            if location.endswith(".py"):
                raise RecursionError(
                    f"{location} includes itself: launch looks into all includes for arguments, whatever their "
                    "conditions, and ends in a RecursionError; name the file by $(dirname) or a substitution "
                    "that needs the launch"
                )
            return None
        if key not in self._summaries:
            self._summaries[key] = self._summarize(key, source, summarize)
        known: T | None = self._summaries[key]
        return known

    def _summarize(
        self,
        key: Key,
        source: DescriptionSource,
        summarize: Callable[[Any], T],
    ) -> T | None:
        self._in_progress.add(key)
        try:
            description = source.try_get_launch_description_without_context()
            if description is None:
                return None
            summary = summarize(description)
        finally:
            self._in_progress.discard(key)
        if not key[1].endswith(".py"):
            description.argument_summary = summary
            self._unvisited[key] = description
        return summary

    def take(self, source: DescriptionSource, location: str) -> Any:
        """Return a description of the file at ``location`` that was built and not visited yet; None without one."""
        self._drop_outdated()
        return self._unvisited.pop((type(source), location), None)

    def _drop_outdated(self) -> None:
        now = environment_snapshot()
        if now is not self._seen:
            self._seen = now
            self._summaries.clear()
            self._unvisited.clear()
