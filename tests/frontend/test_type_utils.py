"""Coercion and checking of typed values: attributes in XML, and parameters."""

from __future__ import annotations

from typing import Any, List  # noqa: UP035  (what launch files write)

import pytest

from enclave_launch.description import typed_values as tu
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.substitution import TextSubstitution
from enclave_launch.description.substitutions.variables import LaunchConfiguration
from enclave_launch.host.current import active_host
from enclave_launch.host.plan_host import PlanHost

COERCED: list[tuple[str, Any, Any]] = [
    ("text", str, "text"),
    ("", str, ""),
    ("1", int, 1),
    (" 7 ", int, 7),
    ("1_0", int, 10),
    ("1e3", float, 1000.0),
    ("inf", float, float("inf")),
    ("true", bool, True),
    ("off", bool, False),
    ("1", bool, True),
    ("0", bool, False),
    ("1", None, 1),
    ("010", None, 8),
    ("1:30", None, 90),
    ("1e3", None, "1e3"),
    ("1.0e+3", None, 1000.0),
    ("on", None, True),
    ("y", None, "y"),
    ("'1'", None, "1"),
    ("", None, ""),
    ("[1, 2]", None, [1, 2]),
    ("[]", None, []),
    ("[1, true]", None, [1, True]),
    ("a # b", None, "a"),
    ("[1, 2]", List[int], [1, 2]),  # noqa: UP006
    ("[a, b]", list[str], ["a", "b"]),
]


@pytest.mark.parametrize(("text", "data_type", "value"), COERCED)
def test_text_becomes(text: str, data_type: Any, value: Any) -> None:
    result = tu.coerce_to_type(text, data_type)
    assert (type(result), result) == (type(value), value)


REFUSED: list[tuple[str, Any, str]] = [
    ("abc", int, "invalid literal for int"),
    ("1.5", int, "invalid literal for int"),
    ("abc", float, "could not convert string to float"),
    ("maybe", bool, "Cannot convert value 'maybe' to '<class 'bool'>'"),
    ("2", bool, "Cannot convert value '2' to"),
    ("null", None, "Failed to convert 'null' using yaml rules: output type is not allowed"),
    ("a: 1", None, "output type is not allowed"),
    ("2020-01-01", None, "output type is not allowed"),
    ("[true, 1]", None, "output type is not allowed"),
    ("[1, 2.5]", None, "output type is not allowed"),
    ("[1, a]", None, "output type is not allowed"),
    ("a: b: c", None, "yaml.safe_load\\(\\) failed"),
    ("1", List[int], "to a list of"),  # noqa: UP006
    ("[a]", List[int], "to a list of"),  # noqa: UP006
    ("1", dict, "Unrecognized data type"),
]


@pytest.mark.parametrize(("text", "data_type", "message"), REFUSED)
def test_text_is_refused(text: str, data_type: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tu.coerce_to_type(text, data_type)


KEPT: list[tuple[str, Any]] = [
    ("abc", int),
    ("$(var x)", float),
    ("maybe", bool),
    ("a: b: c", None),
    ("*", None),
]


@pytest.mark.parametrize(("text", "data_type"), KEPT)
def test_text_is_kept_where_it_may_hold_substitutions(text: str, data_type: Any) -> None:
    assert tu.coerce_to_type(text, data_type, can_be_str=True) == text


@pytest.mark.parametrize("text", ["2", "[1]", "null", "1.5"])
def test_a_boolean_attribute_with_another_yaml_type_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"Cannot convert|Failed to convert"):
        tu.coerce_to_type(text, bool, can_be_str=True)


def test_only_text_is_coerced() -> None:
    with pytest.raises(TypeError, match="'coerce_to_type' expected 'value' to be one of"):
        tu.coerce_to_type(1, int)  # type: ignore[arg-type]


@pytest.mark.parametrize("digit", ["0", "1"])
def test_humble_has_no_digits_for_booleans(digit: str) -> None:
    with active_host(PlanHost(distro="humble@2024-12")), pytest.raises(ValueError, match=f"value '{digit}'"):
        tu.coerce_to_type(digit, bool)


def test_a_list_of_texts_is_coerced_item_by_item() -> None:
    assert tu.get_typed_value(["1", "2"], None) == [1, 2]
    assert tu.get_typed_value(["1", "2"], List[str]) == ["1", "2"]  # noqa: UP006
    assert tu.get_typed_value(["1", "$(var x)"], None, can_be_str=True) == [1, "$(var x)"]
    with pytest.raises(TypeError, match="Cannot convert input"):
        tu.get_typed_value(["1"], int)
    with pytest.raises(ValueError, match="cannot convert value to None"):
        tu.get_typed_value(["1", "a"], None)


VAR = LaunchConfiguration("x")

NORMALIZED: list[tuple[Any, Any, Any]] = [
    (1, int, 1),
    ("a", None, "a"),
    (True, bool, True),
    (VAR, int, [VAR]),
    ([VAR, VAR], None, [VAR, VAR]),
    ([1, 2], None, [1, 2]),
    ([1, 2.5], None, [1.0, 2.5]),
    ((1, 2), List[int], [1, 2]),  # noqa: UP006
    ([1, [VAR]], List[int], [1, [VAR]]),  # noqa: UP006
    ([True, VAR], None, [True, [VAR]]),
    (["a", [VAR]], None, ["a", [VAR]]),
    ([[VAR]], List[bool], [[VAR]]),  # noqa: UP006
    ([], None, []),
]


@pytest.mark.parametrize(("value", "data_type", "normalized"), NORMALIZED)
def test_values_are_normalized(value: Any, data_type: Any, normalized: Any) -> None:
    result = tu.normalize_typed_substitution(value, data_type)
    assert result == normalized
    assert repr(result) == repr(normalized)  # 1 is not 1.0


NOT_NORMALIZABLE: list[tuple[Any, Any, str]] = [
    ("abc", int, "value='abc' is not an instance of <class 'int'>"),
    (None, None, "value should be either a scalar"),
    ([1, "a"], None, "not an acceptable 'SomeValueType'"),
    ([1, True], None, "not an acceptable 'SomeValueType'"),
    ([1, None], None, "one of the items is not a scalar"),
    ([1], int, "resolves to a list, though the required type is a scalar"),
    ([1], List[float], "Got a list of '<class 'int'>', expected a list of '<class 'float'>'"),  # noqa: UP006
    ([], List[int], "Got a list of '<class 'str'>', expected a list of '<class 'int'>'"),  # noqa: UP006
]


@pytest.mark.parametrize(("value", "data_type", "message"), NOT_NORMALIZABLE)
def test_values_that_can_never_fit_are_refused(value: Any, data_type: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        tu.normalize_typed_substitution(value, data_type)


def context(**configurations: str) -> LaunchContext:
    result = LaunchContext()
    result.launch_configurations.update(configurations)
    return result


@pytest.mark.parametrize(
    ("performed", "data_type", "value"),
    [("007", None, 7), ("007", str, "007"), ("[1, 2]", None, [1, 2]), ("", None, ""), ("1", bool, True)],
)
def test_a_performed_text_is_coerced(performed: str, data_type: Any, value: Any) -> None:
    assert tu.perform_typed_substitution(context(x=performed), [VAR], data_type) == value


def test_items_of_a_list_are_performed_and_coerced() -> None:
    assert tu.perform_typed_substitution(context(x="2"), [1, [VAR]], None) == [1, 2]
    assert tu.perform_typed_substitution(context(x="2"), ["a", [VAR]], List[str]) == ["a", "2"]  # noqa: UP006
    with pytest.raises(ValueError, match="The output list is not uniform"):
        tu.perform_typed_substitution(context(x="a"), [1, [VAR]], None)
    with pytest.raises(ValueError, match="The output list does not match the expected type"):
        tu.perform_typed_substitution(context(x="2"), ["a", [VAR]], List[int])  # noqa: UP006


def test_what_is_not_normalized_is_refused() -> None:
    with pytest.raises(TypeError, match="not an acceptable 'NormalizedValueType'"):
        tu.perform_typed_substitution(context(), None, None)
    with pytest.raises(TypeError, match="is a scalar and not an instance"):
        tu.perform_typed_substitution(context(), "a", int)


def test_substitutions_are_recognised() -> None:
    text = TextSubstitution(text="a")
    assert tu.is_substitution(text) and tu.is_substitution([text, "b"])
    assert not tu.is_substitution(["a", "b"]) and not tu.is_substitution([]) and not tu.is_substitution(1)
    assert tu.is_normalized_substitution([text]) and not tu.is_normalized_substitution(["a", text])


def test_types_are_extracted() -> None:
    assert tu.extract_type(List[int]) == (int, True)  # noqa: UP006
    assert tu.extract_type(bool) == (bool, False)
    assert tu.is_typing_list(List) and tu.is_typing_list(list[int]) and not tu.is_typing_list(list)  # noqa: UP006
    with pytest.raises(ValueError, match="Unrecognized data type"):
        tu.extract_type(bytes)
