"""The dependence of a described node on its start: parameters, arguments, plugins, the distribution.

A NoDL v2 document lists plain names. Our section of its ``codegen`` may say beside them which of them follow a
parameter, exist only under a condition, or repeat for each entry of a list; which plugins and further nodes the program
brings; which configuration files name the rest. ``document.v2_section`` reads it into these values, ``apply`` turns
a description and a ``Situation`` into the interface that this one start has. docs/library.md shows the written form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from nodl.endpoint_kind import EndpointKind

CONTROLLER = "controller"
"""The name in sources of a controller of ros2_control, until it is loaded."""

HOST = "host"
"""The name in sources of the node that loads a plugin and hands itself to it."""

COMPONENT = "component"
"""The name in sources of the node that ros2_control gives a hardware component."""


class Test(NamedTuple):
    """One demand on a parameter (or an option ``--name``); ``parameter`` is a template.

    ``values``: it has one of them, or with ``contains`` it is a list with one of them. ``is_set``: it has some value
    that is not empty. ``negated`` turns the answer round.
    """

    parameter: str
    values: tuple[str, ...] = ()
    contains: bool = False
    is_set: bool = False
    negated: bool = False


class When(NamedTuple):
    """A condition: ``any_of`` groups of tests, each of which must hold as a whole; none at all: always.

    ``since`` and ``until``: first and last distribution.
    """

    any_of: tuple[tuple[Test, ...], ...] = ()
    since: str = ""
    until: str = ""


ALWAYS = When()


class Variation(NamedTuple):
    """The variation of one listed endpoint.

    ``name``: a template (empty: as listed). ``each``: a list parameter, or a pattern of parameter names with one ``*``;
    the endpoint repeats for each entry, which the name calls ``$(item)``."""

    name: str = ""
    each: str = ""
    when: When = When()


class FurtherNode(NamedTuple):
    """A node that the program makes beside its main one, with options of its own.

    ``document``: ``package/name`` of its description. ``namespace`` is relative to the main node's unless absolute;
    empty: the program sets none, the process's counts. ``renamed``: so does a node name that launch gives the process.
    """

    document: str
    node: str
    namespace: str = ""
    when: When = When()
    renamed: bool = False


class PluginList(NamedTuple):
    """Plugins that the node loads. ``parameter`` holds the names of the instances (a list, a text, or a pattern with
    ``*``); the parameter ``type`` (a template with ``$(plugin)``) holds the class of each. ``types``: default classes.
    ``plugin_class``: a template for the class itself, where no parameter holds it. ``always``: instances that are
    loaded whatever the parameter says, except those that the parameter ``without`` names. ``spawned``: spawners of the
    launch name instances too.
    """

    parameter: str
    default: tuple[str, ...] = ()
    type: str = "$(plugin).plugin"
    types: Mapping[str, str] = MappingProxyType({})
    when: When = When()
    spawned: bool = False
    plugin_class: str = ""
    always: tuple[str, ...] = ()
    without: str = ""


class Transport(NamedTuple):
    """A base topic of image_transport: each installed transport adds names below it.

    ``side`` is ``publishers`` or ``subscriptions``. With ``parameter`` it is the one transport that this names; a
    subscription uses one only.
    ``each`` as of a ``Variation``: one base topic for each entry.
    """

    side: str
    base: str
    parameter: str = ""
    when: When = When()
    each: str = ""


class Configuration(NamedTuple):
    """A file (or command line) of a tool's own format that names what it needs; ``kind`` chooses the reader.
    ``document`` describes the nodes that it names, if it does."""

    kind: str
    file: str = ""
    document: str = ""
    when: When = When()


class StatedGap(NamedTuple):
    """A gap that the document names."""

    why: str
    each: str = ""
    when: When = When()


class Dependence(NamedTuple):
    """All of it for one document. ``defaults``: of the parameters. ``options``: command-line options that take a value,
    by their name here. ``node_name``: a template for the node's own name; ``random_name``: the program appends ``_``
    and something of its own making, unless launch names the node. ``own_node``: a plugin that is a node, named
    as its instance. ``tf_listener``: when it makes a ``TransformListener`` without a node, which then makes its own.
    """

    variations: Mapping[tuple[EndpointKind, str], Variation] = MappingProxyType({})
    nodes: tuple[FurtherNode, ...] = ()
    plugins: tuple[PluginList, ...] = ()
    transports: tuple[Transport, ...] = ()
    configurations: tuple[Configuration, ...] = ()
    gaps: tuple[StatedGap, ...] = ()
    defaults: Mapping[str, object] = MappingProxyType({})
    options: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    node_name: str = ""
    random_name: bool = False
    own_node: bool = False
    tf_listener: When | None = None


class Spawned(NamedTuple):
    """A controller that a spawner of the launch loads. ``manager``: full name of the controller manager; ``type``: its
    class, empty where the spawner gives none; ``rules``: remap rules of the controller's own."""

    controller: str
    manager: str
    type: str = ""
    parameters: Mapping[str, object] = MappingProxyType({})
    rules: tuple[str, ...] = ()


class Launched(NamedTuple):
    """Other parts of the launch on which this node depends.

    ``robot_description``: the URDF that a node has as its parameter. ``masks``: of costmap filters, the final topic of
    the filter info and the mask's topic in that message.
    """

    robot_description: str = ""
    spawned: tuple[Spawned, ...] = ()
    masks: tuple[tuple[str, str], ...] = ()


class Situation(NamedTuple):
    """One start of a node. ``node`` and ``namespace`` are final; ``words``: of its command line, without ROS arguments.

    ``installed``: the packages of the ament index, ``None`` when nothing can be said about them. ``remap``: the final
    name of a topic, for programs that ask for it and make other names from it. ``files``: path -> text of the files in
    its command line that launch writes.
    """

    distro: str
    node: str
    namespace: str
    parameters: Mapping[str, object] = MappingProxyType({})
    words: tuple[str, ...] = ()
    installed: frozenset[str] | None = None
    launched: Launched = Launched()
    remap: Callable[[str], str] = str
    files: Mapping[str, str] = MappingProxyType({})
