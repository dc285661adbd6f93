"""Programs that hide an interface as C++ allows: each is found or told as a gap, never passed over."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import HEAD, gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = 'create_publisher<std_msgs::msg::String>("a", 1);'
MAKE = f"static void make(rclcpp::Node * n) {{ n->{PUB} }}\n"
OF_NODE = f"struct K {{ K(rclcpp::Node * n) {{ n->{PUB} }} }};\n"
HIDDEN = {
    "in a table of functions": in_class(
        "for (auto & f : table) { f(this); }",
        before=MAKE + "static std::vector<void (*)(rclcpp::Node *)> table = {&make};\n",
    ),
    "in a map of functions": in_class(
        'std::map<std::string, std::function<void()>> m; m["x"] = [this]() { ' + PUB + ' }; m.at("x")();'
    ),
    "behind a virtual call on a base pointer": in_class(
        "std::unique_ptr<I> i = std::make_unique<Impl>(); i->go(this);",
        before="struct I { virtual void go(rclcpp::Node *) = 0; };\n"
        f"struct Impl : I {{ void go(rclcpp::Node * n) override {{ n->{PUB} }} }};\n",
    ),
    "behind a factory by name": in_class(
        'make("x")->go(this);',
        before="struct I { virtual void go(rclcpp::Node *) = 0; };\n"
        f"struct Impl : I {{ void go(rclcpp::Node * n) override {{ n->{PUB} }} }};\n"
        'std::unique_ptr<I> make(std::string k) { if (k == "x") return std::make_unique<Impl>(); return nullptr; }\n',
    ),
    "in a registry filled before main": in_class(
        "for (auto & f : registry()) { f(this); }",
        before="using F = std::function<void(rclcpp::Node *)>;\n"
        "std::vector<F> & registry() { static std::vector<F> r; return r; }\n"
        "static bool add(F f) { registry().push_back(f); return true; }\n"
        f"static bool added = add([](rclcpp::Node * n) {{ n->{PUB} }});\n",
    ),
    "in a class template's method": in_class(
        "Maker<std_msgs::msg::String> m(this); m.go();",
        before="template <typename T> struct Maker { explicit Maker(rclcpp::Node * n) : n_(n) {}\n"
        'void go() { n_->template create_publisher<T>("a", 1); } rclcpp::Node * n_; };\n',
    ),
    "by curiously recurring templates": HEAD
    + 'template <typename D> struct Base : rclcpp::Node { Base() : rclcpp::Node("n") { '
    + "static_cast<D *>(this)->init(); } };\n"
    + f"struct D : Base<D> {{ void init() {{ {PUB} }} }};\nint main() {{ D d; }}\n",
    "in an operator": in_class(
        "Maker m; m(*this);", before=f"struct Maker {{ void operator()(rclcpp::Node & n) {{ n.{PUB} }} }};\n"
    ),
    "in a destructor": in_class("", f"~Demo() {{ {PUB} }}"),
    "in a static member function": in_class(
        "Maker::go(this);", before=f"struct Maker {{ static void go(rclcpp::Node * n) {{ n->{PUB} }} }};\n"
    ),
    "in a nested lambda": in_class(f"auto f = [this]() {{ auto g = [this]() {{ {PUB} }}; g(); }}; f();"),
    "in a thread": in_class(f"std::thread t([this]() {{ {PUB} }}); t.detach();"),
    "in a thread's method": in_class(
        "t_ = std::thread(&Demo::work, this);", f"void work() {{ {PUB} }} std::thread t_;"
    ),
    "in a default argument": in_class(
        "go();",
        f"rclcpp::PublisherBase::SharedPtr made() {{ return {PUB} }}\n"
        "void go(rclcpp::PublisherBase::SharedPtr p = nullptr) { if (!p) { p = made(); } }",
    ),
    "behind a goto": in_class(f"goto there; there: {PUB}"),
    "in a switch that falls through": in_class(
        f"switch (kind()) {{ case 1: case 2: {PUB} break; default: break; }}"
    ),
    "in a catch": in_class(
        f"try {{ risky(); }} catch (const std::exception & e) {{ {PUB} }}", "void risky() {}"
    ),
    "in the condition of a loop": in_class(f"while (!{PUB[:-1]}) {{ }}"),
    "through a node in a container": HEAD
    + "int main() { std::map<std::string, rclcpp::Node::SharedPtr> nodes;\n"
    + f'nodes["n"] = std::make_shared<rclcpp::Node>("n"); for (auto & [k, n] : nodes) {{ n->{PUB} }} }}\n',
    "through a node in a structure": HEAD
    + "struct Holder { rclcpp::Node::SharedPtr node; };\n"
    + f'int main() {{ Holder h{{std::make_shared<rclcpp::Node>("n")}}; h.node->{PUB} }}\n',
    "through a node that a function gives": HEAD
    + 'rclcpp::Node::SharedPtr make_it() { return std::make_shared<rclcpp::Node>("n"); }\n'
    + f"int main() {{ make_it()->{PUB} }}\n",
    "through a singleton": HEAD
    + "struct S { static S & get() { static S s; return s; } rclcpp::Node::SharedPtr n = "
    + 'rclcpp::Node::make_shared("n"); };\n'
    + f"int main() {{ S::get().n->{PUB} }}\n",
    "by a member pointer": in_class(
        "(this->*step_)();", f"void go() {{ {PUB} }} void (Demo::*step_)() = &Demo::go;"
    ),
    "by std::invoke": in_class("std::invoke(&Demo::go, this);", f"void go() {{ {PUB} }}"),
    "by std::apply": in_class("std::apply([this](int) { " + PUB + " }, std::make_tuple(1));"),
    "by std::visit": in_class("std::variant<int> v; std::visit([this](auto) { " + PUB + " }, v);"),
    "through std::any": in_class(
        "std::any x = std::function<void()>([this]() { "
        + PUB
        + " }); std::any_cast<std::function<void()>>(x)();"
    ),
    "by a second object that is made where nobody looks": in_class(
        'a_ = std::make_shared<H>("b"); std::tie(c_, std::ignore) = acme::pair(); a_->init(this); c_->init(this);',
        "std::shared_ptr<H> a_, c_;",
        before="struct H { explicit H(std::string t) : t_(t) {} void init(rclcpp::Node * n) { "
        "n->create_publisher<std_msgs::msg::String>(t_, 1); } std::string t_; };\n",
    ),
    "by an element that a container makes": in_class(
        "fill(all_);",
        'template <typename T> void fill(std::list<T> & l) { l.emplace_back("a", this); } std::list<H> all_;',
        before="struct H { H(std::string t, rclcpp::Node * n) { "
        "n->create_publisher<std_msgs::msg::String>(t, 1); } };\n",
    ),
    "by an element of a list that is shared": in_class(
        "l_ = std::make_shared<std::list<H>>(); fill(*l_);",
        'template <typename T> void fill(std::list<T> & l) { l.emplace_back("a", this); } '
        "std::shared_ptr<std::list<H>> l_;",
        before="struct H { H(std::string t, rclcpp::Node * n) { "
        "n->create_publisher<std_msgs::msg::String>(t, 1); } };\n",
    ),
    "by an element of a type that is not known": in_class(
        "l_.emplace_back(this);",
        "std::vector<acme::Thing> l_;",
    ),
    "in the second overload": in_class(
        "go(1); go(std::string{});", f"void go(int) {{}} void go(const std::string &) {{ {PUB} }}"
    ),
    "behind an unknown macro": in_class(f"ACME_TRY({PUB[:-1]});"),
    "in an anonymous namespace": in_class(
        "go(*this);", before=f"namespace {{ void go(rclcpp::Node & n) {{ n.{PUB} }} }}\n"
    ),
    "after a comma": in_class(f"int x = 0; x++, {PUB}"),
    "in a variadic template": in_class(
        'each("a");',
        "template <typename... A> void each(A... names) { (create_publisher<std_msgs::msg::String>(names, 1), ...); }",
    ),
    "in a timer callback's state": in_class(
        "t_ = create_wall_timer(1s, [this]() { step(); });",
        f"void step() {{ if (n_++ == 3) {{ {PUB} }} }} int n_ = 0; rclcpp::TimerBase::SharedPtr t_;",
    ),
    "in an inherited constructor": HEAD
    + f"struct B : rclcpp::Node {{ B(std::string s) : Node(s) {{ {PUB} }} }};\nstruct D : B {{ using B::B; }};\n"
    + 'int main() { D d("n"); }\n',
    "by a value that stands for an object, in an option": in_class(
        "o_ = this;", "std::optional<K> o_;", OF_NODE
    ),
    "by a value that stands for an object, in a variant": in_class(
        "std::variant<int, K> v = this;", before=OF_NODE
    ),
    "by a value that stands for an object, in a pair": in_class(
        "std::pair<int, K> p(1, this);", before=OF_NODE
    ),
    "by a value that stands for an object, in a closure": in_class(
        "auto f = [this]() -> K { return {this}; }; f();", before=OF_NODE
    ),
    "by a value that stands for an object, in what a function gives": in_class(
        "std::function<K()> f = [this]() { return this; }; f();", before=OF_NODE
    ),
    "by a value that stands for an object, bound to a reference": in_class(
        "const K & k = this;", before=OF_NODE
    ),
    "by a constructor that takes a list": in_class(
        "K k{this, this};",
        before="struct K { K(rclcpp::Node *, rclcpp::Node *) {} K(std::initializer_list<rclcpp::Node *> l) { "
        f"for (auto * n : l) {{ n->{PUB} }} }} }};\n",
    ),
    "with the name in the second branch": in_class(
        'std::string t = "b"; if (which()) { t = "a"; } create_publisher<std_msgs::msg::String>(t, 1);',
        "bool which();",
    ),
}


@pytest.mark.parametrize("source", HIDDEN.values(), ids=HIDDEN.keys())
def test_it_is_found_or_told(source: str, tmp_path: Path) -> None:
    system = infer(tmp_path, source)
    assert "a" in names(system) or gaps(system), "silently incomplete"


FALSE = {
    "a variable that is written again": in_class(
        'std::string t = "x"; t = "a"; create_publisher<std_msgs::msg::String>(t, 1);'
    ),
    "a shadowed name": in_class(
        'std::string t = "a"; { std::string u = "x"; } create_publisher<std_msgs::msg::String>(t, 1);'
    ),
    "an argument of another instance": in_class(
        'Part p("a"); p.go(this);',
        before="struct Part { Part(std::string t) : t_(t) {} void go(rclcpp::Node * n) { "
        'n->create_publisher<std_msgs::msg::String>(t_, 1); } std::string t_; };\nstatic Part other("x");\n',
    ),
    "the override of a sibling": HEAD
    + 'struct B : rclcpp::Node { B() : Node("n") {} virtual std::string topic() { return "x"; }\n'
    + "void go() { create_publisher<std_msgs::msg::String>(topic(), 1); } };\n"
    + 'struct S : B { std::string topic() override { return "y"; } };\n'
    + 'struct D : B { std::string topic() override { return "a"; } };\nint main() { D d; d.go(); }\n',
    "a copy that changed later": in_class(
        'Config c; c.topic = "a"; Config d = c; d.topic = "x"; create_publisher<std_msgs::msg::String>(c.topic, 1);',
        before="struct Config { std::string topic; };\n",
    ),
    "a value captured before it changed": in_class(
        'std::string t = "a"; auto f = [this, t]() { create_publisher<std_msgs::msg::String>(t, 1); }; t = "x"; f();'
    ),
    "a constant of another namespace": in_class(
        "create_publisher<std_msgs::msg::String>(one::kTopic, 1);",
        before='namespace one { constexpr char kTopic[] = "a"; }\nnamespace two { constexpr char kTopic[] = "x"; }\n',
    ),
}


@pytest.mark.parametrize("source", FALSE.values(), ids=FALSE.keys())
def test_nothing_false_is_certain(source: str, tmp_path: Path) -> None:
    system = infer(tmp_path, source)
    certain = {str(e.name) for n in system.nodes for e in n.endpoints if e.certainty.value == "exact"}
    assert certain == {"a"}
    assert gaps(system) == []


LATE = "t_ = create_wall_timer(1s, [this]() { p_ = create_publisher<std_msgs::msg::String>(topic_, 1); });"


def test_a_name_that_a_callback_writes_is_not_listed_as_certain(tmp_path: Path) -> None:
    """The callback makes no interface itself; the timer's name is the message's then."""
    heard = (
        'create_subscription<std_msgs::msg::String>("in", 1, [this](M::SharedPtr m) { topic_ = m->data; });'
    )
    assert "?" in names(infer(tmp_path, in_class(heard + LATE, 'std::string topic_ = "a";')))


def test_a_name_that_no_callback_writes_is(tmp_path: Path) -> None:
    heard = (
        'create_subscription<std_msgs::msg::String>("in", 1, [this](M::SharedPtr m) { other_ = m->data; });'
    )
    assert names(infer(tmp_path, in_class(heard + LATE, 'std::string topic_ = "a", other_;'))) == ["a", "in"]


def test_what_callbacks_hand_on_from_one_to_the_next_arrives(tmp_path: Path) -> None:
    """Each timer hands a name on, the first one last: as many rounds are needed as there are timers."""
    hand_on = "".join(f"create_wall_timer(1s, [this]() {{ v{i} = v{i + 1}; }});" for i in range(2))
    body = "create_wall_timer(1s, [this]() { create_publisher<std_msgs::msg::String>(v0, 1); });" + hand_on
    members = "".join(f'std::string v{i} = "a{i}";' for i in range(3))
    assert names(infer(tmp_path, in_class(body, members))) == ["a0", "a1", "a2"]
