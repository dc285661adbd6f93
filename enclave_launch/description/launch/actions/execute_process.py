"""``executable``: any program."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.execute_local import ExecuteLocal
from enclave_launch.description.launch.actions.shutdown_action import Shutdown
from enclave_launch.description.launch.descriptions.executable import Executable
from enclave_launch.description.launch.frontend.entity import Entity
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.substitutions.text_substitution import TextSubstitution
from enclave_launch.evaluation.distro import Feature
from enclave_launch.evaluation.host import current_release

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitution import Substitution


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
        executable = Executable(cmd=cmd, prefix=prefix, name=name, cwd=cwd, env=env, additional_env=additional_env)
        super().__init__(process_description=executable, **kwargs)

    @classmethod
    def _parse_cmdline(cls, cmd: str, parser: Parser) -> list[SomeSubstitutionsType]:
        """Text of a command line -> its arguments, each a list of substitutions."""
        return split_words(parser.parse_substitution(cmd))

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[Action], dict[str, Any]]:
        """``ignore``: attributes that a subclass reads itself, or does not have."""
        _, kwargs = super().parse(entity, parser)
        reader = _AttributeReader(entity, parser, frozenset(ignore or ()), kwargs)
        if reader.wanted("cmd"):
            kwargs["cmd"] = cls._parse_cmdline(entity.get_attr("cmd"), parser)
        reader.text("cwd")
        reader.text("name")
        reader.text("launch-prefix", "prefix")
        reader.text("output")
        reader.text("respawn")
        reader.text("enclave")
        reader.seconds("respawn_delay", float)
        reader.flag("shell")
        _read_newer_attributes(reader)
        reader.environment()
        return cls, kwargs

    @property
    def name(self) -> Any:
        """The process name NAME-N once prepared, before that what was given."""
        description = self.process_description
        return description.name if description.final_name is None else description.final_name

    @property
    def cmd(self) -> Any:
        description = self.process_description
        return description.cmd if description.final_cmd is None else description.final_cmd

    @property
    def cwd(self) -> Any:
        description = self.process_description
        return description.cwd if description.final_cwd is None else description.final_cwd

    @property
    def env(self) -> Any:
        description = self.process_description
        return description.env if description.final_env is None else description.final_env

    @property
    def additional_env(self) -> Any:
        return self.process_description.additional_env


def _read_newer_attributes(reader: _AttributeReader) -> None:
    release = current_release()
    if release.has(Feature.EXIT_AND_TTY_ATTRIBUTES):
        reader.on_exit()
        reader.flag("emulate_tty")
    if release.has(Feature.TIMEOUT_ATTRIBUTES):
        reader.value("respawn_max_retries", int)
        reader.seconds("sigkill_timeout", str)
        reader.seconds("sigterm_timeout", str)


class _AttributeReader:
    """Reads the optional attributes of a process element into constructor arguments."""

    def __init__(self, entity: Entity, parser: Parser, ignore: frozenset[str], kwargs: dict[str, Any]) -> None:
        self.entity, self.parser, self.ignore, self.kwargs = entity, parser, ignore, kwargs

    def wanted(self, name: str) -> bool:
        return name not in self.ignore

    def text(self, attribute: str, name: str = "") -> None:
        name = name or attribute
        if self.wanted(name):
            value = self.entity.get_attr(attribute, optional=True)
            if value is not None:
                self.kwargs[name] = self.parser.parse_substitution(value)

    def value(self, name: str, data_type: type) -> None:
        if self.wanted(name):
            value: Any = self.entity.get_attr(name, data_type=data_type, optional=True)
            if value is not None:
                self.kwargs[name] = value

    def flag(self, name: str) -> None:
        self.value(name, bool)

    def seconds(self, name: str, convert: Callable[[float], object]) -> None:
        if not self.wanted(name):
            return
        value = self.entity.get_attr(name, data_type=float, optional=True)
        if value is None:
            return
        if value < 0.0:
            raise ValueError(
                f"Attribute {name} of Entity node expected to be a non-negative value but got `{value}`"
            )
        self.kwargs[name] = value if convert is float else convert(value)

    def on_exit(self) -> None:
        if not self.wanted("on_exit"):
            return
        value = self.entity.get_attr("on_exit", optional=True)
        if value is None:
            return
        if value != "shutdown":
            raise ValueError(
                f"Attribute on_exit of Entity node expected to be shutdown but got `{value}`"
                "Other on_exit actions not yet supported"
            )
        self.kwargs["on_exit"] = [Shutdown()]

    def environment(self) -> None:
        if not self.wanted("additional_env"):
            return
        variables = self.entity.get_attr("env", data_type=list[Entity], optional=True)
        if variables is None:
            return
        parse = self.parser.parse_substitution
        self.kwargs["additional_env"] = {
            tuple(parse(variable.get_attr("name"))): parse(variable.get_attr("value")) for variable in variables
        }
        for variable in variables:
            variable.assert_entity_completely_parsed()


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
        tokens = shlex.split(part.text)
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
