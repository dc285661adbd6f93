"""Our ``NamedTuple`` is ``typing``'s and our enumerations are those of ``enum``, but for what they cost to define."""

from __future__ import annotations

import copy
import enum
import inspect
import json
import pickle
import typing
from collections.abc import Callable

import pytest

from enclave_launch.boundary import light


class Ours(light.NamedTuple):
    """A remap rule."""

    source: str
    target: str = "/chatter"
    line: int | None = None

    @property
    def text(self) -> str:
        return f"{self.source}:={self.target}"


class Theirs(typing.NamedTuple):
    """A remap rule."""

    source: str
    target: str = "/chatter"
    line: int | None = None

    @property
    def text(self) -> str:
        return f"{self.source}:={self.target}"


class OursWithMore(Ours):
    def twice(self) -> str:
        return self.text * 2


USES: dict[str, Callable[[type[Ours] | type[Theirs]], object]] = {
    "by position": lambda kind: tuple(kind("a", "b", 3)),
    "by name, defaults for the rest": lambda kind: tuple(kind(source="a", line=3)),
    "a field by name": lambda kind: (kind("a").target, kind("a").text),
    "a field is missing": lambda kind: kind(),  # type: ignore[call-arg]
    "a field is unknown": lambda kind: kind("a", colour="red"),  # type: ignore[call-arg]
    "a field is given twice": lambda kind: kind("a", source="b"),  # type: ignore[misc]
    "one too many": lambda kind: kind("a", "b", 3, 4),  # type: ignore[call-arg]
    "a value cannot be set": lambda kind: setattr(kind("a"), "source", "b"),
    "an attribute cannot be added": lambda kind: setattr(kind("a"), "colour", "red"),
    "shown": lambda kind: repr(kind("a", line=3)).removeprefix(kind.__name__),
    "equal and hashed as a tuple": lambda kind: (kind("a") == ("a", "/chatter", None), hash(kind("a"))),
    "replaced": lambda kind: tuple(kind("a")._replace(line=4)),
    "an unknown field replaced": lambda kind: kind("a")._replace(colour="red"),  # type: ignore[call-arg]
    "made of a list": lambda kind: tuple(kind._make(["a", "b", 1])),
    "made of a list that is too short": lambda kind: kind._make(["a"]),
    "as a dictionary": lambda kind: kind("a")._asdict(),
    "what it tells of itself": lambda kind: (kind._fields, kind._field_defaults, kind.__match_args__, kind.__doc__),
    "its signature": lambda kind: [(each.name, each.default) for each in inspect.signature(kind).parameters.values()],
    "what its annotations are": lambda kind: typing.get_type_hints(kind),
    "copied": lambda kind: tuple(copy.deepcopy(kind("a"))),
    "pickled": lambda kind: type(pickle.loads(pickle.dumps(kind("a")))) is kind,
}  # fmt: skip


def outcome(use: Callable[[type[Ours] | type[Theirs]], object], kind: type[Ours] | type[Theirs]) -> object:
    try:
        return use(kind)
    except (TypeError, ValueError, AttributeError) as error:
        return type(error)


@pytest.mark.parametrize("use", USES)
def test_it_is_used_as_typings(use: str) -> None:
    assert outcome(USES[use], Ours) == outcome(USES[use], Theirs)


@pytest.mark.parametrize("use", USES)
def test_it_is_used_so_when_there_are_many_too(use: str) -> None:
    for number in range(100):
        Ours(str(number))
    assert outcome(USES[use], Ours) == outcome(USES[use], Theirs)


def test_a_pattern_takes_it_apart() -> None:
    match Ours("a", line=3):
        case Ours(source, line=line):
            assert (source, line) == ("a", 3)
        case _:
            raise AssertionError


def test_a_subclass_adds_methods() -> None:
    made = OursWithMore("a")
    assert made.twice() == "a:=/chattera:=/chatter"
    assert type(made._replace(line=1)) is OursWithMore


def test_classes_of_equal_fields_stay_apart() -> None:
    class Other(light.NamedTuple):
        source: str
        target: str

    assert Other("a", "b").target == "b"
    assert Ours("a").target == "/chatter"
    with pytest.raises(TypeError):
        Other("a")  # type: ignore[call-arg]


class OurWord(light.TextEnum):
    """How sure we are."""

    SURE = "sure"
    NOT_SURE = "not sure"
    NONE = ""

    @property
    def twice(self) -> str:
        return self.value * 2


class TheirWord(str, enum.Enum):
    """How sure we are."""

    SURE = "sure"
    NOT_SURE = "not sure"
    NONE = ""

    @property
    def twice(self) -> str:
        return self.value * 2


class Rated(light.TextEnum):
    """Members with something beside their text."""

    GOOD = "good", 1
    BAD = "bad", -1

    worth: int

    def __new__(cls, value: str, worth: int = 0) -> Rated:
        made = str.__new__(cls, value)
        made.worth = worth
        return made


WORDS: dict[str, Callable[[type[OurWord] | type[TheirWord]], object]] = {
    "all, in order": lambda kind: [(each.name, each.value, type(each.value)) for each in kind],
    "how many": lambda kind: len(kind),
    "by its text": lambda kind: kind("not sure") is kind.NOT_SURE,
    "by itself": lambda kind: kind(kind.NOT_SURE) is kind.NOT_SURE,
    "by a text that none has": lambda kind: kind("unsure"),
    "by its name": lambda kind: kind["NOT_SURE"] is kind.NOT_SURE,
    "by a name that none has": lambda kind: kind["UNSURE"],
    "a member is in it": lambda kind: kind.SURE in kind,
    "by all their names": lambda kind: [(name, each.value) for name, each in kind.__members__.items()],
    "equal to its text": lambda kind: kind.SURE == "sure" and kind.SURE != kind.NOT_SURE,
    "found among texts": lambda kind: kind.SURE in {"sure": 1},
    "an empty one is false": lambda kind: (bool(kind.NONE), bool(kind.SURE)),
    "a property": lambda kind: kind.SURE.twice,
    "a member and a text": lambda kind: isinstance(kind.SURE, kind) and isinstance(kind.SURE, str),
    "shown": lambda kind: repr(kind.SURE).removeprefix(f"<{kind.__name__}"),
    "in JSON": lambda kind: json.dumps({"word": kind.SURE}),
    "copied": lambda kind: copy.deepcopy([kind.SURE])[0] is kind.SURE,
    "pickled": lambda kind: pickle.loads(pickle.dumps(kind.SURE)) is kind.SURE,
    "no such member": lambda kind: kind.UNSURE,  # type: ignore[union-attr]
    "what it says of itself": lambda kind: kind.__doc__,
}


@pytest.mark.parametrize("use", WORDS)
def test_a_member_is_used_as_one_of_enum(use: str) -> None:
    try:
        theirs = WORDS[use](TheirWord)
    except (ValueError, AttributeError, KeyError) as error:
        with pytest.raises(type(error)):
            WORDS[use](OurWord)
    else:
        assert WORDS[use](OurWord) == theirs


def test_a_member_is_written_as_its_text() -> None:
    assert f"{OurWord.NOT_SURE}, {OurWord.SURE!s}" == "not sure, sure"


def test_a_member_may_have_more_than_its_text() -> None:
    assert [(each.value, each.worth) for each in Rated] == [("good", 1), ("bad", -1)]
    assert Rated("bad") is Rated.BAD
    assert copy.copy(Rated.BAD).worth == -1
