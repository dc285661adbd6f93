"""The interface of evaluation to the world: actions and substitutions ask ``context.host``, which records or acts."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    import logging

    from enclave_launch.diagnostics import Diagnostic
    from enclave_launch.process import LauncherCall, ResolvedComponent, ResolvedProcess, Unforeseeable
    from enclave_launch.ros_rules.distro import Release

# Types of ``description``, which is the floor above and knows this one.
LaunchContext = Any
ExecuteLocal = Any
LifecycleNode = Any

T = TypeVar("T")


class HostOptions(NamedTuple):
    """Properties of the world that an evaluation knows, in a dry run and live.

    ``distro``: whose rules to follow, ``None`` for that of the environment. ``anonymous_seed``: two hosts with the same
    seed give the same names at random, in the same order.
    """

    distro: str | None = None
    allow_missing_packages: bool = False
    no_python: bool = False
    anonymous_seed: int | None = None


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
        *,
        at_event: bool = False,
        worth: Callable[[T], bool] = ...,
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


class LoadedDescriptions(Protocol):
    """Launch descriptions loaded so far, and what they declare."""

    def summary(self, source: DescriptionSource, summarize: Callable[[Any], T]) -> T | None:
        """Return what ``source`` declares."""

    def take(self, source: DescriptionSource, location: str) -> Any:
        """Return a description that was loaded and not visited yet; None without one."""


class Host(Protocol):
    """The world as evaluation reaches it."""

    release: Release
    no_python: bool
    allow_missing_packages: bool
    user_code_results: UserCodeResults | None

    @property
    def loop(self) -> Any:
        """Return the event loop behind ``context.asyncio_loop``: asyncio's when live, a virtual clock in a dry run."""

    @property
    def loads(self) -> LoadedDescriptions:
        """Return the launch files parsed so far."""

    def prefixes(self) -> tuple[str, ...]:
        """Return ament prefixes to search, first wins, from the present environment."""

    def find_package_prefix(self, package: str) -> str:
        """Return the prefix; raises ``PackageNotFoundError`` (a ``KeyError``), ``ValueError`` for an invalid name."""

    def find_executable(self, package: str, executable: str) -> str:
        """Return the file in the package's libexec directory; raises ExecutableNotInstalledError."""

    def is_missing(self, path: str) -> bool:
        """Return True if ``path`` is inside the placeholder of a package that is not installed."""

    def find_program(self, name: str) -> str | None:
        """Return its path on the ``PATH``; None if it is not there."""

    def run_command(
        self, command: Sequence[str], *, merge_stderr: bool = False, at_event: bool = False
    ) -> CommandResult:
        """Run it without a shell, in our directory and environment. Raises ``FileNotFoundError``."""

    def write_parameter_file(self, text: str) -> str:
        """Keep ``text`` for a process about to start; give the path to pass (``<params:N>`` in a dry run)."""

    def parameter_file(self, path: str) -> str | None:
        """Return the text of a file written by ``write_parameter_file``; None for any other path."""

    def started_so_far(self) -> int:
        """Return a number that grows with everything that is started or scheduled."""

    def next_process_index(self) -> int:
        """Return N of the process name NAME-N, from 1."""

    def start_process(
        self, action: ExecuteLocal, process: ResolvedProcess, context: LaunchContext
    ) -> Completion | None:
        """Start ``process``; the result is done when it has ended for good. Does not wait."""

    def load_components(self, components: Sequence[ResolvedComponent], context: LaunchContext) -> None:
        """Load them one after another, once their container's service is there. Does not wait."""

    def launcher_call(self, call: LauncherCall) -> None:
        """Record a ROS service that launch itself must call."""

    def change_state(self, node: LifecycleNode, transition_id: int, context: LaunchContext) -> None:
        """Ask a started lifecycle node for a transition. Does not wait."""

    def unforeseeable(self, item: Unforeseeable) -> None:
        """Record something only known at run time."""

    def warn(self, warning: Diagnostic) -> None:
        """Tell the person; the same once."""

    def anonymous_name(self, name: str) -> str:
        """Return a unique name made from ``name``."""

    def log_directory(self) -> str | None:
        """Return the folder of this run's log files; None in a dry run, which makes none."""
