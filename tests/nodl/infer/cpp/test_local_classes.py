"""Classes that a function defines for itself: guards, small structures, functors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.nodl.infer.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")


A = 'create_publisher<std_msgs::msg::String>("a", 1);'


def made(text: str) -> str:
    return f"create_publisher<std_msgs::msg::String>({text}, 1);"


@pytest.mark.parametrize(
    ("body", "found"),
    [
        (f"struct Guard {{ Demo * demo; ~Guard() {{ demo->done(); }} }} guard{{this}}; {A}", ["a"]),
        (f"struct Guard {{ Demo * demo; }}; Guard guard{{this}}; {A}", ["a"]),
        (f"struct Late {{ rclcpp::Node * n; ~Late() {{ n->{A} }} }} late{{this}};", ["a"]),
        (
            f"struct Maker {{ Maker(rclcpp::Node * n) {{ n->{A} }} }}; std::make_shared<Maker>(this);",
            ["a"],
        ),
        (
            f'struct Name {{ std::string text = "a"; }}; auto f = [this]() {{ Name n; {made("n.text")} }}; f();',
            ["a"],
        ),
    ],
)
def test_a_class_of_the_function_is_followed(body: str, found: list[str], tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, "void done() {}"))
    assert (names(system), gaps(system)) == (found, [])


def test_each_class_of_the_same_name_is_its_own(tmp_path: Path) -> None:
    """Two blocks, another function, a closure, and the class outside, which is back behind the block."""
    body = f"""
    {{ struct Name {{ std::string text = "first"; }} n; {made("n.text")} }}
    {{ struct Name {{ std::string text = "second"; }} n; {made("n.text")} }}
    Name outside; {made("outside.text")}
    other();
    """
    other = f"""
    void other() {{
      struct Name {{ std::string text = "other"; }} n; {made("n.text")}
      auto f = [this]() {{ struct Name {{ std::string text = "closure"; }}; Name n; {made("n.text")} }};
      f();
    }}
    """
    program = in_class(body, other, before='struct Name { std::string text = "outside"; };')
    system = infer(tmp_path, program)
    assert names(system) == ["closure", "first", "other", "outside", "second"] and not gaps(system)
