"""``launch_yaml.Entity``: no coercion (reference 2.3), children, and the check for what nobody read."""

from __future__ import annotations

import io
from typing import Any, List  # noqa: UP035  (what parse methods write)

import pytest

from enclave_launch.description.markup.entity import Entity as BaseEntity
from enclave_launch.description.markup.yaml import Entity, Parser


def entity(text: str) -> Entity:
    return Parser.load(io.StringIO(text))[0]


FITTING: list[tuple[str, Any, Any]] = [
    ("a", str, "a"),
    ("'1'", str, "1"),
    ("1", int, 1),
    ("1.5", float, 1.5),
    ("true", bool, True),
    ("$(var x)", bool, "$(var x)"),
    ("'false'", bool, "false"),
    ("$(var x)", float, "$(var x)"),
    ("'1'", None, "1"),
    ("'[1, 2]'", None, "[1, 2]"),
    ("[1, 2]", None, [1, 2]),
    ("[1, $(var x)]", None, [1, "$(var x)"]),
    ("[]", None, []),
    ("[1, 2]", List[int], [1, 2]),  # noqa: UP006
    ("true", int, True),
]


@pytest.mark.parametrize(("text", "data_type", "value"), FITTING)
def test_a_value_of_the_right_type(text: str, data_type: Any, value: Any) -> None:
    result = entity(f"x: {{v: {text}}}").get_attr("v", data_type=data_type)
    assert (type(result), result) == (type(value), value)


MISFITTING: list[tuple[str, Any, str]] = [
    ("1", str, "'<class 'str'>', got '<class 'int'>'"),
    ("true", str, "'<class 'str'>', got '<class 'bool'>'"),
    ("1", float, "'<class 'float'>', got '<class 'int'>'"),
    ("1", bool, "'<class 'bool'>', got '<class 'int'>'"),
    ("{a: 1}", None, "'None', got '<class 'dict'>'"),
    ("[1, 2.5]", None, "'None', got '<class 'list'>'"),
    ("null", None, "'None', got '<class 'NoneType'>'"),
]


@pytest.mark.parametrize(("text", "data_type", "message"), MISFITTING)
def test_a_value_of_the_wrong_type(text: str, data_type: Any, message: str) -> None:
    with pytest.raises(TypeError) as caught:
        entity(f"x: {{v: {text}}}").get_attr("v", data_type=data_type)
    assert str(caught.value) == f"Attribute 'v' of Entity 'x' expected to be of type {message}"


def test_a_missing_attribute() -> None:
    root = entity("x: {}")
    assert root.get_attr("v", optional=True) is None
    with pytest.raises(AttributeError) as caught:
        root.get_attr("v")
    assert str(caught.value) == "Can not find attribute 'v' in Entity 'x'"


def test_named_children_are_a_list_of_mappings() -> None:
    root = entity("x: {p: [{n: a}, {n: b}], q: {n: c}, r: [], s: [1]}")
    children = root.get_attr("p", data_type=List[BaseEntity])  # noqa: UP006
    assert [(child.type_name, child.get_attr("n")) for child in children] == [("p", "a"), ("p", "b")]
    for name in "qs":
        with pytest.raises(TypeError, match=f"'{name}' of Entity 'x' expected to be a list of dict"):
            root.get_attr(name, data_type=List[BaseEntity])  # noqa: UP006
    with pytest.raises(IndexError):
        root.get_attr("r", data_type=List[BaseEntity])  # noqa: UP006


@pytest.mark.parametrize("text", ["x: [{a: 1}, {b: 2}]", "x: {children: [{a: 1}, {b: 2}]}"])
def test_children_as_list_or_under_their_key(text: str) -> None:
    root = entity(text)
    assert [child.type_name for child in root.children] == ["a", "b"]
    root.assert_entity_completely_parsed()


def test_a_mapping_without_children_key() -> None:
    with pytest.raises(ValueError, match="Expected entity `x` to have children entities"):
        _ = entity("x: {a: 1}").children


def test_a_child_with_two_keys() -> None:
    with pytest.raises(RuntimeError, match="Subentities must be a dictionary with only one key"):
        _ = entity("x: [{a: 1, b: 2}]").children


def test_a_null_entity_has_no_attributes_to_look_at() -> None:
    with pytest.raises(TypeError, match="argument of type 'NoneType' is not iterable"):
        entity("reset_env:").get_attr("if", optional=True)


@pytest.mark.parametrize("text", ["a: 1\nb: 2", "{}", "plain text"])
def test_one_root_is_expected(text: str) -> None:
    with pytest.raises(RuntimeError, match="Expected only one root"):
        entity(text)


@pytest.mark.parametrize(("text", "error"), [("", TypeError), ("1", TypeError), ("[1]", AttributeError)])
def test_documents_that_are_no_mapping(text: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        entity(text)


def test_an_unread_key_is_unexpected() -> None:
    root = entity("x: {a: b, c: d}")
    root.get_attr("a")
    with pytest.raises(ValueError, match=r"Unexpected key\(s\) found in `x`: \{'c'\}"):
        root.assert_entity_completely_parsed()


def test_an_unread_list_is_unexpected() -> None:
    with pytest.raises(ValueError, match=r"Unexpected nested entity\(ies\) found in `x`"):
        entity("x: [{a: 1}]").assert_entity_completely_parsed()
