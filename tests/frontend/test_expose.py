"""The registries: decorators, unknown names, leftovers, places."""

from __future__ import annotations

import io
from typing import Any

import pytest

from enclave_launch.description.entity import Action
from enclave_launch.description.markup.entity import Entity, Parser
from enclave_launch.description.markup.expose import action_parse_methods, expose_action, instantiate_action
from enclave_launch.description.markup.parser import Parser as FrontEnd
from enclave_launch.description.markup.xml import Parser as XmlParser
from enclave_launch.frontend.error_location import location_of


@expose_action("test-blink")
class Blink(Action):
    """A third party's action."""

    def __init__(self, times: int, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.times = times

    @classmethod
    def parse(cls, entity: Entity, parser: Parser) -> tuple[type[Blink], dict[str, Any]]:
        _, kwargs = super().parse(entity, parser)
        kwargs["times"] = entity.get_attr("times", data_type=int)
        return cls, kwargs


def instantiate(text: str) -> Action:
    root, parser = XmlParser.load(io.StringIO(text))
    return instantiate_action(root, parser)


def test_an_exposed_class_is_built_with_its_place() -> None:
    action = instantiate('\n<test-blink times="3"/>')
    assert isinstance(action, Blink) and action.times == 3
    assert action.source_location is not None
    assert (action.source_location.line, action.source_location.element) == (2, "test-blink")


def test_a_parse_function_can_be_exposed() -> None:
    @expose_action("test-blink-twice")
    def parse(entity: Entity, parser: Parser) -> tuple[type[Blink], dict[str, Any]]:
        return Blink, {"times": 2}

    action = instantiate("<test-blink-twice/>")
    assert isinstance(action, Blink) and action.times == 2


@pytest.mark.parametrize("attribute", ["if", "unless"])
def test_each_action_takes_a_condition(attribute: str) -> None:
    assert instantiate(f'<test-blink times="1" {attribute}="$(var x)"/>').condition is not None


ERRORS = {
    "unknown element": ("<nope/>", RuntimeError, "Unrecognized entity of the type: nope"),
    "unknown attribute": (
        '<test-blink times="1" colour="red"/>',
        ValueError,
        "Unexpected attribute(s) found in `test-blink`: {'colour'}",
    ),
    "unknown child": (
        '<test-blink times="1"><x/></test-blink>',
        ValueError,
        "Unexpected nested tag(s) found in `test-blink`: {'x'}",
    ),
    "missing attribute": (
        "<test-blink/>",
        AttributeError,
        "Attribute 'times' of type '<class 'int'>' not found in Entity 'test-blink'",
    ),
    "both conditions": (
        '<test-blink times="1" if="1" unless="1"/>',
        RuntimeError,
        "if and unless conditions can't be used simultaneously",
    ),
}


@pytest.mark.parametrize(("text", "error", "message"), ERRORS.values(), ids=ERRORS.keys())
def test_errors_have_upstreams_type_and_text_and_a_place(
    text: str, error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        instantiate("\n" + text)
    assert str(caught.value) == message
    place = location_of(caught.value)
    assert place is not None and place.line == 2


def test_a_bad_template_is_placed_at_its_own_element() -> None:
    with pytest.raises(ValueError, match="No terminal matches") as caught:
        instantiate('<node\n pkg="p" exec="e">\n\n<remap from="$(b )" to="c"/></node>')
    place = location_of(caught.value)
    assert place is not None and (place.line, place.element) == (4, "remap")


def test_a_class_needs_a_parse_method() -> None:
    with pytest.raises(RuntimeError, match="Did not find a class method called 'parse'"):

        @expose_action("test-no-parse")
        class NoParse:
            pass


def test_only_classes_and_functions_can_be_exposed() -> None:
    with pytest.raises(RuntimeError, match="is not a callable or a class containing a parse method"):
        expose_action("test-number")(1)


def test_two_methods_for_one_name_are_refused() -> None:
    with pytest.raises(RuntimeError, match=r"Two action parsing methods .* same name: \[test-blink\]"):

        @expose_action("test-blink")
        def parse(entity: Entity, parser: Parser) -> tuple[type[Blink], dict[str, Any]]:
            return Blink, {"times": 2}


def test_loading_all_extensions_registers_every_element() -> None:
    FrontEnd.load_launch_extensions()
    assert {"arg", "group", "include", "node", "node_container", "timer"} <= set(action_parse_methods)
