"""Programs that were compiled and run: each name that a run made is listed, or there is a gap or an open name.

``KNOWN`` are the neighbours that must stay known: what is listed there is exactly what the run made.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "void pub(std::string t) { create_publisher<std_msgs::msg::String>(t, 1); }\n"
CONFIG = 'struct C { std::string t = "plain"; };\n'

EVERY_SECOND = "create_wall_timer(std::chrono::seconds(1), [this]() { %s });"

# what the constructor does, members and classes before it, what the run made
COVERED: dict[str, tuple[str, str, str, set[str]]] = {
    "a callback counts in a static variable": (
        EVERY_SECOND % 'static int n = 0; if (n++ == 3) pub("third");', "", "", {"third"},
    ),
    "a callback lengthens a static text": (
        EVERY_SECOND % 'static std::string s = "a"; pub(s); s += "b";', "", "", {"a", "ab", "abb"},
    ),
    "a member that is a pointer is set through a reference to it": (
        'C a; C *& r = c_; r = &a; c_->t = "a"; pub(a.t);', "C * c_ = nullptr;", CONFIG, {"a"},
    ),
    "a list of addresses shows what its variables hold later": (
        'std::string a = "a"; std::string * all[] = {&a}; a = "b"; for (auto * each : all) pub(*each);',
        "", "", {"b"},
    ),
    "a list that is given addresses, too": (
        'std::string a = "a"; std::vector<std::string *> all; all.push_back(&a); a = "b"; pub(*all[0]);',
        "", "", {"b"},
    ),
    "a number is no whole number alone: overloads that look alike may all be meant": (
        "long l = 2; pub(k(l)); pub(k(2));",
        'std::string k(long) { return "long_"; } std::string k(int) { return "int_"; }', "", {"long_", "int_"},
    ),
    "an object or its address": (
        "C c; pub(k(&c)); pub(k(c));", "",
        CONFIG + 'std::string k(C *) { return "pointer"; } std::string k(const C &) { return "object"; }',
        {"pointer", "object"},
    ),
    "elements are written in a loop over iterators": (
        'std::vector<std::string> v{"a"}; for (auto it = v.begin(); it != v.end(); ++it) *it += "_x";'
        "for (auto & s : v) pub(s);",
        "", "", {"a_x"},
    ),
    "each element of an array is made by its constructor": (
        'Counted all[3]; pub("n" + std::to_string(all[1].id));', "",
        "struct Counted { static inline int n = 0; int id; Counted() : id(n++) {} };", {"n1"},
    ),
    "a multimap has a key twice": (
        'std::multimap<std::string, std::string> m; m.insert({"k", "a"}); m.insert({"k", "b"});'
        "for (auto & e : m) pub(e.second);",
        "", "", {"a", "b"},
    ),
    "a fold expression writes": (
        'pub(joined(std::string("x"), std::string("y")));', "",
        "template <typename... A> std::string joined(A... a) { std::string s; ((s += a), ...); return s; }", {"xy"},
    ),
    "the program sets a parameter itself": (
        'declare_parameter<std::string>("a", "first"); set_parameter(rclcpp::Parameter("a", "second"));'
        'set_parameter({"a", "third"}); pub(get_parameter("a").as_string());',
        "", "", {"third"},
    ),
    "a text that a template writes by its own pointer operator": (
        'P p; p->t = "set"; pub(p->t); (*p).t = "again"; pub(p->t);', "",
        CONFIG + "struct P { C c; C * operator->() { return &c; } C & operator*() { return c; } };",
        {"set", "again"},
    ),
    "a reference to a pointer is that pointer, and another one is not": (
        'C a, b; C * p = &a; C *& r = p; r = &b; p->t = "b"; pub(b.t); auto & s = p; s = &a; p->t = "a"; pub(a.t);'
        'C * q = p; q = &b; p->t = "still"; pub(a.t);',
        "", CONFIG, {"b", "a", "still"},
    ),
    "a map goes by its keys": (
        'std::map<int, std::string> m{{3, "three"}, {1, "one"}}; std::string j;'
        "for (auto & e : m) j += e.second; pub(j);",
        "", "", {"onethree"},
    ),
    "an operator of the program writes to a stream": (
        'C c; std::ostringstream s; s << "a_" << c << "_b"; pub(s.str());', "",
        CONFIG + "std::ostream & operator<<(std::ostream & s, const C & c) { return s << c.t; }", {"a_plain_b"},
    ),
}  # fmt: skip

KNOWN: dict[str, tuple[str, str, str, set[str]]] = {
    "a pointer, or member that is one, shows the object that it was given later": (
        'C a, b; C * p = &a; p = &b; p->t = "b"; pub(b.t); H h; h.c = &a; h.c->t = "a"; pub(a.t);'
        'p = h.c; p->t = "again"; pub(a.t);',
        "", CONFIG + "struct H { C * c = nullptr; };", {"b", "a", "again"},
    ),
    "a class uses what its base has, too, and its own": (
        'D d; pub(d.k(1)); pub(d.k(std::string("s")));', "",
        'struct B { std::string k(int) { return "Bi"; } std::string k(const std::string & s) { return s; } };'
        'struct D : B { using B::k; std::string k(D *) { return "Dd"; } };',
        {"Bi", "s"},
    ),
    "an object within an object is assigned as a copy": (
        'O a, b; a.c.t = "a"; b = a; b.c.t = "b"; pub(a.c.t); pub(b.c.t + "_b");',
        "", CONFIG + "struct O { C c; };", {"a", "b_b"},
    ),
    "each call of a chain makes an object of its own": (
        'add("x").add("y"); for (auto & each : all_) pub(each.t);',
        "Demo & add(std::string t) { all_.push_back({t}); return *this; } std::vector<C> all_;", CONFIG,
        {"x", "y"},
    ),
    "a callback that names its successor": (
        "next_ = [this]() { t_ = \"first\"; next_ = [this]() { t_ = \"second\"; }; };"
        + EVERY_SECOND % "next_(); pub(t_);",
        'std::function<void()> next_; std::string t_ = "none";', "", {"first", "second"},
    ),
    "a class says which of two bases a name is of": (
        "D d; pub(d.k()); pub(d.A::k());", "",
        'struct A { std::string k() { return "a"; } }; struct B { std::string k() { return "b"; } };'
        "struct D : A, B { using B::k; };",
        {"b", "a"},
    ),
    "overloads that looks tell apart": (
        'pub(k(1)); pub(k(std::string("x")));',
        'std::string k(int) { return "i"; } std::string k(const std::string &) { return "s"; }',
        "", {"i", "s"},
    ),
    "a getter in two forms": (
        "pub(name()); const Demo & c = *this; pub(c.name());",
        'const std::string & name() const { return n_; } std::string & name() { return n_; } std::string n_ = "n";',
        "", {"n"},
    ),
    "of an object behind a pointer a variable has a copy": (
        'auto c = std::make_shared<C>(); auto copy = *c; c->t = "set"; pub(copy.t + "_copy"); pub(c->t);',
        "", CONFIG, {"plain_copy", "set"},
    ),
    "a text of an object before unknown code gets it": (
        "C c; pub(c.t); acme::edit(c);", "", CONFIG, {"plain"},
    ),
    "a callback makes an object of a library that knows nothing of ROS": (
        "t_ = create_wall_timer(1s, [this] { Eigen::MatrixXd m(rows_, 2); }); pub(\"b\");",
        "int rows_ = 3; rclcpp::TimerBase::SharedPtr t_;", "", {"b"},
    ),
    "a pointer declared with auto shows another object": (
        'auto p = std::make_unique<P>("a"); p.reset(new P("b")); pub(p->n);', "",
        "struct P { std::string n; explicit P(std::string s) : n(s) {} };", {"b"},
    ),
    "an object declared with auto has a reset of its own": (
        'auto p = P("a"); p.reset(); pub(p.n);', "",
        'struct P { std::string n; explicit P(std::string s) : n(s) {} void reset() { n += "_reset"; } };', {"a_reset"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("title", COVERED)
def test_what_the_run_made_is_listed_or_a_gap(title: str, tmp_path: Path) -> None:
    body, members, before, made = COVERED[title]
    system = infer(tmp_path, in_class(body, PUB + members, before))
    listed = [re.compile(re.escape(name).replace(r"\?", ".*")) for name in names(system)]
    missing = {name for name in made if not any(each.fullmatch(name) for each in listed)}
    assert not missing or gaps(system)


@pytest.mark.parametrize("title", KNOWN)
def test_what_the_run_made_is_known(title: str, tmp_path: Path) -> None:
    body, members, before, made = KNOWN[title]
    system = infer(tmp_path, in_class(body, PUB + members, before))
    assert not gaps(system)
    assert set(names(system)) == made


NODE = """#include <rclcpp/rclcpp.hpp>
std::string shared = "before";
int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  auto n = std::make_shared<rclcpp::Node>("n");
  rclcpp::executors::SingleThreadedExecutor executor;
  executor.add_node(n);
  std::string own = "before";
  %s
}
"""
LISTENS = """auto s = n->create_subscription<std_msgs::msg::String>("in", 1, [&own](std_msgs::msg::String::SharedPtr) {
    own = "after"; shared = "after"; });"""
THREAD = "std::thread t([&]() { executor.spin(); });"
WAIT = "rclcpp::sleep_for(std::chrono::seconds(1));"
SPINS = {
    "once": f"{LISTENS} rclcpp::spin_some(n);",
    "until somebody has come": f'{LISTENS} while (own == "before") {{ rclcpp::spin_some(n); }}',
    "by an executor": f"{LISTENS} executor.spin_once();",
    "in a thread": f"{LISTENS} {THREAD} {WAIT}",
    "in a thread that is there before": f"{THREAD} {LISTENS} {WAIT}",
}


def test_what_they_change_at_the_end_is_not(tmp_path: Path) -> None:
    body = f"{LISTENS} n->create_publisher<std_msgs::msg::String>(own, 1); rclcpp::spin(n);"
    assert set(names(infer(tmp_path, NODE % body))) == {"in", "before"}
