"""Which parameter or argument a recorded name came from, over all observations of one node. Performs no I/O.

Measured on nine stacks with ordinary and with hostile values: a name that comes from a parameter is its value
verbatim, or one entry of it where it is a list, or below every entry of a list (``node_names`` of nav2's
lifecycle_manager). A name that holds any other value was a coincidence each time there; as programs that build names
so exist (``/fleet/<fleet>/robot_<robot_id>``, ``<prefix>_0``), the value is a candidate, and so is each combination of
several. Parameters whose name ends in ``frame``, ``frame_id`` or ``type`` were never the source of a name.

One observation gives candidates. A second one with another value decides: the name followed the value (proven), or
it did not (fixed). Until then both hold: the name that was seen, and the value of each candidate.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from types import MappingProxyType
from typing import NamedTuple

from nodl.name_template import PARAMETER_REFERENCE
from nodl.node_interface import EndpointKind

_NEVER = re.compile(r"(frame|frame_id|type)\Z")
_SEPARATORS = "/_"
_MOST_COMBINATIONS = 32  # of parameters in one name; real ones have two or three
_PREFERRED = re.compile(r"(topic|topic_name)\Z")

Inputs = Mapping[str, object]
"""Parameters by name; of the command line words as ``<1>``, ``<2>`` and the values of options by their names."""


class Name(NamedTuple):
    """A name in an observation; two kinds or types may have come from two parameters of one value."""

    kind: EndpointKind
    name: str
    type: str


class Observation(NamedTuple):
    """One node in one run: what it was given, the names it had, a label of the run, and the parameters that it declared
    and was not given."""

    inputs: Inputs
    names: frozenset[Name]
    run: str = ""
    defaults: Inputs = MappingProxyType({})

    @property
    def values(self) -> Inputs:
        """Return everything that the node could read, with what it declares on its command line (topic_tools)."""
        words = {value for name, value in self.inputs.items() if name[0] in "<-"}
        own = {name: value for name, value in self.defaults.items() if value not in words}
        return {**own, **self.inputs}


class Source(NamedTuple):
    """A parameter, or with ``each`` any entry of a list, and what the program puts before and after it.

    ``*`` in ``parameter`` stands for one part of its name; ``$(param NAME)`` in ``suffix`` for another parameter.
    """

    parameter: str
    each: bool = False
    suffix: str = ""
    prefix: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        return self.parameter, *(each[1] for each in PARAMETER_REFERENCE.finditer(self.suffix))

    def __str__(self) -> str:
        value = f"each of {self.parameter}" if self.each else self.parameter
        return " and ".join(filter(None, (self.prefix, value, self.suffix)))


class NameOrigin(NamedTuple):
    """Origin of a name.

    ``source`` ``None``: fixed in the program, or from one of ``candidates``. ``proven``: another value was seen to be
    followed, by ``source`` and all ``candidates``; else one run says so. ``default``: the name where the launch sets
    nothing, if it was seen.
    """

    source: Source | None = None
    proven: bool = False
    default: str | None = None
    candidates: tuple[Source, ...] = ()

    @property
    def undecided(self) -> bool:
        return bool(self.candidates)


FIXED = NameOrigin()


def origins_of(observations: Sequence[Observation]) -> dict[Name, NameOrigin]:
    """Return the origin of each name that was seen in any of ``observations`` (all of one node of one program)."""
    found = {
        name: _with_default(_origin(name, observations), observations)
        for name in sorted({name for each in observations for name in each.names})
    }
    return _without_defaults(_generalised(found), observations)


def candidates(name: str, inputs: Inputs) -> tuple[Source, ...]:
    """Return the inputs whose value is ``name``; those that are called a topic go before all others."""
    found = [
        source
        for parameter, value in sorted(inputs.items())
        if not _NEVER.search(parameter) and (source := _source(parameter, value, name)) is not None
    ]
    return tuple([each for each in found if _PREFERRED.search(each.parameter)] or found)


def possible_sources(name: Name, seen: Observation) -> tuple[Source, ...]:
    """Return what the launch gave, what the program declared, and lists whose entries it appends something to."""
    found = (*candidates(name.name, seen.values), *_names_of_entries(name, seen))
    return found or tuple(_texts_within(name, seen))


def _source(parameter: str, value: object, name: str) -> Source | None:
    if isinstance(value, str) and value == name:
        return Source(parameter)
    if isinstance(value, list | tuple) and name in value:
        return Source(parameter, each=True)
    return None


def _origin(name: Name, observations: Sequence[Observation]) -> NameOrigin:
    seen_in = [each for each in observations if name in each.names]
    per_observation = [set(_all_sources(name, each)) for each in seen_in]
    if not all(per_observation):
        return FIXED  # it was there once without any input of that value
    common = set.intersection(*per_observation)
    possible = dict.fromkeys(source for each in seen_in for source in possible_sources(name, each))
    left = [
        source
        for source in possible
        if (source in common or not common)  # one start gave a word, another a parameter
        and not any(_contradicts(name, source, each) for each in observations)
    ]
    followed = [source for source in left if any(_follows(name, source, each) for each in observations)]
    if followed and common:
        return NameOrigin(followed[0], proven=True, candidates=tuple(followed[1:]))
    if common and len(left) == 1 and any(_is_telling(left[0], each) for each in seen_in):
        return NameOrigin(left[0])
    return NameOrigin(candidates=tuple(left)) if left else FIXED


def _all_sources(name: Name, seen: Observation) -> Iterable[Source]:
    for parameter, value in seen.values.items():
        source = _source(parameter, value, name.name)
        if source is not None:
            yield source
    yield from _names_of_entries(name, seen)
    yield from _texts_within(name, seen)


def _names_of_entries(name: Name, seen: Observation) -> Iterable[Source]:
    """Yield lists of which every entry has a name like this one."""
    for parameter, value in sorted(seen.inputs.items()):
        entries = _entries(value)
        for source in (each for entry in entries for each in _within(name.name, parameter, entry, each=True)):
            texts = (f"{source.prefix}{entry}{source.suffix}" for entry in entries)
            if all(name._replace(name=text) in seen.names for text in texts):
                yield source


def _texts_within(name: Name, seen: Observation) -> Iterable[Source]:
    """Yield values that the name holds: by chance more often than not, so that another run has to decide."""
    values = {parameter: text for parameter, value in sorted(seen.values.items()) if (text := _text(value))}
    alone = (
        source
        for parameter, text in values.items()
        for source in _within(name.name, parameter, text, each=False)
    )
    for source in alone:
        yield from islice(_with_further(source, values), _MOST_COMBINATIONS)


def _with_further(source: Source, values: Mapping[str, str]) -> Iterable[Source]:
    yield source
    for parameter, text in values.items():
        if parameter == source.parameter:
            continue
        for further in _within(source.suffix, parameter, text, each=False):
            for rest in _with_further(further, values):
                yield source._replace(suffix=f"{rest.prefix}$(param {rest.parameter}){rest.suffix}")


def _text(value: object) -> str | None:
    is_number = isinstance(value, int) and not isinstance(value, bool)
    return str(value) if is_number or isinstance(value, str) else None


def _within(name: str, parameter: str, entry: str, *, each: bool) -> Iterable[Source]:
    if not entry or _NEVER.search(parameter):
        return
    for place in range(len(name) - len(entry) + 1):
        prefix, suffix = name[:place], name[place + len(entry) :]
        if (
            name.startswith(entry, place)
            and (prefix or suffix)
            and (not prefix or prefix[-1] in _SEPARATORS)
            and (not suffix or suffix[0] in _SEPARATORS)
        ):
            yield Source(parameter, each, suffix, prefix)


def _is_telling(source: Source, seen: Observation) -> bool:
    """Return True if one run is enough: a name that holds the one entry of a list, or a text, may do so by chance."""
    is_the_value = not source.prefix and not source.suffix
    return is_the_value or len(_entries(seen.inputs.get(source.parameter))) > 1


def _entries(value: object) -> frozenset[str]:
    return frozenset(map(str, value)) - {""} if isinstance(value, list | tuple) else frozenset()


def _values(source: Source, seen: Observation) -> frozenset[str]:
    values = seen.values
    text = _text(values.get(source.parameter))
    entries = _entries(values.get(source.parameter)) if source.each else () if text is None else (text,)
    further = {name: _text(values.get(name)) for name in source.parameters[1:]}
    if None in further.values():
        return frozenset()
    suffix = PARAMETER_REFERENCE.sub(lambda reference: further[reference[1]] or "", source.suffix)
    return frozenset(f"{source.prefix}{entry}{suffix}" for entry in entries)


def _contradicts(name: Name, source: Source, other: Observation) -> bool:
    values = _values(source, other)
    if not values or name.name in values:
        return False
    return name in other.names and not any(name._replace(name=value) in other.names for value in values)


def _follows(name: Name, source: Source, other: Observation) -> bool:
    values = _values(source, other)
    if not values or name.name in values or name in other.names:
        return False
    return all(name._replace(name=value) in other.names for value in values)


def _with_default(origin: NameOrigin, observations: Sequence[Observation]) -> NameOrigin:
    if origin.source is None or origin.source.each:
        return origin

    def declared(parameter: str) -> str | None:
        found = {each.defaults[parameter] for each in observations if parameter in each.defaults}
        return str(found.pop()) if len(found) == 1 else None

    def with_default(reference: re.Match[str]) -> str:
        default = declared(reference[1])
        return reference[0] if default is None else f"$(param {reference[1]} {default})"

    suffix = PARAMETER_REFERENCE.sub(with_default, origin.source.suffix)
    return origin._replace(
        source=origin.source._replace(suffix=suffix), default=declared(origin.source.parameter)
    )


def _generalised(found: Mapping[Name, NameOrigin]) -> dict[Name, NameOrigin]:
    """Replace ``topics.a.topic`` and ``topics.b.topic`` by ``topics.*.topic``: keys that are data, if two were seen.

    A parameter with a default is one that the program knows by name.
    """
    families: dict[tuple[object, ...], set[str]] = {}
    for name, origin in found.items():
        if origin.source and origin.default is None:
            for family in _families(origin.source.parameter):
                alike = (name.kind, name.type, origin.source[2:], family)
                families.setdefault(alike, set()).add(origin.source.parameter)
    result = dict(found)
    for name, origin in found.items():
        for family in _families(origin.source.parameter) if origin.source and origin.default is None else ():
            if origin.source and len(families[name.kind, name.type, origin.source[2:], family]) > 1:
                result[name] = origin._replace(source=origin.source._replace(parameter=family))
                break
    return result


def _families(parameter: str) -> list[str]:
    """Return the parameter with one middle part, or the first of several, replaced.

    The last part says what the value means and stays.
    """
    parts = parameter.split(".")
    return [".".join([*parts[:i], "*", *parts[i + 1 :]]) for i in range(len(parts) - 1)][::-1]


def _without_defaults(
    found: Mapping[Name, NameOrigin], observations: Sequence[Observation]
) -> dict[Name, NameOrigin]:
    """Take a fixed name that is there only where the parameter is not set for the parameter's default."""
    result = dict(found)
    for name, origin in found.items():
        if origin.source is None or origin.default is not None or origin.source.suffix:
            continue
        unset = [each for each in observations if not _given(origin.source, each.inputs)]
        names_when_set = {
            other for each in observations if _given(origin.source, each.inputs) for other in each.names
        }
        defaults = {
            other
            for each in unset
            for other in each.names
            if (other.kind, other.type) == (name.kind, name.type)
            and other not in names_when_set
            and found[other] == FIXED
        }
        if len(defaults) == 1:
            (default,) = defaults
            result[name] = origin._replace(default=default.name, proven=True)
            result.pop(default, None)
    return result


def _given(source: Source, inputs: Inputs) -> bool:
    pattern = re.escape(source.parameter).replace(r"\*", "[^.]+")
    return any(re.fullmatch(pattern, parameter) for parameter in inputs)
