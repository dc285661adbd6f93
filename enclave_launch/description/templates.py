"""Declare a template once: constructor argument, attribute of XML and YAML (or argument of ``$(...)``), property.

    @expose_action("let")
    class SetLaunchConfiguration(TemplateAction):
        name = template()
        value = template()

takes ``SetLaunchConfiguration(name, value, condition=...)`` and ``<let name="..." value="..."/>``; both attributes are
lists of substitutions, to be performed when the action is executed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from inspect import Parameter, Signature
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from enclave_launch.description.entity import Action
from enclave_launch.description.substitution import Substitution, normalize_to_list_of_substitutions

if TYPE_CHECKING:
    import inspect

    from enclave_launch.description.markup.entity import Entity, Parser
    from enclave_launch.description.substitution import SomeSubstitutionsType

_REQUIRED: Any = object()


class Template(NamedTuple):
    """One declaration. ``read`` makes what is stored from what the constructor is given; ``None`` as default is stored.
    ``attribute``: its name in XML and YAML, ``None`` for the same, empty where they have none."""

    attribute: str | None
    default: Any
    keyword_only: bool
    read: Callable[[Any], Any]
    data_type: Any

    def parse(self, name: str, entity: Entity, parser: Parser) -> Any:
        """Parse the constructor argument that ``entity`` gives; None without one."""
        if self.attribute == "":
            return None
        attribute = self.attribute or name
        if self.default is not _REQUIRED and attribute not in entity.given:
            return None
        optional = self.default is not _REQUIRED
        value = entity.get_attr(attribute, data_type=self.data_type, optional=optional)
        if value is None:
            return None
        return (
            parser.parse_substitution(value)
            if self.data_type is str
            else parser.parse_if_substitutions(value)
        )


def template(
    *,
    attribute: str | None = None,
    default: Any = _REQUIRED,
    keyword_only: bool = False,
    read: Callable[[Any], Any] = normalize_to_list_of_substitutions,
    data_type: Any = str,
) -> Any:
    """Declare a template. ``attribute``: its name in XML and YAML where that differs."""
    return Template(attribute, default, keyword_only, read, data_type)


def stored(default: Any = _REQUIRED, *, keyword_only: bool = True) -> Any:
    """Declare an argument of the constructor alone, which keeps it as it is."""
    return Template("", default, keyword_only, lambda value: value, None)


def _private(name: str) -> str:
    """Return the attribute that stores a template: launch files cannot set it by accident, and a subclass of
    theirs may have its own ``name``."""
    return f"_Template__{name}"


class _Signature:
    """A descriptor that gives ``inspect.signature`` the declared arguments of a class."""

    def __get__(self, instance: object, owner: type[_Templates]) -> inspect.Signature:
        if owner.__init__ not in (TemplateAction.__init__, TemplateSubstitution.__init__):
            raise AttributeError("__signature__")
        parameters = [
            Parameter(
                name,
                Parameter.KEYWORD_ONLY if item.keyword_only else Parameter.POSITIONAL_OR_KEYWORD,
                default=Parameter.empty if item.default is _REQUIRED else item.default,
            )
            for name, item in owner._declared.items()
        ]
        if issubclass(owner, Action):
            parameters.append(Parameter("kwargs", Parameter.VAR_KEYWORD))
        return Signature(parameters)


class _Templates:
    _declared: ClassVar[dict[str, Template]] = {}
    __signature__ = _Signature()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        own = {name: item for name, item in vars(cls).items() if isinstance(item, Template)}
        for name in own:
            setattr(cls, name, property(attrgetter(_private(name))))
        inherited = {name: item for name, item in cls._declared.items() if name not in own}
        cls._declared = {**inherited, **own}

    def _take(self, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> None:
        """Keep what was given for each template, and take it out of ``keywords``. Raises Python's own ``TypeError``."""
        declared = self._declared
        given = self._by_position(arguments) if arguments else {}
        for name, item in declared.items():
            if name in keywords:
                if name in given:
                    raise TypeError(f"{self._constructor()} got multiple values for argument '{name}'")
                value = keywords.pop(name)
            else:
                value = given.get(name, item.default)
            if value is _REQUIRED:
                raise TypeError(self._missing(given, keywords, name))
            self.__dict__[_private(name)] = (
                None if value is None and item.default is None else item.read(value)
            )

    def _by_position(self, arguments: tuple[Any, ...]) -> dict[str, Any]:
        names = [name for name, item in self._declared.items() if not item.keyword_only]
        if len(arguments) > len(names):
            raise TypeError(
                f"{self._constructor()} takes {len(names) + 1} positional arguments "
                f"but {len(arguments) + 1} were given"
            )
        return dict(zip(names, arguments, strict=False))

    def _missing(self, given: dict[str, Any], keywords: dict[str, Any], first: str) -> str:
        missing = [
            name
            for name, item in self._declared.items()
            if item.default is _REQUIRED
            and name not in given
            and name not in keywords
            and _private(name) not in vars(self)
        ]
        kind = "keyword-only" if self._declared[first].keyword_only else "positional"
        plural = "s" if len(missing) > 1 else ""
        names = " and ".join(f"'{name}'" for name in missing)
        return f"{self._constructor()} missing {len(missing)} required {kind} argument{plural}: {names}"

    def _constructor(self) -> str:
        return f"{type(self).__name__}.__init__()"


class TemplateAction(_Templates, Action):
    """An action whose templates are declared; everything else given goes to ``Action``."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        self._take(arguments, keywords)
        super().__init__(**keywords)

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Action], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        for name, item in cls._declared.items():
            value = item.parse(name, entity, parser)
            if value is not None:
                kwargs[name] = value
        return cls, kwargs


class TemplateSubstitution(_Templates, Substitution):
    """A substitution whose templates are declared; in ``$(...)`` its arguments are theirs, in that order.

    ``refusal``: the exception for another number of arguments there, as upstream raises it.
    """

    refusal: ClassVar[tuple[type[Exception], str]]

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        self._take(arguments, keywords)
        if keywords:
            raise TypeError(
                f"{self._constructor()} got an unexpected keyword argument '{next(iter(keywords))}'"
            )

    @classmethod
    def parse(cls, data: Sequence[SomeSubstitutionsType]) -> tuple[type[Substitution], dict[str, Any]]:
        required = sum(item.default is _REQUIRED for item in cls._declared.values())
        if not required <= len(data) <= len(cls._declared):
            error, text = cls.refusal
            raise error(text)
        return cls, dict(zip(cls._declared, data, strict=False))


def described(substitutions: Sequence[Substitution]) -> str:
    """Join the descriptions as upstream does: ``'a' + LaunchConfig('b')``."""
    return " + ".join([sub.describe() for sub in substitutions])
