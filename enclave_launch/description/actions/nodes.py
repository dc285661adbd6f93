"""``node``: a process with the ROS arguments that name its node, set its parameters and remap its names; and the
extensions of ``Node`` by other packages: entry points ``launch_ros.node_action``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from enclave_launch.description import read_only
from enclave_launch.description.absent_modules import OpaqueValue
from enclave_launch.description.actions.processes import ExecuteProcess
from enclave_launch.description.argument_types import ensure_argument_type
from enclave_launch.description.markup.entity import Entity, Parser, get_data_type_from_identifier
from enclave_launch.description.markup.expose import expose_action
from enclave_launch.description.node_names import (
    PlacedRule,
    SomeRemapRules,
    normalize_remap_rules,
    performed_remaps,
    placed,
    validate_namespace,
    validate_node_name,
    warn_about_repeats,
)
from enclave_launch.description.parameters.descriptions import ParameterFile, ParameterValue
from enclave_launch.description.parameters.normalize import normalize_parameters
from enclave_launch.description.parameters.of_node import NodeParameters
from enclave_launch.description.substitution import (
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
    normalize_to_list_of_substitutions,
    perform_substitutions,
)
from enclave_launch.description.substitutions.paths import ExecutableInPackage
from enclave_launch.process import UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE, ProcessKind
from enclave_launch.ros_rules.namespaces import NAMESPACE, make_namespace_absolute, prefix_namespace

if TYPE_CHECKING:
    from enclave_launch.description.entity import LaunchDescriptionEntity
    from enclave_launch.description.launch_context import LaunchContext
    from enclave_launch.description.parameters.types import SomeParameters
    from enclave_launch.process import RemapRule, ResolvedProcess


import os
import sys
import warnings
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from enclave_launch.description.entity import Action
    from enclave_launch.description.launch_context import LaunchContext


class RosSpecificArgument(Substitution):
    """A word of the command line that is only known while its node executes."""

    def __init__(self, key: str):
        super().__init__()
        self.__key = key

    def describe(self) -> str:
        return f"Local('ros_specific_arguments[{self.__key!r}]')"

    def perform(self, context: LaunchContext) -> str:
        return str(context.locals.ros_specific_arguments[self.__key])


@expose_action("node")
@read_only("node_package", "expanded_remapping_rules", "node_executable", "expanded_node_namespace")
class Node(ExecuteProcess):
    """Starts ``executable`` of ``package`` (without package: the program as given).

    Command line: user's ``arguments``; ``--ros-args`` and user's ``ros_arguments``; then ``--ros-args``
    with name, namespace, global parameters, own parameters, global remap rules, own remap rules.
    rcl takes the first matching rule, so the user's own come first and win.
    """

    UNSPECIFIED_NODE_NAME = UNSPECIFIED_NODE_NAME
    UNSPECIFIED_NODE_NAMESPACE = UNSPECIFIED_NODE_NAMESPACE
    process_kind: ProcessKind = "node"
    node_package: SomeSubstitutionsType | None = None
    expanded_remapping_rules: list[PlacedRule] | None = None
    node_executable: SomeSubstitutionsType
    expanded_node_namespace: str

    def __init__(
        self,
        *,
        executable: SomeSubstitutionsType,
        package: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        namespace: SomeSubstitutionsType | None = None,
        exec_name: SomeSubstitutionsType | None = None,
        parameters: SomeParameters | None = None,
        remappings: SomeRemapRules | None = None,
        ros_arguments: list[SomeSubstitutionsType] | None = None,
        arguments: Iterable[SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ):
        program = executable if package is None else ExecutableInPackage(executable, package)
        user_words: list[SomeSubstitutionsType] = [] if arguments is None else list(arguments)
        if ros_arguments is not None:
            user_words += ["--ros-args"] + ros_arguments  # noqa: RUF005  # a TypeError unless it is a list
        name_words: list[SomeSubstitutionsType] = [] if name is None else ["-r", RosSpecificArgument("name")]
        if parameters is not None and not isinstance(parameters, OpaqueValue):
            ensure_argument_type(parameters, list, "parameters", "Node")
        super().__init__(
            cmd=[program, *user_words, "--ros-args", *name_words], **{**kwargs, "name": exec_name}
        )
        self.__node_package = package
        self.__node_executable = executable
        self.__name = None if name is None else normalize_to_list_of_substitutions(name)
        self.__namespace = None if namespace is None else normalize_to_list_of_substitutions(namespace)
        self.__parameters = NodeParameters(normalize_parameters([] if parameters is None else parameters))
        self.__remappings = list(normalize_remap_rules(() if remappings is None else remappings))
        self.__expanded_name = UNSPECIFIED_NODE_NAME
        self.__expanded_node_namespace = UNSPECIFIED_NODE_NAMESPACE
        self.__final_name: str | None = None
        self.__first_remap = 0  # the index of its "-r" in self.cmd

    @staticmethod
    def parse_nested_parameters(params: list[Entity], parser: Parser) -> list[Any]:
        """Parse the ``param`` children of an element, in the shape of ``parameters=``."""
        return [_parse_parameter(param, parser) for param in params]

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[Node], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser, ignore=["cmd", "name", *(ignore or ())])
        given = entity.given
        for attribute, keyword in _COMMAND_LINES:
            if attribute in given and (text := entity.get_attr(attribute, optional=True)) is not None:
                kwargs[keyword] = cls._parse_cmdline(text, parser)
        for attribute, keyword in _TEXT_ATTRIBUTES:
            if attribute in given and (text := entity.get_attr(attribute, optional=True)) is not None:
                kwargs[keyword] = parser.parse_substitution(text)
        kwargs["executable"] = parser.parse_substitution(entity.get_attr("exec"))
        if "remap" in given:
            remaps = entity.get_attr("remap", data_type=list[Entity], optional=True)
            if remaps is not None:
                kwargs["remappings"] = parse_remaps(remaps, parser)
        if "param" in given:
            params = entity.get_attr("param", data_type=list[Entity], optional=True)
            if params is not None:
                kwargs["parameters"] = cls.parse_nested_parameters(params, parser)
        return cls, kwargs

    @property
    def node_name(self) -> str:
        """Return the fully qualified name; raises ``RuntimeError`` before the action was executed."""
        if self.__final_name is None:
            raise RuntimeError("cannot access 'node_name' before executing action")
        return self.__final_name

    def is_node_name_fully_specified(self) -> bool:
        return not any(
            placeholder in self.node_name
            for placeholder in (UNSPECIFIED_NODE_NAME, UNSPECIFIED_NODE_NAMESPACE)
        )

    def _perform_substitutions(self, context: LaunchContext) -> None:
        """Settle name, parameters and remap rules, once; subclasses may need the name before ``execute``."""
        if self.__final_name is not None:
            return
        self.__settle_names(context)
        section = self.node_name if self.is_node_name_fully_specified() else "/**"
        self.__extend_command(self.__parameters.write(context, section))
        self.__settle_remaps(context)

    def __settle_names(self, context: LaunchContext) -> None:
        if self.__name is not None:
            self.__expanded_name = perform_substitutions(context, self.__name)
            validate_node_name(self.__expanded_name)
        own = None if self.__namespace is None else perform_substitutions(context, self.__namespace)
        pushed = context.launch_configurations.get(NAMESPACE)
        namespace = make_namespace_absolute(prefix_namespace(pushed, own))
        if namespace is not None:
            self.__expanded_node_namespace = namespace
            self.cmd.extend([[TextSubstitution(text="-r")], [RosSpecificArgument("ns")]])
            validate_namespace(namespace)
        self.__final_name = prefix_namespace(self.__expanded_node_namespace, self.__expanded_name)

    def __settle_remaps(self, context: LaunchContext) -> None:
        everywhere = context.launch_configurations.get("ros_remaps") or []
        rules = [*everywhere, *performed_remaps(self.__remappings, context)]
        if rules:
            self.__expanded_remapping_rules = rules
            self.__first_remap = len(self.cmd)
            self.__extend_command(word for rule in rules for word in ("-r", f"{rule[0]}:={rule[1]}"))

    def __extend_command(self, words: Iterable[str]) -> None:
        self.cmd.extend([[TextSubstitution(text=word)] for word in words])

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        self._perform_substitutions(context)
        arguments = {"ns": f"__ns:={self.__expanded_node_namespace}"}
        if self.__name is not None:
            arguments["name"] = f"__node:={self.__expanded_name}"
        for extension in installed_extensions():
            words, arguments = extension.prepare_for_execute(context, arguments, self)
            self.cmd.extend(normalize_to_list_of_substitutions(word) for word in words)
        context.extend_locals({"ros_specific_arguments": arguments})
        actions = super().execute(context)
        if self.is_node_name_fully_specified():
            warn_about_repeats(context, self.node_name, self.name)
        return actions

    def resolve(self, context: LaunchContext) -> ResolvedProcess:
        process = super().resolve(context)
        sources = self.ros_arguments().parameters
        parameters = self.__parameters.resolve(context, self.__name_tokens(), sources, process.cwd)
        return process._replace(
            kind=self.process_kind,
            package=None if self.__node_package is None else _performed(context, self.__node_package),
            executable=_performed(context, self.__node_executable),
            name=self.__expanded_name,
            namespace=self.__expanded_node_namespace,
            fqn=self.node_name,
            remaps=tuple(self.__placed_remaps(process)),
            parameters=parameters.values,
            unknown_parameters=self.__parameters.unknown,
            unread_parameter_files=tuple(
                (context.host.parameter_file_sources.get(path, path), why) for path, why in parameters.unread
            ),
        )

    def __placed_remaps(self, process: ResolvedProcess) -> Iterator[RemapRule]:
        first = len(process.prefix) + self.__first_remap + 1  # "-r" stands before each
        for number, rule in enumerate(self.__expanded_remapping_rules or ()):
            yield placed(rule, process.location, first + 2 * number)

    def __name_tokens(self) -> list[str | None]:
        known = self.node_name.replace(UNSPECIFIED_NODE_NAMESPACE, "").split("/")
        return [None if token == UNSPECIFIED_NODE_NAME else token for token in known if token]


_COMMAND_LINES = (("args", "arguments"), ("ros_args", "ros_arguments"))
_TEXT_ATTRIBUTES = (
    ("node-name", "node_name"),  # upstream reads it, and then the constructor refuses it
    ("name", "name"),
    ("exec_name", "exec_name"),
    ("pkg", "package"),
    ("namespace", "namespace"),
)


def _performed(context: LaunchContext, value: SomeSubstitutionsType) -> str:
    return perform_substitutions(context, normalize_to_list_of_substitutions(value))


def parse_remaps(remaps: list[Entity], parser: Parser) -> list[PlacedRule]:
    """Return ``remap`` children as pairs of templates."""
    rules = []
    for remap in remaps:
        source = parser.parse_substitution(remap.get_attr("from"))
        target = parser.parse_substitution(remap.get_attr("to"))
        rules.append(PlacedRule.at(remap.source_location, source, target))
    for remap in remaps:
        remap.assert_entity_completely_parsed()
    return rules


def _parse_parameter(param: Entity, parser: Parser) -> Any:
    given = param.given
    if "from" not in given and "allow_substs" not in given and "name" in given:
        return _parse_named_parameters([param], parser)
    file = param.get_attr("from", optional=True)
    allow_substs: Any = param.get_attr("allow_substs", data_type=bool, optional=True)
    name = param.get_attr("name", optional=True)
    if file is not None and name is not None:
        raise RuntimeError("name and from attributes are mutually exclusive")
    if file is not None:
        if isinstance(allow_substs, str):
            allow_substs = parser.parse_substitution(allow_substs)
        param.assert_entity_completely_parsed()
        return ParameterFile(
            parser.parse_substitution(file), allow_substs=allow_substs if allow_substs else False
        )
    if name is None:
        raise ValueError("param Entity should have name or from attribute")
    if allow_substs is not None:
        raise RuntimeError("'allow_substs' can only be used together with 'from' attribute")
    return _parse_named_parameters([param], parser)


def _parse_named_parameters(params: list[Entity], parser: Parser) -> dict[tuple[Substitution, ...], Any]:
    return dict(_parse_named_parameter(param, parser) for param in params)


def _parse_named_parameter(param: Entity, parser: Parser) -> tuple[tuple[Substitution, ...], Any]:
    name = tuple(parser.parse_substitution(param.get_attr("name")))
    given = param.given
    type_name: Any = param.get_attr("type", data_type=None, optional=True) if "type" in given else None
    data_type = None if type_name is None else get_data_type_from_identifier(type_name)
    value: Any = param.get_attr("value", data_type=data_type, optional=True)
    nested = param.get_attr("param", data_type=list[Entity], optional=True) if "param" in given else None
    param.assert_entity_completely_parsed()
    if value is not None and nested:
        raise RuntimeError("nested parameters and value attributes are mutually exclusive")
    if data_type is not None and nested:
        raise RuntimeError("nested parameters and type attributes are mutually exclusive")
    if value is not None:
        return name, ParameterValue(parser.parse_if_substitutions(value), value_type=data_type)
    if nested:
        return name, _parse_named_parameters(nested, parser)
    raise RuntimeError("either a value attribute or nested params are needed")


def __getattr__(name: str) -> Any:
    # Upstream's place for it; here it has a module of its own, which loads only when requested.
    if name == "NodeActionExtension":
        return NodeActionExtension
    raise AttributeError(f"module 'launch_ros.actions.node' has no attribute {name!r}")


class PluginException(Exception):
    """An extension that was written for another version of the extension point."""


def satisfies_version(version: str, caret_range: str) -> None:
    """Raise ``PluginException`` unless ``version`` lies in ``^MAJOR.MINOR``: same major, for 0 same minor."""
    if not caret_range.startswith("^"):
        raise AssertionError("Only supports caret ranges")
    have, wanted = _numbers(version), _numbers(caret_range[1:])
    upper = (wanted[0] + 1, 0) if wanted[0] else (0, wanted[1] + 1)
    if have < wanted:
        raise PluginException(
            f"Extension point is too old ({version}), the extension requires {caret_range[1:]!r}"
        )
    if have >= upper:
        raise PluginException(
            f"Extension point is newer ({version}), than what the extension supports {caret_range[1:]!r}"
        )


def _numbers(version: str) -> tuple[int, int]:
    major, _, rest = version.partition(".")
    return int(major), int(rest.partition(".")[0] or 0)


_GROUP = "launch_ros.node_action"
# Extensions for upstream's engine that have no part in ours: our own, and ros2launch_security, whose enclave per
# node is what --enclave-scope node gives.
_REPLACED = ("enclave_launch.", "ros2launch_security.")


class NodeActionExtension:
    """Base of extensions; exported by ``launch_ros.actions.node``."""

    NAME: str | None = None
    EXTENSION_POINT_VERSION = "0.1"

    def __init__(self) -> None:
        satisfies_version(self.EXTENSION_POINT_VERSION, "^0.1")

    def prepare_for_execute(
        self, context: LaunchContext, ros_specific_arguments: dict[str, Any], node_action: Action
    ) -> tuple[list[Any], dict[str, Any]]:
        """Return words to append to the command line, and the (changed) local ROS arguments."""
        return [], ros_specific_arguments


@lru_cache(maxsize=1)
def installed_extensions() -> tuple[NodeActionExtension, ...]:
    """Return one instance of each extension of an installed launch_ros; warn about one that cannot be loaded."""
    if not any(os.path.isdir(os.path.join(folder, "launch_ros")) for folder in sys.path):
        return ()
    import importlib.metadata  # only where ROS is installed: it takes long to load

    found = importlib.metadata.entry_points(group=_GROUP)
    loaded = [_instantiate(entry) for entry in found if not entry.value.startswith(_REPLACED)]
    return tuple(extension for extension in loaded if extension is not None)


def _instantiate(entry_point: Any) -> NodeActionExtension | None:
    try:
        extension: NodeActionExtension = entry_point.load()()
    except Exception as error:  # foreign code: it may raise anything, and must not stop the launch
        warnings.warn(f"Failed to load the node extension {entry_point.name}: {error}", stacklevel=2)
        return None
    extension.NAME = entry_point.name
    return extension
