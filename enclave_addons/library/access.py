"""The library of manifests as one launch sees it: which document holds here, and what it says of one start.

Takes what launch starts and descriptions that depend on the start; gives interfaces that no longer do. Reads the ament
index, documents of the library and the configuration files that launch names.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from enclave_addons.library import SHIPPED, Library, LibraryDocuments
from enclave_addons.library.apply import applied, own_name
from enclave_common.shell_words import split_words
from enclave_launch.errors import UsageError
from enclave_launch.interfaces.describers import DescribePlugin
from enclave_launch.interfaces.situation import StartedPlugin, StartedProgram, situation_of
from enclave_launch.options import ResolveOptions
from enclave_launch.plan import Found, InterfaceOrigin
from enclave_launch.policy.program_inputs import own_words
from enclave_launch.policy.running_node import parameters_of_node
from enclave_launch.process import Evaluation, ResolvedComponent, ResolvedProcess
from enclave_launch.ros_rules.rcl_parameters import resolve_parameters
from nodl.ament_index import list_resources, package_version
from nodl.dependence import Launched, Situation, Spawned
from nodl.names import InvalidNameError
from nodl.node_interface import Certainty, NodeInterface
from nodl.ros_arguments import ParameterFileArgument, parse_ros_arguments, split_options

_FURTHER = 32


def _filled(interface: NodeInterface, parameters: Mapping[str, object]) -> NodeInterface:
    """Return ``interface`` with its names under these parameters."""
    endpoints = (
        endpoint._replace(name=name, certainty=Certainty.EXACT if name.is_literal else Certainty.PATTERN)
        for endpoint in interface.endpoints
        for name in endpoint.name.fill_each(parameters)
    )
    return interface._replace(endpoints=tuple(dict.fromkeys(endpoints)))


class LibraryAccess:
    """Opens nothing until a node has no manifest, or one that depends on its start."""

    def __init__(
        self,
        prefixes: Sequence[str],
        options: ResolveOptions,
        distro: str,
        launch: Evaluation | None = None,
        of_source: DescribePlugin = lambda plugin_class, instance, start: (),
    ):
        """Open nothing yet; ``launch`` is all that starts, for nodes that must know others. ``of_source`` describes
        plugins that no document describes, with the nodes that they make.

        Raises ``UsageError`` for a folder of documents that is not there.
        """
        self._prefixes = prefixes
        self._distro = distro
        self._enabled = options.library
        self._launch = launch
        self._of_source = of_source
        self._folders = options.library_folders
        for folder in self._folders:
            if not folder.is_dir():
                raise UsageError(f"--library {folder}: no such directory")

    @cached_property
    def _library(self) -> Library:
        return Library(self._folders, SHIPPED if self._enabled else None)

    @cached_property
    def _installed(self) -> frozenset[str]:
        return frozenset(list_resources("packages", self._prefixes))

    @cached_property
    def _launched(self) -> Launched:
        assert self._launch is not None
        return launched(self._launch)

    def find(self, package: str | None, name: str) -> Found | None:
        """Return the document of a program. Raises ``InvalidNoDLError`` for a broken document."""
        if package is None or not (self._enabled or self._folders):
            return None
        version = package_version(package, self._prefixes)
        hit = self._library.find(package, name, distro=self._distro, version=version)
        return hit and Found((hit.document.interface,), InterfaceOrigin.LIBRARY, hit.doubt)

    def recorded(self, package: str | None, name: str) -> Found | None:
        """Return the documents that the user recorded and keeps in a folder of ``--library``, one for each node of the
        program.

        Raises as ``find``.
        """
        if not self._folders or package is None:
            return None
        version = package_version(package, self._prefixes)
        hits = self._library.recorded(package, name, distro=self._distro, version=version)
        if not hits:
            return None
        doubt = next((hit.doubt for hit in hits if hit.doubt), "")
        return Found(tuple(hit.document.interface for hit in hits), InterfaceOrigin.RECORDED, doubt)

    def complete(
        self,
        interfaces: Sequence[NodeInterface],
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
    ) -> tuple[NodeInterface, ...]:
        """Return the nodes of one start, those that they bring along included.

        Raises ``InvalidNoDLError`` and, for a remap rule at which the process would end, ``LaunchFileError``.
        """
        return tuple(node for each in interfaces for node in self._complete(each, started, container))

    def _complete(
        self,
        interface: NodeInterface,
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
        depth: int = 0,
    ) -> Iterator[NodeInterface]:
        named = self._named(interface, started)
        situation = self._situation(named, started, container)
        program = StartedProgram(started, container, self._distro)
        made: list[NodeInterface] = []

        def of_source(plugin_class: str, instance: str) -> NodeInterface | None:
            start = StartedPlugin(program, situation, instance)
            found = self._of_source(plugin_class, instance, start)
            filled = [_filled(each, start.parameters(each.name)) for each in found]
            made.extend(filled[1:])
            return filled[0] if filled else None

        done = applied(named, situation, LibraryDocuments(self._library, self._distro, of_source))
        yield done.interface
        yield from made
        for further in done.further if depth < _FURTHER else ():
            yield from self._complete(further, started, container, depth + 1)

    def _named(self, interface: NodeInterface, started: ResolvedProcess | ResolvedComponent) -> NodeInterface:
        """Return ``interface`` with the name that its program makes from the command line, before launch's rules
        apply.
        """
        if interface.depends is None or not (interface.depends.node_name or interface.depends.random_name):
            return interface

        words = tuple(own_words(started)) if isinstance(started, ResolvedProcess) else ()
        name = own_name(interface, Situation(self._distro, "", "", started.parameters, words))
        return interface._replace(name=name)

    def _situation(
        self,
        interface: NodeInterface,
        started: ResolvedProcess | ResolvedComponent,
        container: ResolvedProcess | None,
    ) -> Situation:
        installed = self._installed if (started.package or "") in self._installed else None
        situation = situation_of(started, container, interface, self._distro, installed)
        return situation if self._launch is None else situation._replace(launched=self._launched)


# Source: ros-controls/ros2_control jazzy, controller_manager/spawner.py: the type and the parameters of a controller
# come from its section in the files of --param-file and in the spawner's own parameter files, remap rules from
# --controller-ros-args.
_MANAGER = ("-c", "--controller-manager")
_FILES = ("-p", "--param-file")
_TYPE = ("-t", "--controller-type")
_ROS_ARGUMENTS = ("--controller-ros-args",)
_NAME = ("--controller",)
_TAKE_A_VALUE = frozenset(
    (
        *(*_MANAGER, *_FILES, *_TYPE, *_ROS_ARGUMENTS, *_NAME, "-n", "--namespace"),
        *("--controller-manager-timeout", "--switch-timeout", "--service-call-timeout"),
    )
)


def launched(evaluation: Evaluation) -> Launched:
    """Return what ``evaluation`` starts, as far as other nodes depend on it."""
    of_manager = (item for item in evaluation.processes if item.package == "controller_manager")
    spawners = (item for item in of_manager if item.executable in ("spawner", "spawner.py"))
    return Launched(
        robot_description=_robot_description(evaluation),
        spawned=tuple(spawned for process in spawners for spawned in _spawned(process)),
        masks=tuple(_masks(evaluation)),
    )


_FILTER_INFO = ("costmap_filter_info_server", "nav2_map_server::CostmapFilterInfoServer")


def _masks(evaluation: Evaluation) -> Iterator[tuple[str, str]]:
    """Yield the topic of each server of filter info, and the mask's topic that it publishes there.

    Source: nav2_map_server, costmap_filter_info_server.cpp.
    """
    started: list[ResolvedProcess | ResolvedComponent] = [*evaluation.processes, *evaluation.components]
    for item in started:
        program = item.executable if isinstance(item, ResolvedProcess) else item.plugin
        if item.package == "nav2_map_server" and program in _FILTER_INFO:
            situation = StartedProgram(item, None, evaluation.distro).situation(_FILTER_INFO[0])
            info = str(situation.parameters.get("filter_info_topic", "costmap_filter_info"))
            with contextlib.suppress(InvalidNameError):  # rcl refuses it: nothing is published
                yield situation.remap(info), str(situation.parameters.get("mask_topic", "filter_mask"))


def _robot_description(evaluation: Evaluation) -> str:
    """Return the URDF that some node has as its parameter: robot_state_publisher, mostly."""
    given = [item.parameters for item in evaluation.processes]
    given += [item.parameters for item in evaluation.components]
    texts = (parameters.get("robot_description") for parameters in given)
    return next((text for text in texts if isinstance(text, str) and text), "")


def _spawned(process: ResolvedProcess) -> Iterator[Spawned]:
    options, others = split_options(own_words(process), _TAKE_A_VALUE)
    names = [word for word in others if not word.startswith("-")]
    namespace = (process.namespace or "/").rstrip("/")
    if not namespace.startswith("/"):
        namespace = ""
    manager = ([*_values(options, _MANAGER), "controller_manager"])[0]
    files = [ParameterFileArgument(file) for file in _values(options, _FILES)]
    given = (word for text in _values(options, _ROS_ARGUMENTS) for word in split_words(text))
    rules = parse_ros_arguments(["--ros-args", *given]).remaps
    for name in (*names, *_values(options, _NAME)):
        tokens = [token for token in (*namespace.split("/"), name) if token]
        of_its_own = parameters_of_node(process, namespace or "/", name)
        parameters = {**of_its_own, **resolve_parameters(tokens, files).values}
        types = _values(options, _TYPE)
        yield Spawned(
            controller=name,
            manager=manager if manager.startswith("/") else f"{namespace}/{manager}",
            type=types[0] if types else str(parameters.get("type") or ""),
            parameters=parameters,
            rules=rules,
        )


def _values(options: Sequence[tuple[str, str]], spellings: Sequence[str]) -> list[str]:
    return [value for option, value in options if option in spellings]
