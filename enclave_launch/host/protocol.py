"""What evaluation may ask of the world.

Actions and substitutions do not look a package up, run a command, write a file or start a process themselves:
they ask ``context.host``. ``PlanHost`` records and writes nothing (the dry run); the runtime's host does it
for real, driven by the very same evaluation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from enclave_launch.boundary.light import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from enclave_launch.description.actions.lifecycle import LifecycleNode
    from enclave_launch.description.actions.processes import ExecuteLocal
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.diagnostics import Diagnostic
    from enclave_launch.host.base_host import LoadCache
    from enclave_launch.host.outcomes import Outcomes
    from enclave_launch.process import LauncherCall, ResolvedComponent, ResolvedProcess, Unforeseeable
    from enclave_launch.ros_rules.distro import Release

MISSING_PREFIX = "/missing"
"""``--allow-missing-packages``: package ``p`` is taken to be installed in ``/missing/p``, a program in
``/missing/bin``."""


class HostOptions(NamedTuple):
    """What an evaluation is told of the world, in a dry run and live alike.

    ``distro``: whose rules to follow, ``None`` for that of the environment. ``anonymous_seed``: two hosts with the same
    seed give the same names at random, in the same order.
    """

    distro: str | None = None
    allow_missing_packages: bool = False
    no_python: bool = False
    anonymous_seed: int | None = None


class CommandResult(NamedTuple):
    """What a command gave: its exit status and what it wrote."""

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
    allow_missing_packages: bool
    outcomes: Outcomes | None

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
        ``ament_index.ExecutableNotInstalledError``."""

    def is_missing(self, path: str) -> bool:
        """Is ``path`` inside the placeholder of a package that is not installed?"""

    def find_program(self, name: str) -> str | None:
        """Its path on the ``PATH``; ``None`` when it is not there."""

    def run_command(
        self, command: Sequence[str], *, merge_stderr: bool = False, at_event: bool = False
    ) -> CommandResult:
        """Run it without a shell, in our directory and environment. ``at_event``: the answer may be another when that
        happens. Raises ``FileNotFoundError``."""

    def write_parameter_file(self, text: str) -> str:
        """Keep ``text`` for a process about to start; give the path to pass (``<params:N>`` in a dry run)."""

    def parameter_file(self, path: str) -> str | None:
        """The text of a file written by ``write_parameter_file``, ``None`` for any other path."""

    def started_so_far(self) -> int:
        """A number that grows with everything that is started or scheduled."""

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

    def warn(self, warning: Diagnostic) -> None:
        """Tell the person; the same once."""

    def anonymous_name(self, name: str) -> str:
        """A name nobody else has, made from ``name``."""

    def log_directory(self) -> str:
        """Where this run's log files go. Creates nothing."""
