"""Calls that lead to no interface need not run: what they may have changed is not known afterwards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from enclave_addons.inference.cpp.reading.declarations import Function
from enclave_addons.inference.cpp.running import left_out
from enclave_addons.inference.cpp.running.machine import Machine
from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

MEMBERS = 'std::string topic = "a"; double sum = 0; std::vector<std::string> list = {"a"};'
MAKES = "create_publisher<std_msgs::msg::String>(topic, 1);"


@pytest.fixture(autouse=True)
def every_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small functions are left out, too."""
    monkeypatch.setattr("enclave_addons.inference.cpp.running.left_out.LEAST_SIZE", 0)


def with_method(method: str, body: str) -> str:
    return in_class(body, f"{MEMBERS} {method}")


def calls_left_out(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the list that the names of functions whose calls are left out are added to."""
    names: list[str] = []

    def leave_out(run: Machine, function: Function, *rest: Any) -> bool:
        is_left_out = left_out.leave_out(run, function, *rest)
        names.extend([function.name] if is_left_out else [])
        return is_left_out

    monkeypatch.setattr("enclave_addons.inference.cpp.running.invocation.leave_out", leave_out)
    return names


def test_a_name_stays_exact_behind_a_call_that_does_not_change_it(tmp_path: Path) -> None:
    system = infer(tmp_path, with_method("void compute() { sum = sum + 1; }", f"compute(); {MAKES}"))
    assert (names(system), gaps(system)) == (["a"], [])


WRITES = {
    "the member": 'topic = "b";',
    "through a reference": 'auto & other = topic; other = "b";',
    "through a pointer": 'std::string * other = &topic; *other = "b";',
    "by a method": 'topic.append("b");',
    "in a function it calls": "further();",
    "in a closure": 'auto set = [this]() { topic = "b"; }; set();',
}


@pytest.mark.parametrize("body", WRITES.values(), ids=WRITES)
def test_a_name_that_the_call_may_change_is_never_taken_for_the_earlier_one(
    body: str, tmp_path: Path
) -> None:
    methods = f'void further() {{ topic = "b"; }} void change() {{ {body} }}'
    system = infer(tmp_path, with_method(methods, f"change(); {MAKES}"))
    assert names(system) != ["a"] or gaps(system)


def test_what_a_call_writes_behind_const_is_never_taken_for_the_earlier_one(tmp_path: Path) -> None:
    force = 'void force(const std::string & s) { const_cast<std::string &>(s) = "b"; }'
    system = infer(tmp_path, with_method(force, f"force(topic); {MAKES}"))
    assert names(system) != ["a"] or gaps(system)


def test_what_a_closure_writes_that_an_algorithm_runs_is_not_known_afterwards(tmp_path: Path) -> None:
    change = 'void change() { std::for_each(list.begin(), list.end(), [this](auto &) { topic = "b"; }); }'
    system = infer(tmp_path, with_method(change, f"change(); {MAKES}"))
    assert names(system) != ["a"] or gaps(system)


def test_what_a_pointer_of_an_object_may_lead_to_is_never_taken_for_unchanged(tmp_path: Path) -> None:
    members = "int count = 0; struct Box { int * number; }; Box box;"
    methods = f"{members} void change() {{ *box.number = 1; }}"
    body = f"box.number = &count; change(); if (count == 1) {{ {MAKES} }}"
    system = infer(tmp_path, with_method(methods, body))
    assert names(system) == ["a"] or gaps(system)


def test_nothing_follows_a_call_that_throws_at_its_end(tmp_path: Path) -> None:
    fail = 'void fail() { sum = sum + 1; throw std::runtime_error("no"); }'
    system = infer(
        tmp_path, with_method(fail, f'{MAKES} fail(); create_publisher<std_msgs::msg::String>("b", 1);')
    )
    assert names(system) == ["a"]


def test_a_node_that_a_callback_makes_is_found_though_it_has_no_interface(tmp_path: Path) -> None:
    members = "std::shared_ptr<rclcpp::Node> helper;"
    tick = 'void tick() { helper = std::make_shared<rclcpp::Node>("helper"); }'
    system = infer(tmp_path, with_method(f"{members} {tick}", LATER))
    assert "helper" in {node.name for node in system.nodes} or gaps(system)


def test_what_an_argument_holds_afterwards_is_not_the_earlier_value_either(tmp_path: Path) -> None:
    body = f"change(topic); {MAKES}"
    system = infer(tmp_path, with_method('void change(std::string & x) { x = "b"; }', body))
    assert names(system) != ["a"] or gaps(system)


LATER = "create_wall_timer(std::chrono::seconds(1), [this]() { tick(); });"


def test_a_node_that_a_callback_gives_to_unknown_code_is_a_gap(tmp_path: Path) -> None:
    tick = "void tick() { foo::attach(shared_from_this()); }"
    told = gaps(infer(tmp_path, with_method(tick, LATER)))
    assert any(each.startswith("the node is handed to foo::attach()") for each in told)


def test_one_that_it_gives_to_a_function_of_the_program_is_none(tmp_path: Path) -> None:
    before = "void attach(std::shared_ptr<rclcpp::Node>) {}"
    tick = "void tick() { attach(shared_from_this()); }"
    system = infer(tmp_path, in_class(LATER, f"{MEMBERS} {tick}", before=before))
    assert gaps(system) == []


def test_a_call_that_changes_nothing_of_a_name_is_left_out_beside_a_split_if_and_an_own_init(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind ``#endif`` the parser takes ``else`` for a type; ``init`` is this class's own, not rclcpp's."""
    left = calls_left_out(monkeypatch)
    methods = """
    void init(bool twice) { sum = twice ? 2 : 1; }
    void compute() {
      init(true);
    #ifndef SLOW
      if (sum > 1) { sum = 3; }
    #endif
      else if (sum > 0) { sum = 2; }
    #ifndef SLOW
      else { sum = sum + 1; }
    #endif
    }
    """
    system = infer(tmp_path, with_method(methods, f"compute(); {MAKES}"))
    assert (names(system), gaps(system), left) == (["a"], [], ["compute"])


@pytest.mark.parametrize(
    ("result", "is_left_out"), [("status_t", True), ("Mode", True), ("int", True), ("Text", False)]
)
def test_a_call_is_left_out_where_its_result_is_a_number_by_whatever_name(
    result: str, is_left_out: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = calls_left_out(monkeypatch)
    types = "typedef uint32_t status_t; enum Mode { SLOW, FAST }; using Text = std::string;"
    method = f"{types} {result} compute() {{ sum = 1; return {result}(); }}"
    system = infer(tmp_path, with_method(method, f"auto found = compute(); {MAKES}"))
    assert (names(system), gaps(system), left) == (["a"], [], ["compute"] if is_left_out else [])


OTHER = 'struct Other { std::string topic; void change() { topic = "b"; } };'


def test_a_member_of_another_class_with_the_same_name_is_another_variable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = calls_left_out(monkeypatch)
    system = infer(tmp_path, in_class(f"other.change(); {MAKES}", f"{MEMBERS} Other other;", before=OTHER))
    assert (names(system), gaps(system), left) == (["a"], [], ["change"])


@pytest.mark.parametrize(
    "other",
    [
        'struct Other { template<class N> void change(N & node) { node.topic = "b"; } };',
        'struct Other { std::string & topic; void change() { topic = "b"; } };',
        'struct Other { void change(std::string & topic) { topic = "b"; } };',
    ],
    ids=["of its argument", "through a reference", "that it is given"],
)
def test_it_is_the_same_where_another_class_writes_to_the_members_object(other: str, tmp_path: Path) -> None:
    arguments = "*this" if "node" in other else "topic" if "(std::" in other else ""
    body = f"Other other{'{topic}' if not arguments else ''}; other.change({arguments}); {MAKES}"
    system = infer(tmp_path, in_class(body, MEMBERS, before=other))
    assert names(system) != ["a"] or gaps(system)


def test_it_is_the_same_where_a_base_writes_to_its_own_member(tmp_path: Path) -> None:
    base = 'struct Base { std::string base_topic = "a"; void change() { base_topic = "b"; } };'
    derived = "struct Derived : public Base { std::string get() { return base_topic; } };"
    body = "Derived d; d.change(); create_publisher<std_msgs::msg::String>(d.get(), 1);"
    system = infer(tmp_path, in_class(body, MEMBERS, before=f"{base} {derived}"))
    assert names(system) != ["a"] or gaps(system)


@pytest.mark.parametrize(
    ("turn", "is_left_out"),
    [
        ("sum += it->size();", True),
        ('*it = "b";', False),
        ('auto & s = *it; s = "b";', False),
        ("further(*it);", False),
    ],
)
def test_an_iterator_that_moves_on_changes_no_element(
    turn: str, is_left_out: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = calls_left_out(monkeypatch)
    methods = f"""
    void further(std::string & s) {{ s = "b"; }}
    void change() {{ for (auto it = list.begin(); it != list.end(); ++it) {{ {turn} }} }}
    """
    body = "change(); for (const auto & each : list) { create_publisher<std_msgs::msg::String>(each, 1); }"
    system = infer(tmp_path, with_method(methods, body))
    if is_left_out:
        assert (names(system), gaps(system), left) == (["a"], [], ["change"])
    else:
        assert names(system) != ["a"] or gaps(system)


def test_an_overload_with_fewer_parameters_is_not_the_one_that_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = calls_left_out(monkeypatch)
    methods = """
    void find(std::string & s) { s = "b"; }
    bool find(const std::string & s, int count) { return count > 0; }
    void compute() { sum = find(topic, 1) ? 1 : 2; }
    """
    system = infer(tmp_path, with_method(methods, f"compute(); {MAKES}"))
    assert (names(system), gaps(system), left) == (["a"], [], ["compute"])
    system = infer(
        tmp_path, with_method(methods.replace("find(topic, 1) ?", "find(topic), 1 ?"), f"compute(); {MAKES}")
    )
    assert names(system) != ["a"] or gaps(system)


@pytest.mark.parametrize("read_before", [True, False])
@pytest.mark.parametrize(
    ("before", "name"),
    [
        ('std::string shared = "a";', "shared"),
        ('namespace x { static std::string shared = "a"; } using namespace x;', "shared"),
        ('struct S { static std::string shared; }; std::string S::shared = "a";', "S::shared"),
    ],
    ids=["a global", "in a namespace", "a static member"],
)
def test_what_is_written_outside_of_objects_is_never_taken_for_the_earlier_value(
    before: str, name: str, read_before: bool, tmp_path: Path
) -> None:
    method = f'void change() {{ {name} = "b"; }}'
    reads = f"auto length = {name}.size();" if read_before else ""
    body = f"{reads} change(); create_publisher<std_msgs::msg::String>({name}, 1);"
    system = infer(tmp_path, in_class(body, f"{MEMBERS} {method}", before=before))
    assert names(system) != ["a"] or gaps(system)


PUB = "create_publisher<std_msgs::msg::String>({}, 1);"
NOT_BY_NAME = {
    "by a pointer to a member": (
        "", 'void go(std::string Self::* m) { this->*m = "b"; }', "go(&Self::topic);", "topic",
    ),
    "by an operator": (
        "struct C { std::string t = \"a\"; C & operator<<(const char * x) { t = x; return *this; } };",
        'C c; void go() { c << "b"; }', "go();", "c.t",
    ),
    "to a static variable of a function": (
        'std::string & kept() { static std::string s = "a"; return s; }',
        'void go() { kept() = "b"; }', "go();", "kept()",
    ),
    "to an object that a static method gives": (
        'struct G { std::string t = "a"; static G & get() { static G g; return g; } };',
        'void go() { G::get().t = "b"; }', "go();", "G::get().t",
    ),
    "to a default argument": (
        'std::string g = "a"; void set(std::string & s = g) { s = "b"; }', "", "set();", "g",
    ),
    "by a method of what an iterator shows": (
        'struct C { std::string t = "a"; void up() { t = "b"; } };',
        "std::vector<C> l{C{}}; void go() { for (auto it = l.begin(); it != l.end(); ++it) { it->up(); } }", "go();",
        "l[0].t",
    ),
    "through an iterator that a method gives": (
        "", 'std::vector<std::string>::iterator first() { return list.begin(); } void go() { *first() = "b"; }',
        "go();", "list[0]",
    ),
}  # fmt: skip


@pytest.mark.parametrize("size", [0, 3_000], ids=["left out", "run"])
@pytest.mark.parametrize(("before", "members", "body", "name"), NOT_BY_NAME.values(), ids=NOT_BY_NAME)
def test_a_write_that_no_name_tells_is_never_overlooked(
    before: str,
    members: str,
    body: str,
    name: str,
    size: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.running.left_out.LEAST_SIZE", size)
    source = in_class(body + PUB.format(name), f"{MEMBERS} {members}", before=before).replace("Self", "Demo")
    system = infer(tmp_path, source)
    assert names(system) != ["a"] or gaps(system)


def test_a_callback_follows_a_static_method_of_a_class_that_nobody_makes(tmp_path: Path) -> None:
    made = PUB.format('"late"')
    before = f"struct Helper {{ static void make(rclcpp::Node * n) {{ n->{made} }} }};"
    members = "void tick() { more(); } void more() { Helper::make(this); }"
    system = infer(tmp_path, in_class(LATER, f"{MEMBERS} {members}", before=before))
    assert (names(system), gaps(system)) == (["late"], [])


POINTER = "std::vector<int> * cells = nullptr; int count = 1;"
BESIDE = {
    "a class of messages is not a class of the program with the same last name": (
        "namespace own { namespace msg { struct Odom { Odom(rclcpp::Node * n) { "
        "n->create_publisher<std_msgs::msg::String>(\"o\", 1); } }; } }",
        "void go() { nav_msgs::msg::Path msg; sum = msg.x; }", "go();",
        "void go() { own::msg::Odom msg(this); }",
    ),
    "a method that is called abort does not end the program": (
        "std::shared_ptr<rclcpp_action::ServerGoalHandle<int>> goal;", "void go() { goal->abort(); sum = 1; }", "go();",
        'void go() { topic = "b"; }',
    ),
    "the own method abort() does not end the program": (
        "", "void abort() { sum = 2; } void go() { abort(); sum = 1; }", "go();",
        "void go() { abort(); sum = 1; } void abort() { topic = \"b\"; }",
    ),
    "a pointer that is only set to what new makes leads to no variable": (
        "", f"{POINTER} void make() {{ cells = new std::vector<int>(); }} void go() {{ cells->push_back(1); }}",
        "make(); go();",
        f"{POINTER} std::vector<int> own; void go() {{ cells = &own; cells->push_back(1); add(); }}"
        "void add() { if (!own.empty()) { topic = \"b\"; } }",
    ),
    "a member of the class of a parameter is not a member of another class with the same name": (
        'struct Other { std::string topic; }; void fill(Other & x) { x.topic = "b"; }',
        "Other other; void go() { fill(other); }", "go();",
        'void go() { fill(*this); } template<class N> void fill(N & x) { x.topic = "b"; }',
    ),
    "returned numbers are not part of a name": (
        "", "std::vector<std::pair<int, double>> go() { sum = 1; return {}; }", "auto found = go();",
        'std::vector<int> go() { topic = "b"; return {}; }',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("before", "members", "body", "neighbour"), BESIDE.values(), ids=BESIDE)
def test_a_call_is_left_out_but_for_its_neighbour(
    before: str,
    members: str,
    body: str,
    neighbour: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left = calls_left_out(monkeypatch)
    system = infer(tmp_path, in_class(body + MAKES, f"{MEMBERS} {members}", before=before))
    assert (names(system), gaps(system), "go" in left) == (["a"], [], True)
    source = in_class(f"{body.removeprefix('make();')} {MAKES}", f"{MEMBERS} {neighbour}", before=before)
    other = infer(tmp_path / "neighbour", source)
    assert names(other) != ["a"] or gaps(other)


@pytest.mark.parametrize(
    "set_it",
    [
        "number = &count; *number = 2;",
        "auto & slot = number; slot = &count; *number = 2;",
        "std::swap(number, other); *number = 2;",
        "point(number, count); *number = 2;",
    ],
)
def test_a_pointer_that_is_set_to_a_variable_leads_to_it(set_it: str, tmp_path: Path) -> None:
    members = "int count = 1; int * number = nullptr; int * other = &count;"
    methods = f"void point(int * & p, int & n) {{ p = &n; }} void change() {{ {set_it} }}"
    body = f"change(); if (count == 1) {{ {MAKES} }}"
    system = infer(tmp_path, with_method(f"{members} {methods}", body))
    assert names(system) != ["a"] or gaps(system)


def test_a_closure_that_compares_elements_is_none_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = calls_left_out(monkeypatch)
    go = 'void tidy() { list.remove_if([](const std::string & s) { return s == "a"; }); }'
    members = f"{MEMBERS.replace('std::vector', 'std::list')} {go} void go() {{ sum = list.size(); }}"
    system = infer(tmp_path, in_class(f"tidy(); go(); {MAKES}", members))
    assert (names(system), gaps(system), "go" in left) == (["a"], [], True)


def test_a_function_of_many_lines_that_gives_a_number_may_change_a_global(tmp_path: Path) -> None:
    """It was taken for one that only computes."""
    lines = "if (n > 1) { n = n * 2; } else { n = n + 1; } " * 10
    compute = f'static bool compute(int n) {{ {lines} topic += "b"; return n > 1; }}\n'
    before = f'std::string topic = "a";\n{compute}'
    system = infer(tmp_path, in_class(f"if (compute(1)) {{ }} {MAKES}", before=before))
    assert (names(system), gaps(system)) == (["ab"], [])
