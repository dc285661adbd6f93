"""Threads, callbacks and closures of unknown code run while the program goes on: what they write and find."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import HEAD, gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

S = "std_msgs::msg::String"


def test_what_a_thread_writes_may_be_there_or_not(tmp_path: Path) -> None:
    start = 'std::string t = "x"; std::string u = "u"; std::thread w([&]() { t = "a"; });'
    made = "".join(f"create_publisher<std_msgs::msg::String>({each}, 1);" for each in "tu")
    assert names(infer(tmp_path, in_class(start + made))) == ["?", "u"]


@pytest.mark.parametrize(
    ("call", "made"),
    [("boost::for_each(w, {});", ["?"]), ("rclcpp::create_timer(this, get_clock(), 1s, {});", ["a"])],
    ids=["somebody unknown", "a timer"],
)
def test_a_closure_may_run_at_once_unless_a_timer_keeps_it(
    call: str, made: list[str], tmp_path: Path
) -> None:
    closure = '[&](auto...) { t = "b"; }'
    use = f'std::string t = "a"; {call.format(closure)} create_publisher<std_msgs::msg::String>(t, 1);'
    assert names(infer(tmp_path, in_class(use))) == made


AS_OTHERS_FIND_IT = {
    "a variable that is changed back behind spin": f"""
bool late = false;
int main() {{ auto n = std::make_shared<rclcpp::Node>("n");
  auto t = n->create_wall_timer(1s, [&] {{ if (late) {{ n->create_publisher<{S}>("seen", 1); }} }});
  late = true; rclcpp::spin(n); late = false; }}""",
    "a member between two calls of an executor": f"""
struct D : rclcpp::Node {{
  D() : Node("n") {{ t = create_wall_timer(1s, [this] {{ go(); }}); }}
  void go() {{ if (mode == "b") {{ create_publisher<{S}>("seen", 1); }} }}
  std::string mode = "a"; rclcpp::TimerBase::SharedPtr t; }};
int main() {{ auto n = std::make_shared<D>(); rclcpp::executors::SingleThreadedExecutor e; e.add_node(n);
  n->mode = "b"; e.spin_some(); n->mode = "c"; e.spin(); }}""",
    "a variable that one callback changes back behind a wait of its own": f"""
struct D : rclcpp::Node {{
  D() : Node("n") {{
    a = create_wall_timer(1s, [this] {{ late = true; rclcpp::spin_until_future_complete(other, f); late = false; }});
    b = create_wall_timer(1s, [this] {{ if (late) {{ create_publisher<{S}>("seen", 1); }} }}); }}
  bool late = false; rclcpp::TimerBase::SharedPtr a, b; rclcpp::Node::SharedPtr other; std::shared_future<int> f; }};
int main() {{ rclcpp::spin(std::make_shared<D>()); }}""",
    **{
        f"a variable while {what} runs others": f"""
int main() {{ auto n = std::make_shared<rclcpp::Node>("n"); bool late = false; {before}
  auto t = n->create_wall_timer(1s, [&] {{ if (late) {{ n->create_publisher<{S}>("seen", 1); }} }});
  late = true; {call} late = false; }}"""
        for what, before, call in (
            ("a timer", "", "t->execute_callback(nullptr);"),
            ("a subscription", 'auto s = n->create_subscription<X>("s", 1, f);', "s->handle_message(m, i);"),
            ("a parameter client", "rclcpp::SyncParametersClient c(n);", 'c.get_parameters({"x"});'),
        )
    },
    "a name while a thread runs": f"""
int main() {{ auto n = std::make_shared<rclcpp::Node>("n"); std::string name = "first";
  std::thread t([&] {{ n->create_publisher<{S}>(name, 1); }}); name = "seen"; t.join(); name = "last"; }}""",
}


@pytest.mark.parametrize("source", AS_OTHERS_FIND_IT.values(), ids=AS_OTHERS_FIND_IT)
def test_what_runs_beside_the_program_finds_every_value_of_that_time(source: str, tmp_path: Path) -> None:
    assert "seen" in names(infer(tmp_path, HEAD + source))


def test_what_was_before_spin_is_not_seen_by_a_callback(tmp_path: Path) -> None:
    source = AS_OTHERS_FIND_IT["a variable that is changed back behind spin"].replace(
        "late = true; rclcpp::spin(n); late = false;", "late = true; late = false; rclcpp::spin(n);"
    )
    assert names(infer(tmp_path, HEAD + source)) == []


def test_unknown_code_may_run_the_callbacks_that_are_there_already(tmp_path: Path) -> None:
    make = f"create_wall_timer(1s, [this]() {{ create_publisher<{S}>(name, 1); }});"
    body = f'{make} name = "b"; acme::poll(); name = "c";'
    source = in_class(body, 'std::string name = "a";').replace(
        "rclcpp::spin(std::make_shared<Demo>());", "auto d = std::make_shared<Demo>(); rclcpp::spin(d);"
    )
    assert names(infer(tmp_path / "unknown", source)) == ["b", "c"]
    assert names(infer(tmp_path / "alone", source.replace("acme::poll();", ""))) == ["c"]


def test_a_name_that_changes_with_the_state_of_a_machine_is_open(tmp_path: Path) -> None:
    """Nobody knows which value of the one variable goes with which of the other."""
    step = (
        f'if (state == 0) {{ name = "b"; state = 1; }} else {{ create_publisher<{S}>(name, 1); name = "c"; }}'
    )
    members = 'int state = 0; std::string name = "a";'
    made = infer(tmp_path / "state", in_class(f"create_wall_timer(1s, [this]() {{ {step} }});", members))
    assert names(made) == ["?"]
    always = f'create_publisher<{S}>(name, 1); name = "b";'
    made = infer(tmp_path / "any", in_class(f"create_wall_timer(1s, [this]() {{ {always} }});", members))
    assert names(made) == ["a", "b"]


@pytest.mark.parametrize(
    ("thread", "made"),
    [("std::thread t(std::bind(&App::run, this));", ["?"]), ("", ["a"])],
    ids=["a function that spins in a thread", "no thread"],
)
def test_a_loop_that_never_waits_sees_what_callbacks_change(
    thread: str, made: list[str], tmp_path: Path
) -> None:
    source = f"""{HEAD}
class App : public rclcpp::Node {{ public: App() : Node("n") {{
    s_ = create_subscription<{S}>("s", 1, [this](const {S} & m) {{ topic_ = m.data; }}); }}
  void run() {{ rclcpp::executors::SingleThreadedExecutor e; e.add_node(shared_from_this()); e.spin(); }}
  void go() {{ {thread} for (int i = 0; i < 9; i++) {{ if (i == 8) {{ create_publisher<{S}>(topic_, 1); }} }} }}
  std::string topic_ = "a"; rclcpp::Subscription<{S}>::SharedPtr s_; }};
int main(int argc, char ** argv) {{ rclcpp::init(argc, argv); std::make_shared<App>()->go(); }}
"""
    assert set(made) <= set(names(infer(tmp_path, source)))


def test_a_callback_runs_that_calls_a_function_kept_in_a_variable(tmp_path: Path) -> None:
    driver = "struct Driver { std::function<void()> made; void poll() { made(); } };\n"
    made = f'd_.made = [this] {{ create_publisher<{S}>("late", 1); }};'
    use = f"{made} t_ = create_wall_timer(1s, [this] {{ d_.poll(); }});"
    system = infer(tmp_path, in_class(use, "Driver d_; rclcpp::TimerBase::SharedPtr t_;", driver))
    assert (names(system), gaps(system)) == (["late"], [])


def test_a_callback_that_makes_structures_in_a_loop_comes_to_an_end(tmp_path: Path) -> None:
    """Each turn makes another one of them; what the last turn left there is not what the next round begins with."""
    source = in_class(
        "create_wall_timer(std::chrono::seconds(1), [this] { tick(); });",
        "void tick() { std::vector<Point> all; for (int i = 0; i < size_; ++i) { all.push_back({given_[i], i}); }"
        ' if (last_ == 0) create_publisher<std_msgs::msg::String>("a", 1); last_ = static_cast<int>(all.size()); }'
        " std::vector<double> given_; int last_ = 0; int size_ = 360;",
        before="struct Point { double x = 0; int index = -1; };\n",
    )
    system = infer(tmp_path, source)
    assert (names(system), gaps(system)) == (["a"], [])


@pytest.mark.parametrize(
    ("behind", "made"),
    [("", ["a"]), ("n->make();", ["?", "a"])],
    ids=["nothing is made behind spin", "something is"],
)
def test_what_callbacks_changed_is_seen_behind_spin(behind: str, made: list[str], tmp_path: Path) -> None:
    source = f"""{HEAD}
struct D : rclcpp::Node {{
  D() : Node("n") {{ make(); s_ = create_subscription<{S}>("s", 1, [this](const {S} & m) {{ topic_ = m.data; }}); }}
  void make() {{ create_publisher<{S}>(topic_, 1); }}
  std::string topic_ = "a"; rclcpp::Subscription<{S}>::SharedPtr s_; }};
int main(int argc, char ** argv) {{ rclcpp::init(argc, argv); auto n = std::make_shared<D>(); rclcpp::spin(n);
  {behind} rclcpp::shutdown(); }}
"""
    assert names(infer(tmp_path, source)) == sorted([*made, "s"])
