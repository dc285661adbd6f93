"""``launch_xml.Entity``: attribute typing (reference 2.2), children, and the check for what nobody read."""

from __future__ import annotations

import io
from typing import Any, List  # noqa: UP035  (what parse methods write)

import pytest

from enclave_launch.description.markup.entity import Entity as BaseEntity
from enclave_launch.description.markup.xml import Entity, Parser


def entity(text: str) -> Entity:
    return Parser.load(io.StringIO(text))[0]


TYPED: list[tuple[str, Any, Any]] = [
    ('v="a b"', str, "a b"),
    ('v="7"', int, 7),
    ('v="abc"', int, "abc"),
    ('v="1.5"', float, 1.5),
    ('v="inf"', float, float("inf")),
    ('v="$(var x)"', float, "$(var x)"),
    ('v="true"', bool, True),
    ('v="Off"', bool, False),
    ('v="1"', bool, True),
    ('v="$(var x)"', bool, "$(var x)"),
    ('v="maybe"', bool, "maybe"),
    ('v=""', bool, ""),
    ('v="1"', None, 1),
    ('v=" 1 "', None, 1),
    ('v="[1, $(var x)]"', None, [1, "$(var x)"]),
    ('v="$(var x)"', None, "$(var x)"),
    ('v="*"', None, "*"),
    ('v="1;2" v-sep=";"', None, [1, 2]),
    ('v="1;a" v-sep=";"', None, [1, "a"]),
    ('v="1;2" v-sep=";"', List[str], ["1", "2"]),  # noqa: UP006
    ('v="1, 2" v-sep=", "', List[int], [1, 2]),  # noqa: UP006
    ('v="[1, 2]"', List[int], [1, 2]),  # noqa: UP006
    ('v="a"', str, "a"),
]


@pytest.mark.parametrize(("attributes", "data_type", "value"), TYPED)
def test_an_attribute_reads_as(attributes: str, data_type: Any, value: Any) -> None:
    result = entity(f"<x {attributes}/>").get_attr("v", data_type=data_type)
    assert (type(result), result) == (type(value), value)


MISTYPED: list[tuple[str, Any]] = [
    ('v="null"', None),
    ('v=" "', None),
    ('v="#x"', None),
    ('v="-"', None),
    ('v="a: 1"', None),
    ('v="2020-01-01"', None),
    ('v="[1, 2.5]"', None),
    ('v="2"', bool),
    ('v="[a]"', bool),
    ('v="1"', List[int]),  # noqa: UP006
]


@pytest.mark.parametrize(("attributes", "data_type"), MISTYPED)
def test_an_attribute_of_the_wrong_type_is_a_type_error(attributes: str, data_type: Any) -> None:
    with pytest.raises(TypeError) as caught:
        entity(f"<x {attributes}/>").get_attr("v", data_type=data_type)
    assert str(caught.value).startswith(f"Attribute 'v' of Entity 'x' expected to be of type '{data_type}'.'")
    assert str(caught.value).endswith("' can not be converted to one of those types")


def test_a_separator_on_a_text_attribute_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="Cannot convert input"):
        entity('<x v="a;b" v-sep=";"/>').get_attr("v")


def test_without_can_be_str_text_must_convert() -> None:
    with pytest.raises(TypeError, match="can not be converted"):
        entity('<x v="a"/>').get_attr("v", data_type=int, can_be_str=False)


def test_a_missing_attribute() -> None:
    root = entity("<x/>")
    assert root.get_attr("v", optional=True) is None
    with pytest.raises(AttributeError) as caught:
        root.get_attr("v")
    assert str(caught.value) == "Attribute 'v' of type '<class 'str'>' not found in Entity 'x'"


def test_children_of_one_kind_keep_their_order() -> None:
    root = entity('<x><p n="1"/><q/><p n="2"/></x>')
    children = root.get_attr("p", data_type=List[BaseEntity])  # noqa: UP006
    assert [child.get_attr("n") for child in children] == ["1", "2"]
    assert [child.type_name for child in root.children] == ["p", "q", "p"]
    assert root.get_attr("r", data_type=List[BaseEntity], optional=True) is None  # noqa: UP006
    with pytest.raises(AttributeError, match=r"Attribute 'r' of type .* not found in Entity 'x'"):
        root.get_attr("r", data_type=List[BaseEntity])  # noqa: UP006


def test_everything_read_is_complete() -> None:
    root = entity('<x a="1" b="2;3" b-sep=";"><p/></x>')
    root.get_attr("a")
    root.get_attr("b", data_type=None)
    root.get_attr("p", data_type=List[BaseEntity])  # noqa: UP006
    root.assert_entity_completely_parsed()


def test_an_unread_attribute_is_unexpected() -> None:
    root = entity('<x a="1" b="2"/>')
    root.get_attr("a")
    with pytest.raises(ValueError, match=r"Unexpected attribute\(s\) found in `x`: \{'b'\}"):
        root.assert_entity_completely_parsed()


def test_a_separator_nobody_used_is_unexpected() -> None:
    root = entity('<x a-sep=";"/>')
    with pytest.raises(ValueError, match=r"Unexpected attribute\(s\) found in `x`: \{'a-sep'\}"):
        root.assert_entity_completely_parsed()


def test_an_unread_child_is_unexpected_before_attributes() -> None:
    with pytest.raises(ValueError, match=r"Unexpected nested tag\(s\) found in `x`: \{'p'\}"):
        entity('<x a="1"><p/></x>').assert_entity_completely_parsed()


def test_asking_for_children_reads_them_all() -> None:
    root = entity("<x><p/><q/></x>")
    assert len(root.children) == 2
    root.assert_entity_completely_parsed()
