"""Text -> substitution objects: instantiation, errors, sharing, ``parse_if_substitutions``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.markup.expose import expose_substitution, instantiate_substitution
from enclave_launch.description.markup.parse_substitution import (
    parse_if_substitutions,
    parse_substitution,
    replace_escaped_characters,
)
from enclave_launch.description.substitution import Substitution, TextSubstitution
from enclave_launch.description.substitutions.paths import ThisLaunchFileDir
from enclave_launch.description.substitutions.variables import EnvironmentVariable, LaunchConfiguration
from enclave_launch.frontend.substitution_grammar import UnexpectedCharacters, VisitError
from enclave_launch.host.current import active_host
from enclave_launch.host.plan_host import PlanHost


class Shout(Substitution):
    """A third party's substitution, with a state of its own."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.text = text
        self.performed = 0

    def perform(self, context: LaunchContext) -> str:
        self.performed += 1
        return self.text.upper()


@expose_substitution("test-shout")
def parse_shout(data: Iterable[Any]) -> tuple[type[Shout], dict[str, Any]]:
    """One literal argument."""
    (argument,) = data
    return Shout, {"text": "".join(part.text for part in argument)}


def test_the_empty_text_is_one_text_substitution() -> None:
    (part,) = parse_substitution("")
    assert isinstance(part, TextSubstitution) and part.text == ""


def test_text_and_substitutions_alternate() -> None:
    parts = parse_substitution("why_$(test-shout asd)_asd_$(dirname)")
    assert [type(part) for part in parts] == [TextSubstitution, Shout, TextSubstitution, ThisLaunchFileDir]


def test_arguments_are_templates() -> None:
    (part,) = parse_substitution("""$(env "a_$(var b)" '')""")
    assert isinstance(part, EnvironmentVariable)
    assert [type(item) for item in part.name] == [TextSubstitution, LaunchConfiguration]
    assert part.default_value == []


REFUSED = {
    "$(nope)": "Unknown substitution: nope",
    "$(arg x)": "Unknown substitution: arg",
    "$(var)": "var substitution expects 1 or 2 arguments",
    "$(var a b c)": "var substitution expects 1 or 2 arguments",
    "$(test-shout)": "not enough values to unpack",
}


@pytest.mark.parametrize(("text", "complaint"), REFUSED.items())
def test_a_refused_call_is_a_visit_error(text: str, complaint: str) -> None:
    with pytest.raises(VisitError) as caught:
        parse_substitution(text)
    assert str(caught.value).startswith('Error trying to process rule "substitution":\n\n')
    assert complaint in str(caught.value)
    assert complaint in str(caught.value.orig_exc)


def test_syntax_comes_before_names() -> None:
    with pytest.raises(UnexpectedCharacters):
        parse_substitution("$(nope) $(var x )")


def test_the_innermost_call_complains_first() -> None:
    with pytest.raises(VisitError, match="Unknown substitution: inner"):
        parse_substitution("$(outer '$(inner)')")


def test_names_that_a_release_has_not() -> None:
    parse_substitution("$(equals a b)")
    with (
        active_host(PlanHost(distro="humble@2024-12")),
        pytest.raises(VisitError, match="substitution: equals"),
    ):
        parse_substitution("$(equals a b)")
    parse_substitution("$(equals a b)")


def test_our_objects_are_shared_in_new_lists() -> None:
    first, second = parse_substitution("a$(var x)"), parse_substitution("a$(var x)")
    assert first is not second
    assert first[1] is second[1]


def test_foreign_objects_are_never_shared() -> None:
    (first,), (second,) = parse_substitution("$(test-shout a)"), parse_substitution("$(test-shout a)")
    assert first is not second
    outer = [parse_substitution("$(var $(test-shout a))")[0] for _ in range(2)]
    assert outer[0] is not outer[1]


def test_instantiation_by_hand() -> None:
    substitution = instantiate_substitution("var", [[TextSubstitution(text="x")]])
    assert isinstance(substitution, LaunchConfiguration)
    with pytest.raises(RuntimeError, match="Unknown substitution: nope"):
        instantiate_substitution("nope")


@pytest.mark.parametrize("value", [1, 1.5, True, "plain", [1, 2], ["a", "b"], []])
def test_plain_values_stay(value: object) -> None:
    assert parse_if_substitutions(value) == value


def test_plain_text_is_unescaped() -> None:
    assert parse_if_substitutions(r"a\b \$(var x)") == "ab $(var x)"
    assert replace_escaped_characters(r"\\ \a") == r"\ a"


def test_texts_with_substitutions_become_lists() -> None:
    assert [type(part) for part in parse_if_substitutions("[$(var a), x]")] == [
        TextSubstitution,
        LaunchConfiguration,
        TextSubstitution,
    ]
    items = parse_if_substitutions(["$(var a)", "b"])
    assert isinstance(items[0][0], LaunchConfiguration) and items[1] == "b"


@pytest.mark.parametrize("value", [["$(var a)", 1, 1.0], [1, "a"], [True, 1]])
def test_plain_items_of_different_types_are_refused(value: list[object]) -> None:
    with pytest.raises(ValueError, match="The result is a non-uniform list"):
        parse_if_substitutions(value)
