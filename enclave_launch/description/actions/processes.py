"""``executable``: actions that start a process, and event handlers for process start, output and exit."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from enclave_common import shell_words
from enclave_launch.description import read_only
from enclave_launch.description.actions.executable import Executable
from enclave_launch.description.actions.process_attributes import attributes_of
from enclave_launch.description.entity import Action, LaunchDescriptionEntity, SomeEntitiesType
from enclave_launch.description.events.event import (
    Event,
    ProcessExited,
    ProcessIO,
    ProcessStarted,
    process_event_arguments,
)
from enclave_launch.description.events.handlers import OnActionEventBase
from enclave_launch.description.location import location_of
from enclave_launch.description.markup.entity import Entity
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.substitutions.variables import LaunchConfiguration
from enclave_launch.description.typed_values import normalize_typed_substitution, perform_typed_substitution
from enclave_launch.host.current import current_release
from enclave_launch.host.environment import changed
from enclave_launch.process import EnclaveRequest, ResolvedProcess, Respawn
from enclave_launch.ros_rules.namespaces import enclave_scope
from enclave_launch.ros_rules.output import Routes, output_routes
from nodl.ros_arguments import RosArguments, parse_ros_arguments, words_after_program

if TYPE_CHECKING:
    from enclave_launch.description.events.handlers import ActionMatcher, OnEvent
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.markup.entity import Parser

    OnExit = SomeEntitiesType | Callable[[ProcessExited, LaunchContext], SomeEntitiesType | None]
    OnText = Callable[[ProcessIO], SomeEntitiesType | None] | None


_SIGTERM_TIMEOUT = LaunchConfiguration("sigterm_timeout", default=5)
_SIGKILL_TIMEOUT = LaunchConfiguration("sigkill_timeout", default=5)


@read_only(
    "shell", "emulate_tty", "cached_output", "log_cmd", "respawn_delay", "respawn_max_retries",
    "process_description", "sigterm_timeout", "sigkill_timeout", "output", "output_format", "respawn",
    "process_details",
)  # fmt: skip
class ExecuteLocal(Action):
    """Starts ``process_description`` when executed; may be executed once.

    ``enclave`` (ours) names the DDS-Security enclave of the process: absolute, or below the scope in force.
    ``machine`` (ours) names the host that the process is meant for; launch starts it on this one all the same.
    """

    shell: bool = False
    emulate_tty: bool = False
    cached_output: bool = False
    log_cmd: bool = False
    respawn_delay: float | None = None
    respawn_max_retries: int = -1
    process_description: Executable
    sigterm_timeout: list[Substitution]
    sigkill_timeout: list[Substitution]
    output: list[Substitution] | Mapping[str, Any]
    output_format: str
    respawn: Any  # a bool once prepared, before that what was given
    process_details: dict[str, Any] | None  # of the process events: set when prepared, ``pid`` once started

    def __init__(
        self,
        *,
        process_description: Executable,
        shell: bool = False,
        sigterm_timeout: SomeSubstitutionsType = _SIGTERM_TIMEOUT,
        sigkill_timeout: SomeSubstitutionsType = _SIGKILL_TIMEOUT,
        emulate_tty: bool = False,
        output: SomeSubstitutionsType | Mapping[str, Any] = "log",
        output_format: str = "[{this.process_description.final_name}] {line}",
        cached_output: bool = False,
        log_cmd: bool = False,
        on_exit: OnExit | None = None,
        respawn: bool | SomeSubstitutionsType = False,
        respawn_delay: float | None = None,
        respawn_max_retries: int = -1,
        enclave: SomeSubstitutionsType | None = None,
        machine: SomeSubstitutionsType | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.__process_description = process_description
        self.__shell = shell
        self.__sigterm_timeout = normalize_to_list_of_substitutions(sigterm_timeout)
        self.__sigkill_timeout = normalize_to_list_of_substitutions(sigkill_timeout)
        self.__emulate_tty = emulate_tty
        self.__output = _output(os.environ.get("OVERRIDE_LAUNCH_PROCESS_OUTPUT", output))
        self.__output_format = output_format
        self.__cached_output = cached_output
        self.__log_cmd = log_cmd
        self.__on_exit = on_exit
        self.__respawn = _respawn(respawn)
        self.__respawn_delay = respawn_delay
        self.__respawn_max_retries = respawn_max_retries
        self.__enclave = None if enclave is None else normalize_to_list_of_substitutions(enclave)
        self.__machine = None if machine is None else normalize_to_list_of_substitutions(machine)
        self.__executed = False
        self.final_routes: Routes = {}
        self.__process_details: dict[str, Any] | None = None
        self.__completed: Any = None
        self.captured_output: tuple[list[str], list[str]] = ([], [])
        self.final_return_code: int | None = None

    @property
    def return_code(self) -> int | None:
        return self.final_return_code

    def get_stdout(self) -> str:
        """Return what the process wrote so far. Raises ``RuntimeError`` without ``cached_output``."""
        return self.__captured(0, "stdout")

    def get_stderr(self) -> str:
        """Return the captured standard error, as ``get_stdout``."""
        return self.__captured(1, "stderr")

    def __captured(self, stream: int, name: str) -> str:
        if not self.__cached_output:
            raise RuntimeError(
                f"cached output must be true to be able to get {name}, proc '{self.__process_description.name}'"
            )
        return "".join(self.captured_output[stream])

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.__on_exit if isinstance(self.__on_exit, list) else []

    def get_asyncio_future(self) -> Any:
        return self.__completed

    def prepare(self, context: LaunchContext) -> None:
        """Perform everything that the process needs."""
        self.__process_description.prepare(context, self)
        description = self.__process_description
        self.__process_details = {
            "action": self,
            "name": description.final_name,
            "cmd": description.final_cmd,
            "cwd": description.final_cwd,
            "env": description.final_env,
        }
        if not isinstance(self.__respawn, bool):
            self.__respawn = bool(perform_typed_substitution(context, self.__respawn, bool))

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Prepare, then start unless the launch is shutting down."""
        self.prepare(context)
        if self.__executed:
            raise RuntimeError(
                f"ExecuteLocal action '{self.__process_description.final_name}': "
                f"executed more than once: {self.describe()}"
            )
        self.__executed = True
        if context.is_shutdown:
            return None
        self.final_routes = self.__routes(context)
        if self.__on_exit is not None:
            self.__register_on_exit(context, self.__on_exit)
        self.__completed = context.host.start_process(self, self.resolve(context), context)
        return None

    def __routes(self, context: LaunchContext) -> Routes:
        output: Any = self.__output
        return output_routes(output if isinstance(output, dict) else perform_substitutions(context, output))

    def __register_on_exit(self, context: LaunchContext, on_exit: OnExit) -> None:
        context.register_event_handler(OnProcessExit(target_action=self, on_exit=on_exit))

    def resolve(self, context: LaunchContext) -> ResolvedProcess:
        """Return the prepared process as a value. Subclasses replace what they know better of their node."""
        description = self.__process_description
        name, cmd = description.final_name or "", tuple(description.final_cmd or ())
        return ResolvedProcess(
            number=int(name.rpartition("-")[2]),
            kind="executable",
            package=None,
            executable=first_word(cmd),
            process_name=name,
            name=None,
            namespace=None,
            fqn=None,
            cmd=cmd,
            remaps=(),
            parameters={},
            environment=self.__changed_environment(context),
            enclave=self.enclave_request(context)._replace(argument=self.ros_arguments().enclave),
            location=location_of(self, context),
            on_event=context.on_event,
            cwd=description.final_cwd,
            shell=self.__shell is True,  # other true values do not make one, as upstream
            prefix=description.final_prefix,
            final_environment=description.final_env or {},
            machine=None if self.__machine is None else perform_substitutions(context, self.__machine),
            respawn=Respawn(self.__respawn_delay or 0.0, self.__respawn_max_retries)
            if self.__respawn
            else None,
            parameter_files={
                word: text for word in cmd if (text := context.host.parameter_file(word)) is not None
            },
        )

    def ros_arguments(self) -> RosArguments:
        """Parse the ROS arguments of the prepared command line, as rcl does."""
        description = self.__process_description
        words = words_after_program(
            description.final_cmd or (), len(description.final_prefix), shell=self.__shell is True
        )
        return parse_ros_arguments(words)

    def enclave_request(self, context: LaunchContext) -> EnclaveRequest:
        """Return what the launch file says about the enclave, without the user's own ROS arguments."""
        attribute = None if self.__enclave is None else perform_substitutions(context, self.__enclave)
        return EnclaveRequest(attribute, enclave_scope(context.launch_configurations))

    def __changed_environment(self, context: LaunchContext) -> Mapping[str, str]:
        final = self.__process_description.final_env
        environment = context.process_environment
        if final is environment.snapshot():
            return environment.changes()
        return changed(environment.start, final or {})


def first_word(cmd: tuple[str, ...]) -> str:
    """Return the program of a command, which is all one string when run by a shell."""
    words = cmd[0].split() if cmd else []
    return words[0] if words else ""


def _output(output: Any) -> list[Substitution] | Mapping[str, Any]:
    return output if isinstance(output, dict) else normalize_to_list_of_substitutions(output)


def _respawn(respawn: bool | SomeSubstitutionsType) -> Any:
    if isinstance(respawn, bool):
        return respawn

    return normalize_typed_substitution(respawn, bool)


def _final_or_given(name: str) -> Any:

    def get(process: ExecuteLocal) -> Any:
        description = process.process_description
        final = getattr(description, f"final_{name}")
        return getattr(description, name) if final is None else final

    return property(get)


@expose_action("executable")
class ExecuteProcess(ExecuteLocal):
    """Starts a command; each item of ``cmd`` is one argument (plain text would be one argument per character)."""

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        prefix: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        cwd: SomeSubstitutionsType | None = None,
        env: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        additional_env: Mapping[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ) -> None:
        executable = Executable(
            cmd=cmd, prefix=prefix, name=name, cwd=cwd, env=env, additional_env=additional_env
        )
        super().__init__(process_description=executable, **kwargs)

    @classmethod
    def _parse_cmdline(cls, cmd: str, parser: Parser) -> list[SomeSubstitutionsType]:
        return split_words(parser.parse_substitution(cmd))

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[Action], dict[str, Any]]:
        """Read the element; ``ignore``: what a subclass reads itself, or does not have."""
        _, kwargs = super().parse(entity, parser)
        skipped = ignore or ()
        if "cmd" not in skipped:
            kwargs["cmd"] = cls._parse_cmdline(entity.get_attr("cmd"), parser)
        given = entity.given
        for attribute, keyword, read in attributes_of(current_release()):
            if attribute in given and keyword not in skipped:
                value = read(entity, parser, attribute)
                if value is not None:
                    kwargs[keyword] = value
        return cls, kwargs

    name = _final_or_given("name")  # NAME-N once prepared
    cmd = _final_or_given("cmd")
    cwd = _final_or_given("cwd")
    env = _final_or_given("env")

    @property
    def additional_env(self) -> Any:
        return self.process_description.additional_env


def split_words(template: Iterable[Substitution]) -> list[SomeSubstitutionsType]:
    """Split a parsed command line into arguments.

    Each text fragment is split as a shell would, on its own, so quotes cannot span a substitution. A
    substitution's value is never split and glues to the text it touches. Blank text alone is one empty argument.
    """
    words: list[SomeSubstitutionsType] = []
    word: list[Substitution] = []
    for part in template:
        if not isinstance(part, TextSubstitution):
            word.append(part)
            continue
        tokens = shell_words.split_words(part.text)
        if not tokens or (part.text[0].isspace() and word):
            words.append(word)
            word = []
        for position, token in enumerate(tokens):
            if position:
                words.append(word)
                word = []
            word.append(TextSubstitution(text=token))
        if tokens and part.text[-1].isspace():
            words.append(word)
            word = []
    if word:
        words.append(word)
    return words


class OnProcessStart(OnActionEventBase):
    """Handler of a process's start. The target must be an ``ExecuteProcess``, or a node."""

    def __init__(self, *, target_action: ActionMatcher = None, on_start: OnEvent, **kwargs: Any) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_start,
            target_event_cls=ProcessStarted,
            target_action_cls=ExecuteProcess,
            **kwargs,
        )


class OnProcessExit(OnActionEventBase):
    """Handler of a process's exit, also before each respawn."""

    def __init__(self, *, target_action: ActionMatcher = None, on_exit: OnEvent, **kwargs: Any) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_exit,
            target_event_cls=ProcessExited,
            target_action_cls=ExecuteLocal,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        action = self.first_accepted(started)
        return None if action is None else ProcessExited(returncode=0, **process_event_arguments(action))


class OnProcessIO(OnActionEventBase):
    """Handler of a process's output and input: one callback ``(event)`` for each stream."""

    def __init__(
        self,
        *,
        target_action: ActionMatcher = None,
        on_stdin: OnText = None,
        on_stdout: OnText = None,
        on_stderr: OnText = None,
        **kwargs: Any,
    ) -> None:
        def handle(event: ProcessIO, _: LaunchContext) -> SomeEntitiesType | None:
            if event.from_stdout and on_stdout is not None:
                return on_stdout(event)
            if event.from_stderr and on_stderr is not None:
                return on_stderr(event)
            if event.from_stdin and on_stdin is not None:
                return on_stdin(event)
            return None

        # Whose code this runs: a dry run does not call the user's.
        handle.__module__ = getattr(on_stdout or on_stderr or on_stdin, "__module__", __name__)
        super().__init__(
            action_matcher=target_action,
            on_event=handle,
            target_event_cls=ProcessIO,
            target_action_cls=ExecuteLocal,
            **kwargs,
        )

    def foresee(self, started: Sequence[Any]) -> Event | None:
        action = self.first_accepted(started)
        return None if action is None else ProcessIO(text=b"", fd=1, **process_event_arguments(action))
