"""What one program may take is bounded, and a program that is cut off says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import HEAD, gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

LOOPS = (
    'for (int i = 0; i < 40; ++i) { for (int j = 0; j < 40; ++j) { last = "t" + std::to_string(i * j); } }'
)
PUB = "create_publisher<std_msgs::msg::String>"
BEHIND = in_class(f'{PUB}("before", 1);{LOOPS}{PUB}("behind", 1);', "std::string last;")


def test_a_program_that_is_cut_off_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.engine.machine.MAX_STEPS", 3_000)
    system = infer(tmp_path, BEHIND)
    assert names(system) == ["before"]
    assert any(why.startswith("this program was given up after") for why in gaps(system))


def test_one_that_comes_to_its_end_does_not(tmp_path: Path) -> None:
    system = infer(tmp_path, BEHIND)
    assert names(system) == ["before", "behind"]
    assert gaps(system) == []


def test_a_method_is_not_followed_for_its_name_that_makes_interfaces_in_another_class(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``update`` of the sensor makes interfaces, that of the grid, which takes long, does not."""
    monkeypatch.setattr("enclave_addons.inference.cpp.engine.machine.MAX_STEPS", 12_000)
    monkeypatch.setattr("enclave_addons.inference.cpp.engine.invocation.ALLOWANCE", 1_000)
    classes = f"""
struct Sensor {{ void update(rclcpp::Node * node) {{ node->{PUB}("sensor", 1); }} }};
struct Grid {{ std::string last; void update(int) {{ {LOOPS} {LOOPS} {LOOPS} {LOOPS} }} }};
"""
    made = (
        f'sensor_ = std::make_unique<Sensor>(); grid_.update(1); sensor_->update(this); {PUB}("behind", 1);'
    )
    system = infer(tmp_path, in_class(made, "Grid grid_; std::unique_ptr<Sensor> sensor_;", classes))
    assert names(system) == ["behind", "sensor"]
    assert gaps(system) == []


def test_a_callback_that_a_class_of_the_program_keeps_is_run_when_that_class_calls_it(tmp_path: Path) -> None:
    classes = """
struct Server {
  std::function<void()> execute_;
  rclcpp::TimerBase::SharedPtr timer_;
  Server(rclcpp::Node * node, std::function<void()> execute) : execute_(execute) {
    timer_ = node->create_wall_timer(std::chrono::seconds(1), std::bind(&Server::work, this));
  }
  void work() { execute_(); }
};
"""
    kept = "std::shared_ptr<Server> server_;"
    body = "server_ = std::make_shared<Server>(this, std::bind(&Demo::follow, this));"
    method = f'void follow() {{ {PUB}("late", 1); }}'
    system = infer(tmp_path, in_class(body, f"{method} {kept}", classes))
    assert names(system) == ["late"]
    assert gaps(system) == []


def test_a_callback_that_nothing_is_seen_to_call_is_a_gap(tmp_path: Path) -> None:
    classes = """
struct Server {
  void (*execute_)(rclcpp::Node *);
  explicit Server(void (*execute)(rclcpp::Node *)) : execute_(execute) {}
};
"""
    function = f'struct Late {{ static void make(rclcpp::Node * node) {{ node->{PUB}("late", 1); }} }};'
    body = "server_ = std::make_shared<Server>(&Late::make);"
    system = infer(tmp_path, in_class(body, "std::shared_ptr<Server> server_;", classes + function))
    assert names(system) == []
    assert any("Late::make" in why for why in gaps(system))


def doubling(call: str, first: str) -> str:
    """Functions of which each calls the one before it twice: 2^40 calls."""
    functions = "".join(
        f"std::string f{n}(std::string t) {{ {call.format(before=f'f{n - 1}')} }}\n" for n in range(1, 41)
    )
    return (
        HEAD
        + f"""struct Calls {{
  rclcpp::Node * node;
  std::string f0(std::string t) {{ {first} return t; }}
  {functions}}};
int main(int argc, char ** argv) {{
  rclcpp::init(argc, argv);
  auto node = std::make_shared<rclcpp::Node>("n");
  Calls calls{{node.get()}};
  node->{PUB}(calls.f40("x"), 1);
}}
"""
    )


MADE = f'node->{PUB}("made_" + t, 1);'


@pytest.mark.parametrize("first", ["", MADE], ids=["that make nothing", "that make interfaces"])
@pytest.mark.parametrize(
    "call", ["{before}(t); return {before}(t);", '{before}(t + "a"); return {before}(t + "b");']
)
def test_calls_that_double_are_followed_in_a_counted_number_of_steps(
    call: str, first: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.engine.machine.MAX_STEPS", 60_000)
    told = infer(tmp_path, doubling(call, first))
    assert not any("too large" in why for why in gaps(told))
    assert names(told)


def test_closures_that_double_are_followed_in_a_counted_number_of_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("enclave_addons.inference.cpp.engine.machine.MAX_STEPS", 120_000)
    first = "std::function<std::string(std::string)> f0 = [](std::string t) { return t; };"
    others = "".join(
        f"auto f{n} = [g = f{n - 1}](std::string t) {{ return g(g(t)); }};" for n in range(1, 41)
    )
    told = infer(tmp_path, in_class(f'{first}{others}{PUB}(f40("x"), 1);'))
    assert not any("too large" in why for why in gaps(told))
    assert names(told) == ["?"]


GROWING = {
    "a text": ('std::string s = "x";', "s += s;", "s"),
    "a text by a method": ('std::string s = "x";', "s.append(s);", "s"),
    "a list": (
        'std::vector<std::string> s{"x"};',
        "s.insert(s.end(), s.begin(), s.end()); s[0] += s.back();",
        "s[0]",
    ),
    "a number": ("double s = 1e300; int i = 0;", "s = s * s; i = s;", "std::to_string(i)"),
}


@pytest.mark.parametrize(("start", "step", "name"), GROWING.values(), ids=GROWING)
def test_a_value_that_grows_without_end_is_not_known(
    start: str, step: str, name: str, tmp_path: Path
) -> None:
    system = infer(tmp_path, in_class(f"{start} for (int n = 0; n < 60; ++n) {{ {step} }} {PUB}({name}, 1);"))
    assert all("?" in made for made in names(system)) or gaps(system)


def test_classes_that_are_bases_of_each_other_are_read(tmp_path: Path) -> None:
    before = "class A : public B {}; class B : public A {};\n"
    assert names(infer(tmp_path, in_class(f'A a; {PUB}("a", 1);', before=before))) == ["a"]


def test_many_causes_are_one_gap_and_one_cause_has_one_gap_with_its_places(tmp_path: Path) -> None:
    unknown = "".join(f"acme::Part{n} part{n}(this);" for n in range(12))
    (told,) = gaps(infer(tmp_path / "many", in_class(unknown)))
    assert told.startswith(
        "this program is not followed: 12 places, first: the node is handed to acme::Part0"
    )
    often = "acme::Part a(this);\nacme::Part b(this);\nacme::Part c(this);"
    (told,) = gaps(infer(tmp_path / "often", in_class(often)))
    assert told.startswith("the node is handed to acme::Part, which may make interfaces on it (3 places: ")


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
    told = gaps(infer(tmp_path, in_class(f'{PUB}("a", 1);')))
    assert any(error.__name__ in why and "report this line" in why for why in told)
