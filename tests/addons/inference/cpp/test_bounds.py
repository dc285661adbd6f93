"""What one program may take is bounded, and a program that is cut off says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

from enclave_addons.inference.cpp.running.memory import AbstractStore
from enclave_addons.inference.cpp.running.values import literal

LOOPS = (
    'for (int i = 0; i < 40; ++i) { for (int j = 0; j < 40; ++j) { last = "t" + std::to_string(i * j); } }'
)


def test_a_program_that_is_cut_off_says_so_and_tells_the_place_that_was_not_reached(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.running.machine.MAX_STEPS", 3_000)
    system = infer(
        tmp_path,
        in_class(
            'create_publisher<std_msgs::msg::String>("before", 1);' + LOOPS
            + 'create_publisher<std_msgs::msg::String>("behind", 1);',
            "std::string last;",
        ),
    )  # fmt: skip
    told = gaps(system)
    assert names(system) == ["before"]
    assert "this program is too large to be followed to its end" in told
    assert any(each.startswith("create_publisher was not followed") for each in told)


def test_one_that_comes_to_its_end_does_not(tmp_path: Path) -> None:
    system = infer(
        tmp_path,
        in_class(LOOPS + 'create_publisher<std_msgs::msg::String>("behind", 1);', "std::string last;"),
    )
    assert names(system) == ["behind"]
    assert gaps(system) == []


FLAG = "bool running = true; int turns = 0;"


def test_loops_that_only_others_end_are_not_counted_within_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.running.machine.MAX_STEPS", 20_000)
    turn = '++turns; create_publisher<std_msgs::msg::String>("a", 1);'
    nested = f"while (running) {{ while (running) {{ while (running) {{ {turn} }} }} }}"
    system = infer(tmp_path, in_class(nested + 'create_publisher<std_msgs::msg::String>("behind", 1);', FLAG))
    assert names(system) == ["a", "behind"]
    assert gaps(system) == []


def test_one_that_its_own_turns_end_is(tmp_path: Path) -> None:
    turn = 'create_publisher<std_msgs::msg::String>("t" + std::to_string(turns), 1); ++turns;'
    assigned = f"while (running) {{ {turn} running = turns < 3; }}"
    left = f"while (running) {{ {turn} if (turns == 3) {{ break; }} }}"
    assert names(infer(tmp_path / "assigned", in_class(assigned, FLAG))) == ["t0", "t1", "t2"]
    assert names(infer(tmp_path / "left", in_class(left, FLAG))) == ["t0", "t1", "t2"]


def test_long_looks_back_at_what_was_written_count_as_steps_and_short_ones_do_not() -> None:
    spent: list[int] = []
    store = AbstractStore(spent.append)
    for number in range(640):
        store.set(("object", str(number)), literal("x"))
    store.changes(630)
    store.changes(0)
    assert spent == [0, 10]


def test_a_template_that_is_only_declared_may_be_any_of_its_specialisations(tmp_path: Path) -> None:
    before = """template<typename T> void make(rclcpp::Node * n);
template<> void make<int>(rclcpp::Node * n) { n->create_publisher<std_msgs::msg::String>("number", 1); }
"""
    assert names(infer(tmp_path, in_class("make<Other>(this);", before=before))) == ["number"]
    assert names(infer(tmp_path, in_class("make<int>(this);", before=before))) == ["number"]


GROWING = {
    "a text": ('std::string s = "x";', "s += s;", "s"),
    "a text by a method": ('std::string s = "x";', "s.append(s);", "s"),
    "a list": (
        'std::vector<std::string> s{"x"};',
        "s.insert(s.end(), s.begin(), s.end()); s[0] += s.back();",
        "s[0]",
    ),
    "a pair of pairs": ('auto s = std::make_pair("x", "y");', "s = std::make_pair(s, s);", "s.first"),
    "a number": ("double s = 1e300; int i = 0;", "s = s * s; i = s;", "std::to_string(i)"),
}


@pytest.mark.parametrize(("start", "step", "name"), GROWING.values(), ids=GROWING)
def test_a_value_that_grows_without_end_is_not_known(
    start: str, step: str, name: str, tmp_path: Path
) -> None:
    body = f"{start} for (int n = 0; n < 60; ++n) {{ {step} }} create_publisher<std_msgs::msg::String>({name}, 1);"
    system = infer(tmp_path, in_class(body))
    assert all("?" in made for made in names(system)) or gaps(system)


def test_classes_that_are_bases_of_each_other_are_told(tmp_path: Path) -> None:
    before = "class A : public B {}; class B : public A {};\n"
    system = infer(tmp_path, in_class('A a; create_publisher<std_msgs::msg::String>("a", 1);', before=before))
    assert names(system) == ["a"]
    assert any("deeper than is followed" in why for why in gaps(system))


BROKEN = (
    "enclave_addons.inference.cpp.program._start",
    "enclave_addons.inference.cpp.program.run_callbacks",
    "enclave_addons.inference.cpp.program.account",
    "enclave_addons.inference.cpp.program.Names",
    "enclave_addons.inference.cpp.program.index_file",
    "enclave_addons.inference.cpp.program.preprocess",
    "enclave_addons.inference.cpp.solved.interfaces_of",
    "enclave_addons.inference.cpp.system.programs",
    "enclave_addons.inference.cpp.reading.project.read_build",
)


@pytest.mark.parametrize("error", [StopIteration, RecursionError, MemoryError, KeyError])
@pytest.mark.parametrize("place", BROKEN)
def test_a_mistake_of_the_analysis_is_a_gap_of_the_program(
    place: str, error: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*args: object, **named: object) -> object:
        raise error("a mistake of ours")

    monkeypatch.setattr(place, broken)
    told = gaps(infer(tmp_path, in_class('create_publisher<std_msgs::msg::String>("a", 1);')))
    assert any(error.__name__ in why and "report this line" in why for why in told)
