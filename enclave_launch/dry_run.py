"""The dry run's JSON as pydantic models: the versioned contract with other programs, and the one form in which reports,
checks, exports and drift read a plan, saved or just made.

``secure-launch --dry-run --format json`` prints a document that ``DryRun`` validates; ``report.plan_json``
writes it without importing this module (pydantic costs more start-up time than the whole dry run), and the
tests hold both together. Read a document with
``DryRun.model_validate_json(text)`` (``DryRun.parse_raw(text)`` before pydantic 2).

Within one ``version`` fields are only ever added; a removed or changed field raises the number.
"""

from __future__ import annotations

from typing import Any, Literal, Optional, TypeVar, Union

from pydantic import BaseModel, Field, StrictBool, StrictFloat, StrictInt, StrictStr

from enclave_common.source_location import SourceLocation

Entry = TypeVar("Entry", bound="_Strict")

# Only what pydantic 1.8 and 2 have in common: no ``|``, strict types in unions, ``...`` for what is required.
JsonScalar = Union[StrictBool, StrictInt, StrictFloat, StrictStr]
JsonParameter = Union[JsonScalar, list[JsonScalar]]


def _described(description: str) -> Any:
    return Field(..., description=description)


_ORIGIN = "where they come from: --nodl, manifest of the package, recorded, inferred, library, policy"


class _Strict(BaseModel, extra="forbid", frozen=True):
    """The base of all entries: an unknown key is an error."""

    def changed(self: Entry, **fields: object) -> Entry:
        """Return a copy with other values in ``fields``."""
        return type(self)(**{**dict(self), **fields})


class _Written(_Strict, frozen=True):
    """The base of what an element of a launch file says."""

    launch_file: str
    line: int = _described("line of the element, 0 when not known")

    @property
    def place(self) -> str:
        """Return ``file:line``, or the file alone if the line is not known."""
        return str(SourceLocation(self.launch_file, self.line))


class Respawn(_Strict, frozen=True):
    """The restart of a process that ended."""

    delay: float = _described("seconds")
    retries: int = _described("how often at most, -1 without a limit")


class Reaction(_Written, frozen=True):
    """An event handler or timer of the launch, whatever it starts."""

    what: str
    ends_with: Optional[str] = _described(
        "the process at whose end it ends the launch, if that is all it does"
    )


class LauncherCall(_Written, frozen=True):
    """A service that the launcher's own node calls: to load a component, to change a state."""

    service: str


class Process(_Written, frozen=True):
    """One process, in launch order."""

    package: Optional[str] = _described("null for executable actions and nodes given without a package")
    executable: str = _described("executable name; the first word of an executable action")
    namespace: Optional[str] = _described("as launch shows it; null for executable actions")
    name: Optional[str] = _described("node name, the manifest's if launch gives none; null for executables")
    fqn: Optional[str] = Field(...)
    cmd: list[str] = _described("what would be executed; holds --enclave only under --secure")
    remaps: list[tuple[str, str]] = _described("from, to; global rules before the node's own")
    parameters: dict[str, JsonParameter] = _described("as the node will see them")
    enclave: Optional[str] = Field(...)
    interfaces: Optional[str] = _described(_ORIGIN)
    prefix: list[str] = _described("the first words of cmd, which start the program: launch-prefix")
    domain_id: int = _described("of its own environment")
    middleware: str = _described("the RMW implementation it would load")
    environment: dict[str, str] = _described("variables added or changed, values as the process sees them")
    on_event: Optional[str] = _described("the event that would start it; null when the launch itself does")
    process: str = _described("the process name, NAME-N")
    kind: Literal["node", "lifecycle_node", "container", "executable"]
    machine: Optional[str] = _described("the host that the launch file means it for")
    cwd: Optional[str] = Field(...)
    shell: bool = _described("cmd is one text for a shell")
    respawn: Optional[Respawn] = _described("null: not started again when it ends")
    parameter_files: dict[str, str] = _described("YAML that launch would write, by its placeholder in cmd")


class Component(_Written, frozen=True):
    """One composable node, in launch order."""

    container: str
    package: str
    plugin: str
    fqn: str
    remaps: list[tuple[str, str]]
    parameters: dict[str, JsonParameter]
    enclave: Optional[str] = _described("the container's; null when the container is not part of this launch")
    interfaces: Optional[str] = _described(_ORIGIN)
    on_event: Optional[str] = Field(...)


class Enclave(_Strict, frozen=True):
    """The permissions of one enclave: final names, sorted."""

    nodes: list[str]
    permissions_unknown: list[str] = _described(
        "processes and components of it of which nothing is known; then the lists are not all"
    )
    publish: list[str]
    subscribe: list[str]
    call_services: list[str]
    serve_services: list[str]
    call_actions: list[str]
    serve_actions: list[str]


# Of its own: that of the policy is there for type checkers only.
Operation = Literal[
    "publish", "subscribe", "call_services", "serve_services", "call_actions", "serve_actions"
]


class Interface(_Strict, frozen=True):
    """One permission of a node, with its reason."""

    operation: Operation
    name: str = _described("final; wildcards if a description or an option has them")
    type: str = _described("empty when not known")
    built_in: bool = _described("every node has it; no description lists it")
    place: str = _described("file:line of the description, or the row of the table")
    written: str = _described("the name as found there")
    remapped_by: list[str]
    note: str
    qos: dict[str, Union[StrictInt, StrictStr]] = _described(
        "policies that the description fixes, by the names of NoDL v2"
    )


class Node(_Strict, frozen=True):
    """One node under its final name."""

    fqn: str
    enclave: str
    program: str = _described("package/executable or package/plugin")
    parameters: Optional[list[str]] = _described("all that it declares; null if that is not known")
    interfaces: list[Interface]


class Diagnostic(_Strict, frozen=True):
    """One thing a person should know, of planning or a check; ``code`` is stable (``enclave_launch.diagnostics.Code``,
    ``review.checks.rules``)."""

    severity: Literal["error", "warning"] = _described("error: --secure refuses to start")
    code: str
    subject: str
    file: Optional[str] = Field(...)
    line: int
    text: str
    remedy: str = _described("what to do next, empty when nothing needs doing")

    @property
    def place(self) -> str:
        """Return ``file:line``, the file alone where the whole of it is meant, or nothing."""
        return str(SourceLocation(self.file or "", self.line if self.file else 0))


class Hanging(_Strict, frozen=True):
    """A difference between versions that this launch file depends on."""

    what: str
    package: str
    since: str = _described("the version of the package that brought it")


class Release(_Strict, frozen=True):
    """The rules that were followed."""

    distro: str
    versions: dict[str, str] = _described("the version of each package whose changes matter")
    assumed: list[str] = _described(
        "the packages that are not installed: their newest known version is taken"
    )
    hanging: list[Hanging] = Field(
        [], description="what in this launch file hangs on the versions that are assumed"
    )


class DryRun(_Strict, frozen=True):
    """The whole document."""

    version: Literal[1]
    release: Optional[Release] = Field(
        None, description="absent in documents of older versions of this program"
    )
    refused: Optional[bool] = Field(
        None,
        description="a secured start would be refused; the dry run itself ends with 0, with --strict with 1",
    )
    processes: list[Process]
    components: list[Component]
    enclaves: dict[str, Enclave]
    nodes: list[Node]
    reactions: list[Reaction]
    launcher_calls: list[LauncherCall]
    warnings: list[str] = _described("every diagnostic as one message for a person, errors first")
    diagnostics: list[Diagnostic]

    @property
    def launched(self) -> tuple[Union[Process, Component], ...]:
        """Return processes and components."""
        return (*self.processes, *self.components)
