"""``executable``: any program."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from enclave_launch.description.launch.action import Action
from enclave_launch.description.launch.actions.execute_local import ExecuteLocal
from enclave_launch.description.launch.actions.shutdown_action import Shutdown
from enclave_launch.description.launch.descriptions.executable import Executable
from enclave_launch.description.launch.frontend.entity import Entity
from enclave_launch.description.launch.frontend.expose import expose_action
from enclave_launch.description.launch.substitutions.text_substitution import TextSubstitution
from enclave_launch.host.current import current_release
from enclave_launch.ros_rules.distro import Feature

if TYPE_CHECKING:
    from enclave_launch.description.launch.frontend.parser import Parser
    from enclave_launch.description.launch.some_substitutions_type import SomeSubstitutionsType
    from enclave_launch.description.launch.substitution import Substitution
    from enclave_launch.ros_rules.distro import Release


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
        """Text of a command line -> its arguments, each a list of substitutions."""
        return split_words(parser.parse_substitution(cmd))

    @classmethod
    def parse(
        cls, entity: Entity, parser: Parser, ignore: list[str] | None = None
    ) -> tuple[type[Action], dict[str, Any]]:
        """``ignore``: arguments that a subclass reads itself, or does not have."""
        _, kwargs = super().parse(entity, parser)
        skipped = ignore or ()
        if "cmd" not in skipped:
            kwargs["cmd"] = cls._parse_cmdline(entity.get_attr("cmd"), parser)
        given = entity.given
        for attribute, keyword, read in _attributes_of(current_release()):
            if attribute in given and keyword not in skipped:
                value = read(entity, parser, attribute)
                if value is not None:
                    kwargs[keyword] = value
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


def _text(entity: Entity, parser: Parser, name: str) -> Any:
    value = entity.get_attr(name, optional=True)
    return None if value is None else parser.parse_substitution(value)


def _flag(entity: Entity, parser: Parser, name: str) -> Any:
    return entity.get_attr(name, data_type=bool, optional=True)


def _count(entity: Entity, parser: Parser, name: str) -> Any:
    return entity.get_attr(name, data_type=int, optional=True)


def _seconds(entity: Entity, parser: Parser, name: str) -> Any:
    value: Any = entity.get_attr(name, data_type=float, optional=True)
    if value is not None and value < 0.0:
        raise ValueError(
            f"Attribute {name} of Entity node expected to be a non-negative value but got `{value}`"
        )
    return value


def _seconds_as_text(entity: Entity, parser: Parser, name: str) -> Any:
    value = _seconds(entity, parser, name)
    return None if value is None else str(value)


def _on_exit(entity: Entity, parser: Parser, name: str) -> Any:
    value = entity.get_attr(name, optional=True)
    if value is None:
        return None
    if value != "shutdown":
        raise ValueError(
            f"Attribute on_exit of Entity node expected to be shutdown but got `{value}`"
            "Other on_exit actions not yet supported"
        )
    return [Shutdown()]


def _environment(entity: Entity, parser: Parser, name: str) -> Any:
    variables = entity.get_attr(name, data_type=list[Entity], optional=True)
    if variables is None:
        return None
    parse = parser.parse_substitution
    environment = {
        tuple(parse(variable.get_attr("name"))): parse(variable.get_attr("value")) for variable in variables
    }
    for variable in variables:
        variable.assert_entity_completely_parsed()
    return environment


_Attribute = tuple[
    str, str, Callable[[Entity, "Parser", str], Any]
]  # attribute, constructor argument, reader

_ATTRIBUTES: tuple[_Attribute, ...] = (
    ("cwd", "cwd", _text),
    ("name", "name", _text),
    ("launch-prefix", "prefix", _text),
    ("output", "output", _text),
    ("respawn", "respawn", _text),
    ("enclave", "enclave", _text),
    ("respawn_delay", "respawn_delay", _seconds),
    ("shell", "shell", _flag),
)
_EXIT_AND_TTY: tuple[_Attribute, ...] = (
    ("on_exit", "on_exit", _on_exit),
    ("emulate_tty", "emulate_tty", _flag),
)
_TIMEOUTS: tuple[_Attribute, ...] = (
    ("respawn_max_retries", "respawn_max_retries", _count),
    ("sigkill_timeout", "sigkill_timeout", _seconds_as_text),
    ("sigterm_timeout", "sigterm_timeout", _seconds_as_text),
)
_ENVIRONMENT: _Attribute = ("env", "additional_env", _environment)


@lru_cache(maxsize=8)
def _attributes_of(release: Release) -> tuple[_Attribute, ...]:
    """The optional attributes of a process element, in the order in which upstream reads them."""
    return (
        *_ATTRIBUTES,
        *(_EXIT_AND_TTY if release.has(Feature.EXIT_AND_TTY_ATTRIBUTES) else ()),
        *(_TIMEOUTS if release.has(Feature.TIMEOUT_ATTRIBUTES) else ()),
        _ENVIRONMENT,
    )


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
