"""Operators, hidden methods and specialisations: which is called is followed, or told."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

S = "std_msgs::msg::String"


BY_OPERATOR = {
    "an index": ("b[0];", 'int operator[](int) { t = "b"; return 1; }'),
}


@pytest.mark.parametrize(("body", "member"), BY_OPERATOR.values(), ids=BY_OPERATOR)
def test_an_operator_that_certainly_runs_is_followed(body: str, member: str, tmp_path: Path) -> None:
    use = f"B b; {body} create_publisher<std_msgs::msg::String>(b.t, 1);"
    system = infer(tmp_path, in_class(use, before=f'struct B {{ std::string t = "a"; {member} }};\n'))
    assert names(system) == ["b"]


@pytest.mark.parametrize("operator", ["operator std::string()", "explicit operator bool()"])
def test_a_conversion_that_writes_is_told_where_its_class_is_made(operator: str, tmp_path: Path) -> None:
    before = f'struct B {{ std::string t = "a"; {operator} {{ t = "b"; return {{}}; }} }};\n'
    assert gaps(infer(tmp_path, in_class("B b;", before=before))) == [
        f"{operator.removeprefix('explicit ').removesuffix('()').replace('::', '.')} of B changes something: "
        "where it runs is not followed"
    ]


def test_a_conversion_that_only_reads_is_no_gap(tmp_path: Path) -> None:
    before = 'struct B { std::string t = "a"; operator std::string() const { return t; } };\n'
    use = "B b; std::string s = b; create_publisher<std_msgs::msg::String>(b.t, 1);"
    system = infer(tmp_path, in_class(use, before=before))
    assert (names(system), gaps(system)) == (["a"], [])


@pytest.mark.parametrize("held", ["auto p = std::make_shared<B>();", "B * p = new B();"])
def test_a_pointer_in_a_condition_is_not_what_its_object_converts_to(held: str, tmp_path: Path) -> None:
    use = f'{held} if (p) {{ create_publisher<std_msgs::msg::String>("a", 1); }}'
    before = "struct B { explicit operator bool() const { return false; } };\n"
    assert names(infer(tmp_path, in_class(use, before=before))) == ["a"]


OWN_SIGNS = {
    "the address": ("P * operator&() {{ {} return nullptr; }}", "&p;"),
}


@pytest.mark.parametrize(("operator", "use"), OWN_SIGNS.values(), ids=OWN_SIGNS)
def test_an_operator_of_the_program_runs(operator: str, use: str, tmp_path: Path) -> None:
    body = operator.format(f'n->create_publisher<{S}>("made", 1);')
    before = f"struct P {{ rclcpp::Node * n; {body} }};\n"
    assert names(infer(tmp_path, in_class(f"P p{{this}}; P q{{this}}; {use}", before=before))) == ["made"]
    assert names(infer(tmp_path / "b", in_class("P p{this}; P q{this};", before=before))) == []


@pytest.mark.parametrize("name", ["operator==(const P &) const", "operator<=>(int) const", "operator,(int)"])
def test_an_operator_whose_calls_are_not_followed_is_told_if_it_makes_something(
    name: str, tmp_path: Path
) -> None:
    before = f'struct P {{ rclcpp::Node * n; bool {name} {{ n->create_publisher<{S}>("made", 1); return true; }} }};\n'
    why = f"{name.partition('(')[0]} of P changes something: where it runs is not followed"
    assert why in gaps(infer(tmp_path, in_class("P p{this};", before=before)))


CONSTANT = "bool operator==(const C & other) const"


@pytest.mark.parametrize(
    ("field", "head", "is_told"),
    [
        ("char code[8];", CONSTANT, False),
        ("std::string code;", CONSTANT, False),
        ("char * code;", CONSTANT, True),  # what it points to may change
        ("mutable char code[8];", CONSTANT, True),
        ("char code[8];", "bool operator==(const C & other)", True),
        ("char code[8];", "bool operator==(C & other) const", True),
    ],
)
def test_a_comparison_that_is_const_hands_its_members_on_to_be_read(
    field: str, head: str, is_told: bool, tmp_path: Path
) -> None:
    before = f"struct C {{ {field} {head} {{ return same_text(code, other.code); }} }};\n"
    assert bool(gaps(infer(tmp_path, in_class("C c;", before=before)))) is is_told


def test_a_literal_of_the_program_is_told_if_it_makes_something(tmp_path: Path) -> None:
    before = f"""rclcpp::Node * the_node;
int operator""_topic(const char * s, size_t) {{ the_node->create_publisher<{S}>(s, 1); return 1; }}
"""
    assert gaps(infer(tmp_path, in_class('the_node = this; "a"_topic;', before=before)))


HIDING = """
struct B { std::string text() { return "base"; } std::string twice() { return text(); } };
struct D : B { std::string text() { return "derived"; } std::string own() { return text(); } };
struct V { virtual std::string text() { return "base"; } std::string twice() { return text(); } };
struct W : V { std::string text() override { return "derived"; } };
"""


CALLED = {
    "the object itself": ("D d; auto t = d.text();", "derived"),
    "a reference to its base": ("D d; B & b = d; auto t = b.text();", "base"),
    "a pointer to its base": ("std::shared_ptr<B> b = std::make_shared<D>(); auto t = b->text();", "base"),
    "a method of the base": ("D d; auto t = d.twice();", "base"),
    "a method of its own": ("D d; auto t = d.own();", "derived"),
    "a virtual one": ("std::shared_ptr<V> b = std::make_shared<W>(); auto t = b->text();", "derived"),
    "a virtual one, by a method of the base": ("W w; auto t = w.twice();", "derived"),
}


@pytest.mark.parametrize(("body", "expected"), CALLED.values(), ids=CALLED)
def test_a_method_that_hides_another_is_called_by_the_class_that_is_seen(
    body: str, expected: str, tmp_path: Path
) -> None:
    found = infer(tmp_path, in_class(f"{body} create_publisher<{S}>(t, 1);", before=HIDING))
    assert names(found) == [expected]
    assert gaps(found) == []


def test_which_hidden_method_is_called_is_told_where_the_class_that_is_seen_is_not_known(
    tmp_path: Path,
) -> None:
    body = f"D d; auto f = [](auto & b) {{ return b.text(); }}; create_publisher<{S}>(f(d), 1);"
    found = infer(tmp_path, in_class(body, before=HIDING))
    assert gaps(found) == ["D hides text of a base: which of them is called is not known"]


def test_a_text_that_a_derived_class_hides_is_told_and_a_pointer_that_it_hides_is_not(tmp_path: Path) -> None:
    def hiding(member: str) -> list[str]:
        before = f"struct B {{ {member} }};\nstruct D : B {{ {member} }};\n"
        return gaps(infer(tmp_path / str(len(member)), in_class("D d;", before=before)))

    assert hiding("std::string name;") == ["D hides name of a base: which of them is meant is not followed"]
    assert hiding("rclcpp::Node * node;") == []


def test_what_a_specialisation_gives_is_not_known(tmp_path: Path) -> None:
    before = "template <typename T> struct P { std::string text(); };\n"
    before += 'template <> std::string P<int>::text() { return "of_int"; }\n'
    source = in_class(f"create_publisher<{S}>(P<int>().text(), 1);", before=before)
    assert names(infer(tmp_path, source)) == ["?"]


TIED = {
    "that give another text": ('"kept"', ["?"]),
    "that give the same": ('"changed"', ["changed"]),
}


@pytest.mark.parametrize(("given", "made"), TIED.values(), ids=TIED)
def test_one_of_two_overloads_is_not_both(given: str, made: list[str], tmp_path: Path) -> None:
    members = f'std::string name() {{ return "changed"; }} std::string name() const {{ return {given}; }}'
    use = "create_publisher<std_msgs::msg::String>(name(), 1);"
    assert names(infer(tmp_path, in_class(use, members))) == made


SPECIAL = {
    "a text of its caller": ("void f(T, std::string & o)", 'o = "b";', "f(1, t);", ["?"]),
    "only a variable of its own": ("int f(T)", "int n = 0; n += 1; return n;", "f(1);", ["a"]),
}


@pytest.mark.parametrize(("head", "body", "use", "made"), SPECIAL.values(), ids=SPECIAL)
def test_a_specialisation_changes_what_it_is_given_and_nothing_else(
    head: str, body: str, use: str, made: list[str], tmp_path: Path
) -> None:
    special = f"template <> {head.replace('f(T', 'f<int>(int')} {{ {body} }}\n"
    before = f"template <typename T> {head} {{ {body} }}\n{special}"
    use = f'std::string t = "a"; {use} create_publisher<std_msgs::msg::String>(t, 1);'
    system = infer(tmp_path, in_class(use, before=before))
    assert (names(system), gaps(system)) == (made, [])


def test_overloads_that_all_call_each_other_are_told_where_one_runs_already(tmp_path: Path) -> None:
    """Each would run all others, which run all others: 7! of them."""
    body = "void convert(const other::K{} & k) {{ convert(k.a); convert(k.b); ++count; }}"
    member = "int count = 0; " + " ".join(map(body.format, range(7)))
    assert gaps(infer(tmp_path / "counts", in_class("convert(other::get());", member))) == []
    makes = member.replace("++count", f'create_publisher<{S}>("a", 1)', 1)
    system = infer(tmp_path / "makes", in_class("convert(other::get());", makes))
    assert names(system) == ["a"]
    assert set(gaps(system)) == {
        "which function convert is called is not known",
        "which of 7 functions convert() is called is not known",
    }
