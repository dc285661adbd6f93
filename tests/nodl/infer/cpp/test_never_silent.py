"""Every place that could make an interface ends as one, as dead for a reason, or as a gap."""

from __future__ import annotations

from pathlib import Path

import pytest

from nodl.infer import infer_paths
from tests.nodl.infer.cpp.workspace import HEAD, gaps, in_class, infer, names, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

FOUND = {
    "in the constructor": in_class('create_publisher<std_msgs::msg::String>("a", 1);'),
    "through this": in_class('this->create_subscription<std_msgs::msg::String>("a", 1, cb);'),
    "in a method that the constructor calls": in_class(
        "init();", 'void init() { create_publisher<std_msgs::msg::String>("a", 1); }'
    ),
    "in a default member initialiser": in_class(
        "", 'rclcpp::PublisherBase::SharedPtr p_{create_publisher<std_msgs::msg::String>("a", 1)};'
    ),
    "in a default argument of the constructor": in_class(
        "", "", before=""
    ).replace("Demo() :", 'explicit Demo(std::string t = "a") :').replace(
        "{  }", "{ create_publisher<std_msgs::msg::String>(t, 1); }"
    ),
    "of a class behind an export macro": in_class('create_publisher<std_msgs::msg::String>("a", 1);').replace(
        "class Demo", "class DEMO_API Demo"
    ),
    "of a base class in another file's namespace": HEAD
    + """
namespace base { class B : public rclcpp::Node { public: explicit B(std::string n) : rclcpp::Node(n) {
  create_publisher<std_msgs::msg::String>("a", 1); } }; }
class D : public base::B { public: D() : B("n") {} };
int main() { auto d = std::make_shared<D>(); }
""",
    "of a class template": HEAD
    + """
template <typename T> class B : public rclcpp::Node { public: B() : rclcpp::Node("n") {
  create_publisher<T>("a", 1); } };
int main() { auto d = std::make_shared<B<std_msgs::msg::String>>(); }
""",
    "through a mixin that gets the node": HEAD
    + """
struct Mixin { explicit Mixin(rclcpp::Node * n) : node_(n) {} void start() {
  node_->create_publisher<std_msgs::msg::String>("a", 1); } rclcpp::Node * node_; };
class D : public rclcpp::Node, public Mixin { public: D() : Node("n"), Mixin(this) { start(); } };
int main() { D d; }
""",
    "by the free function": in_class('rclcpp::create_publisher<std_msgs::msg::String>(*this, "a", 1);'),
    "by the free function with interfaces": in_class(
        'rclcpp::create_publisher<std_msgs::msg::String>(get_node_topics_interface(), "a", 1);'
    ),
    "by a helper class that gets the node": in_class(
        "helper_ = std::make_unique<Helper>(this);",
        "std::unique_ptr<Helper> helper_;",
        before="struct Helper { explicit Helper(rclcpp::Node * n) { "
        'n->create_publisher<std_msgs::msg::String>("a", 1); } };',
    ),
    "by a helper function with a reference": in_class(
        "help(*this);",
        before='void help(rclcpp::Node & n) { n.create_publisher<std_msgs::msg::String>("a", 1); }\n',
    ),
    "by a class that owns its node": HEAD
    + """
class App { public: App() : n_(std::make_shared<rclcpp::Node>("n")) {
  n_->create_publisher<std_msgs::msg::String>("a", 1); } std::shared_ptr<rclcpp::Node> n_; };
int main() { App app; }
""",
    "by a plain base that holds the node": HEAD
    + """
class Base { protected: rclcpp::Node::SharedPtr node_; };
class App : public Base { public: App() { node_ = rclcpp::Node::make_shared("n");
  node_->create_publisher<std_msgs::msg::String>("a", 1); } };
int main() { App app; }
""",
    "in a timer's lambda": in_class(
        "create_wall_timer(1s, [this]() { create_publisher<std_msgs::msg::String>(\"a\", 1); });"
    ),
    "in a bound method": in_class(
        "t_ = create_wall_timer(1s, std::bind(&Demo::on, this));",
        'void on() { create_publisher<std_msgs::msg::String>("a", 1); }',
    ),
    "in a callback that a callback registers": in_class(
        "create_wall_timer(1s, [this]() { create_wall_timer(1s, std::bind(&Demo::on, this)); });",
        'void on() { create_publisher<std_msgs::msg::String>("a", 1); }',
    ),
    "on configure": in_class("").replace("rclcpp::Node", "rclcpp_lifecycle::LifecycleNode").replace(
        ": Node(", ": LifecycleNode("
    ).replace(
        "int main", "int unused_; int main"
    ).replace(
        "};\nint unused_",
        'CallbackReturn on_configure(const rclcpp_lifecycle::State &) override { '
        'create_publisher<std_msgs::msg::String>("a", 1); return CallbackReturn::SUCCESS; } };\nint unused_',
    ),
    "through a macro with arguments": in_class("PUB(a);").replace(
        HEAD, HEAD + "#define PUB(topic) create_publisher<std_msgs::msg::String>(#topic, 1)\n"
    ),
    "through shared_from_this": in_class(
        "", "void init() { auto n = shared_from_this(); n->create_publisher<std_msgs::msg::String>(\"a\", 1); }"
    ).replace("rclcpp::spin(std::make_shared<Demo>());", "auto d = std::make_shared<Demo>(); d->init();"),
    "through a weak pointer": in_class(
        "h_.start(weak_from_this());",
        "Helper h_;",
        before="struct Helper { void start(rclcpp::Node::WeakPtr w) { auto n = w.lock(); "
        'n->create_publisher<std_msgs::msg::String>("a", 1); } };',
    ),
    "through a generic lambda": in_class(
        "auto make = [this](const std::string & t) { return create_publisher<std_msgs::msg::String>(t, 1); };"
        'make("a");'
    ),
}  # fmt: skip


@pytest.mark.parametrize("source", FOUND.values(), ids=FOUND.keys())
def test_an_interface_is_found(source: str, tmp_path: Path) -> None:
    system = infer(tmp_path, source)
    assert names(system) == ["a"]
    assert gaps(system) == []


GAPS = {
    "a message that is waited for": (
        in_class('std_msgs::msg::String m; rclcpp::wait_for_message(m, shared_from_this(), "a");'),
        "wait_for_message() may make an interface",
    ),
    "topic statistics of a subscription": (
        in_class(
            "rclcpp::SubscriptionOptions o; o.topic_stats_options.state = rclcpp::TopicStatisticsState::Enable; "
            'create_subscription<std_msgs::msg::String>("a", 1, cb, o);'
        ),
        "topic statistics of a subscription are not followed",
    ),
    "a sub-node": (
        in_class('auto n = create_sub_node("inner"); n->create_publisher<std_msgs::msg::String>("a", 1);'),
        "create_sub_node() may make an interface",
    ),
    "a sub-node of a plain node": (
        HEAD + 'int main() { auto n = std::make_shared<rclcpp::Node>("n"); auto s = n->create_sub_node("inner"); }\n',
        "create_sub_node was not followed",
    ),
    "a specialisation of a template": (
        in_class(
            "P<int>().set(text); create_publisher<std_msgs::msg::String>(text, 1);",
            "std::string text;",
            before="template <typename T> struct P { void set(std::string & t); };\n"
            'template <> void P<int>::set(std::string & t) { t = "of_int"; }\n',
        ),
        "which specialisation of set is called is not known",
    ),
    "a template with a specialisation": (
        in_class(
            "create_publisher<std_msgs::msg::String>(P<int>().t, 1);",
            before='template <typename T> struct P { const char * t = "any"; };\n'
            'template <> struct P<int> { const char * t = "of_int"; };\n',
        ),
        "which specialisation of P is meant is not known",
    ),
    "the base class is not known": (
        HEAD + 'class D : public acme::Base { public: D() : Base("n") {'
        '  create_publisher<std_msgs::msg::String>("a", 1); } };'
        "int main() { auto d = std::make_shared<D>(); }",
        "the base class acme::Base of D is not known",
    ),
    "the node goes to a library that is not modelled": (
        in_class("acme::attach(this);"),
        "the node is handed to acme::attach()",
    ),
    "an object of a library gets the node": (
        in_class("x_ = std::make_shared<acme::Thing>(shared_from_this());", "std::shared_ptr<acme::Thing> x_;"),
        "the node is handed to the constructor of acme::Thing",
    ),
    "a member of a library gets the node": (
        in_class("", "acme::Thing x_{this};"),
        "the node is handed to the constructor of acme::Thing",
    ),
    "a method of an unknown object gets the node": (
        in_class("auto x = acme::make(); x->attach(this);"),
        "the node is handed to x->attach()",
    ),
    "whose node it is is not known": (
        HEAD + "void f(rclcpp::Node * n);\n"
        'int main() { auto n = acme::node(); n->create_publisher<std_msgs::msg::String>("a", 1); }',
        "the node that n->create_publisher() makes an interface on is not known",
    ),
    "the source of a method is elsewhere": (
        in_class("init();", "void init();"),
        "the source of Demo::init() is not in reach",
    ),
    "the source of a helper is elsewhere": (
        in_class("help(*this);", before="void help(rclcpp::Node & n);"),
        "the node is handed to help()",
    ),
    "who calls the method is not known": (
        in_class("std::vector<Demo *> all; acme::fill(all); for (auto d : all) { d->init(); }",
                 'void init() { create_publisher<std_msgs::msg::String>("a", 1); }'),
        "init",
    ),
    "a macro of somebody else": (
        in_class("", "  ACME_MAKES_THINGS(this)\n"),
        "ACME_MAKES_THINGS",
    ),
    "the program is a node of somebody else": (
        HEAD + "#include <acme/driver_node.hpp>\nint main() { rclcpp::spin(std::make_shared<acme::DriverNode>()); }",
        "acme::DriverNode",
    ),
    "a plugin whose name is not known": (
        in_class("loader_.createSharedInstance(acme::name());", "pluginlib::ClassLoader<acme::Base> loader_;"),
        "which acme::Base plugin is loaded is not known",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("source", "why"), GAPS.values(), ids=GAPS.keys())
def test_what_is_not_known_is_a_gap(source: str, why: str, tmp_path: Path) -> None:
    found = gaps(infer(tmp_path, source))
    assert any(why in each for each in found), found


NOT_MADE = {
    "behind a return": in_class('return; create_publisher<std_msgs::msg::String>("a", 1);'),
    "behind a throw": in_class('throw 1; create_publisher<std_msgs::msg::String>("a", 1);'),
    "in a branch that is never taken": in_class(
        'if (false) { create_publisher<std_msgs::msg::String>("a", 1); }'
    ),
    "behind a constant of another value": in_class(
        'if (mode_ == Mode::B) { create_publisher<std_msgs::msg::String>("a", 1); }',
        "Mode mode_ = Mode::A;",
        before="enum class Mode { A, B };\n",
    ),
    "in a method that nobody calls": in_class(
        "", 'void unused() { create_publisher<std_msgs::msg::String>("a", 1); }'
    ),
    "in a function of another program": in_class(
        "",
        before='static void unused(rclcpp::Node & n) { n.create_publisher<std_msgs::msg::String>("a", 1); }\n',
    ),
    "under #if 0": in_class('\n#if 0\ncreate_publisher<std_msgs::msg::String>("a", 1);\n#endif\n'),
    "for another platform": in_class(
        '\n#ifdef _WIN32\ncreate_publisher<std_msgs::msg::String>("a", 1);\n#endif\n'
    ),
    "in a comment": in_class('/* create_publisher<std_msgs::msg::String>("a", 1); */'),
    "in a text": in_class('const char * help = "create_publisher<T>(topic)";'),
    "in a loop over nothing": in_class(
        "for (auto t : std::vector<std::string>{}) { create_publisher<std_msgs::msg::String>(t, 1); }"
    ),
    "by the overridden method of a base": HEAD
    + """
class B : public rclcpp::Node { public: explicit B() : rclcpp::Node("n") {} void start() { init(); }
  virtual void init() { create_publisher<std_msgs::msg::String>("a", 1); } };
class D : public B { void init() override {} };
int main() { auto d = std::make_shared<D>(); d->start(); }
""",
}


@pytest.mark.parametrize("source", NOT_MADE.values(), ids=NOT_MADE.keys())
def test_what_never_runs_is_not_invented(source: str, tmp_path: Path) -> None:
    system = infer(tmp_path, source)
    assert names(system) == []
    assert gaps(system) == []


def test_a_branch_that_only_the_build_decides_is_a_gap(tmp_path: Path) -> None:
    source = in_class('\n#ifdef WITH_DEBUG\ncreate_publisher<std_msgs::msg::String>("a", 1);\n#endif\n')
    system = infer(tmp_path, source)
    assert names(system) == []
    assert gaps(system) == ["publisher a is made only where the build says defined(WITH_DEBUG)"]


def test_what_both_sides_of_such_a_branch_make_is_certain(tmp_path: Path) -> None:
    source = in_class(
        '\n#ifdef NEW\ncreate_publisher<std_msgs::msg::String>("a", rclcpp::QoS(1));\n#else\n'
        'create_publisher<std_msgs::msg::String>("a", 1);\n#endif\n'
    )
    system = infer(tmp_path, source)
    assert set(names(system)) == {"a"}
    assert gaps(system) == []


def test_a_definition_of_the_target_decides_the_branch(tmp_path: Path) -> None:
    from nodl.infer import infer_paths

    source = in_class('\n#ifdef WITH_DEBUG\ncreate_publisher<std_msgs::msg::String>("a", 1);\n#endif\n')
    cmake = "add_executable(node src/main.cpp)\ntarget_compile_definitions(node PRIVATE WITH_DEBUG)"
    system = infer_paths([package(tmp_path / "demo", {"src/main.cpp": source}, cmake)])
    assert names(system) == ["a"]
    assert gaps(system) == []


def test_classes_of_one_name_in_two_files_stay_two(tmp_path: Path) -> None:
    from nodl.infer import infer_paths

    one = in_class('create_publisher<std_msgs::msg::String>("one", 1);')
    two = in_class('create_publisher<std_msgs::msg::String>("two", 1);').replace('Node("n")', 'Node("m")')
    cmake = "add_executable(first src/one.cpp)\nadd_executable(second src/two.cpp)"
    system = infer_paths([package(tmp_path / "demo", {"src/one.cpp": one, "src/two.cpp": two}, cmake)])
    assert {(n.executable, n.name, *(str(e.name) for e in n.endpoints)) for n in system.nodes} == {
        ("first", "n", "one"),
        ("second", "m", "two"),
    }


@pytest.mark.parametrize("made", ["union two { int a; }; union two t;", "span s = {0.0, 1.0};"])
def test_structures_of_numbers_are_no_gap(made: str, tmp_path: Path) -> None:
    source = in_class(made, before="#include <acme/acme.hpp>\ntypedef struct { double a; double b; } span;\n")
    assert not gaps(infer(tmp_path, source))


def test_a_structure_that_holds_something_else_is_one(tmp_path: Path) -> None:
    source = in_class("span s;", before="#include <acme/acme.hpp>\ntypedef struct { acme::Thing a; } span;\n")
    made = package(tmp_path / "demo", {"src/main.cpp": source}, depends=("rclcpp", "acme"))
    assert gaps(infer_paths([made])) == [
        "the class acme::Thing is not in reach (acme/acme.hpp): it may be a node or make one"
    ]


@pytest.mark.parametrize(("depends", "is_gap"), [(("rclcpp", "acme_ros"), True), (("rclcpp",), False)])
def test_a_class_whose_namespace_is_not_its_package_may_make_a_node(
    depends: tuple[str, ...], is_gap: bool, tmp_path: Path
) -> None:
    """Only a package that ``package.xml`` names can be the one that has it."""
    source = in_class("acme::Other other;", before="#include <acme_ros/other.hpp>\n")
    made = package(tmp_path / "demo", {"src/main.cpp": source}, depends=depends)
    expected = "the class acme::Other is not in reach (acme_ros/other.hpp): it may be a node or make one"
    assert gaps(infer_paths([made])) == ([expected] if is_gap else [])


UNFOLLOWED = {
    "a fold over a pack": (
        'each("b", "c");',
        "template <typename... A> void each(A... a) { (pub(a), ...); }",
    ),
    "a method by its pointer": ('auto m = &Demo::pub; (this->*m)("b");', ""),
    "several arguments of a pack": (
        'H<Base> h(this, "b");',
        "struct Base { Base(Demo * d, std::string t) { d->pub(t); } };"
        "template <typename T> struct H : T { template <typename... X> explicit H(X &&... x) : T(x...) {} };",
    ),
}


@pytest.mark.parametrize(("body", "members"), UNFOLLOWED.values(), ids=UNFOLLOWED)
def test_a_call_that_is_not_followed_is_told_though_its_target_ran_elsewhere(
    body: str, members: str, tmp_path: Path
) -> None:
    members += "void pub(std::string t) { create_publisher<std_msgs::msg::String>(t, 1); }"
    system = infer(tmp_path, in_class(f'pub("a"); {body}', members))
    assert "b" in names(system) or gaps(system) or any("?" in each for each in names(system))


WRITTEN = {
    "by an operator": ("b << 1;", 'B & operator<<(int) { t = "a"; return *this; }'),
    "by a free operator": ("b + 1;", ""),
    "by a sign before it": ("++b;", 'B & operator++() { t = "a"; return *this; }'),
    "by a comparison": ("if (b == b) {}", 'bool operator==(const B &) { t = "a"; return true; }'),
    "by an algorithm": ('std::for_each(v.begin(), v.end(), [](B & e) { e.t = "a"; }); b = v[0];', ""),
    "by a swap": ('B c; c.t = "a"; std::swap(b, c);', ""),
    "through a list of pointers": ('for (auto p : {&b}) { p->t = "a"; }', ""),
    "through a wrapped reference": ('std::reference_wrapper<B> r = b; r.get().t = "a";', ""),
}


@pytest.mark.parametrize(("body", "members"), WRITTEN.values(), ids=WRITTEN)
def test_what_is_written_in_a_way_of_its_own_is_seen(body: str, members: str, tmp_path: Path) -> None:
    before = f'struct B {{ std::string t = "x"; {members} }};\n'
    before += 'B & operator+(B & b, int) { b.t = "a"; return b; }\n'
    use = f"std::vector<B> v(1); B b; {body} create_publisher<std_msgs::msg::String>(b.t, 1);"
    assert "a" in names(infer(tmp_path, in_class(use, before=before)))


def test_what_a_thread_writes_may_be_there_or_not(tmp_path: Path) -> None:
    start = 'std::string t = "x"; std::string u = "u"; std::thread w([&]() { t = "a"; });'
    made = "".join(f"create_publisher<std_msgs::msg::String>({each}, 1);" for each in "tu")
    assert names(infer(tmp_path, in_class(start + made))) == ["?", "u"]


EACH = {
    "by a closure": 'std::for_each(v.begin(), v.end(), [](auto & s) { s = "b"; });',
    "by a closure found by its arguments": 'for_each(v.begin(), v.end(), [](auto & s) { s = "b"; });',
    "by a function": "std::for_each(v.begin(), v.end(), set);",
    "by an object": "std::for_each(v.begin(), v.end(), Set{});",
    "by a bound function": "std::for_each(v.begin(), v.end(), std::bind(set, std::placeholders::_1));",
    "by somebody unknown": "std::for_each(v.begin(), v.end(), boost::trim);",
    "between iterators": 'auto i = v.begin(); auto e = v.end(); std::fill(i, e, "b");',
    "through a template": "range(v.begin(), v.end());",
    "by a predicate": 'std::any_of(v.begin(), v.end(), [](auto & s) { s = "b"; return true; });',
    "of what a method gives": "std::for_each(all().begin(), all().end(), set);",
    "at a place": "set(v.at(0));",
    "where an iterator stands": "set(*v.begin());",
    "in what a closure captured": "std::count_if(w.begin(), w.end(), [&](int) { v = {}; return true; });",
    "by a method of a container": "std::list<int> l; l.remove_if([&](int) { v = {}; return true; });",
}
ONLY_READ = {
    "copies": 'std::for_each(v.begin(), v.end(), [](auto s) { s = "b"; });',
    "constants": "std::for_each(v.begin(), v.end(), [](const auto & s) { look(s); });",
}
SETTERS = """
void set(std::string & s) { s = "b"; }
struct Set { void operator()(std::string & s) { s = "b"; } };
template <typename I> void range(I b, I e) { std::for_each(b, e, [](auto & s) { s = "b"; }); }
void look(const std::string &) {}
"""


def elements(folder: Path, body: str) -> tuple[list[str], list[str]]:
    use = f"std::vector<int> w(1); {body} create_publisher<std_msgs::msg::String>(v[0], 1);"
    members = 'std::vector<std::string> v{"a"}; std::vector<std::string> & all() { return v; }'
    if body.startswith(("auto", "range")):
        use = f'std::vector<std::string> v{{"a"}}; {use}'
    system = infer(folder, in_class(use, members, before=SETTERS))
    return names(system), gaps(system)


@pytest.mark.parametrize("body", EACH.values(), ids=EACH)
def test_elements_that_somebody_writes_are_not_what_they_were(body: str, tmp_path: Path) -> None:
    made, told = elements(tmp_path, body)
    assert told or any("?" in each for each in made) or "b" in made


@pytest.mark.parametrize("body", ONLY_READ.values(), ids=ONLY_READ)
def test_elements_that_an_algorithm_only_reads_stay(body: str, tmp_path: Path) -> None:
    assert elements(tmp_path, body) == (["a"], [])


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


@pytest.mark.parametrize("held", ["auto p = std::make_shared<B>();", "B * p = new B();"])
def test_a_pointer_in_a_condition_is_not_what_its_object_converts_to(held: str, tmp_path: Path) -> None:
    use = f'{held} if (p) {{ create_publisher<std_msgs::msg::String>("a", 1); }}'
    before = "struct B { explicit operator bool() const { return false; } };\n"
    assert names(infer(tmp_path, in_class(use, before=before))) == ["a"]


S = "std_msgs::msg::String"
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


MACROS = {
    "a macro that is undefined behind its use": (
        f"#define X(n) create_publisher<{S}>(#n, 1);\nX(a) X(b)\n#undef X\n", ["a", "b"]
    ),
    "one list with two meanings": (
        f"#define X(n) create_publisher<{S}>(#n, 1);\nLIST\n#undef X\n"
        f"#define X(n) create_service<{S}>(#n \"_srv\", cb);\nLIST\n#undef X\n",
        ["a", "a_srv", "b", "b_srv"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "made"), MACROS.values(), ids=MACROS)
def test_a_macro_is_what_it_is_where_it_stands(body: str, made: list[str], tmp_path: Path) -> None:
    source = in_class(f"\n{body}", before="#define LIST X(a) X(b)\n")
    system = infer(tmp_path, source)
    assert (names(system), gaps(system)) == (made, [])


def test_a_file_that_uses_a_macro_of_who_includes_it_is_told(tmp_path: Path) -> None:
    body = f'\n#define X(n) create_publisher<{S}>(#n, 1);\n#include "list.def"\n#undef X\n'
    told = gaps(infer(tmp_path, in_class(body), **{"src__list.def": "X(a)\nX(b)\n"}))
    assert told == ["what the macro X stands for here is not known; it may make interfaces"]


def test_a_macro_that_the_build_defines_in_one_of_two_ways_is_told(tmp_path: Path) -> None:
    before = f"#ifdef F\n#define M(n) create_publisher<{S}>(n, 1)\n#else\n#define M(n) advertise(n)\n#endif\n"
    told = gaps(infer(tmp_path, in_class('M("a");', before=before)))
    assert told == ["what the macro M stands for here is not known; it may make interfaces"]
    harmless = "#ifdef F\n#define M(n) printf(n)\n#else\n#define M(n) puts(n)\n#endif\n"
    assert gaps(infer(tmp_path / "harmless", in_class('M("a");', before=harmless))) == []


HELPER = f"void make(rclcpp::Node * n, const std::string & s) {{ n->create_publisher<{S}>(s, 1); }}\n"


def test_a_helper_that_ran_for_one_caller_is_told_for_another_who_did_not(tmp_path: Path) -> None:
    more = 'struct Other { virtual void start() { make(the_node, "b"); } };\n'
    made = 'make(this, "a"); auto other = std::make_shared<Other>(); somebody::keep(other);'
    system = infer(tmp_path, in_class(made, before=f"rclcpp::Node * the_node;\n{HELPER}{more}"))
    assert names(system) == ["a"]
    assert gaps(system) == [
        "make() is called by Other::start, and it was not understood who calls that: it may make interfaces"
    ]


def test_a_function_that_calls_itself_is_told_where_it_is_no_longer_followed(tmp_path: Path) -> None:
    member = f"int i = 0; void next() {{ if (i < 6) {{ create_publisher<{S}>(std::to_string(i), 1); ++i; next(); }} }}"
    assert gaps(infer(tmp_path, in_class("next();", member))) == [
        "Demo::next calls itself, deeper than is followed"
    ]


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


def test_a_literal_of_the_program_is_told_if_it_makes_something(tmp_path: Path) -> None:
    before = f"""rclcpp::Node * the_node;
int operator""_topic(const char * s, size_t) {{ the_node->create_publisher<{S}>(s, 1); return 1; }}
"""
    assert gaps(infer(tmp_path, in_class('the_node = this; "a"_topic;', before=before)))


def test_a_jump_is_told_where_interfaces_are_made_and_nowhere_else(tmp_path: Path) -> None:
    jump = "void jump() {{ int i = 0; again: {} if (++i < 3) {{ goto again; }} }}"
    made = f'create_publisher<{S}>("t" + std::to_string(i), 1);'
    (why,) = gaps(infer(tmp_path / "made", in_class("jump();", jump.format(made))))
    assert why == "goto again: what runs behind the label is not followed"
    assert gaps(infer(tmp_path / "counted", in_class("jump();", jump.format("")))) == []


def test_unknown_code_may_run_the_callbacks_that_are_there_already(tmp_path: Path) -> None:
    make = f"create_wall_timer(1s, [this]() {{ create_publisher<{S}>(name, 1); }});"
    body = f'{make} name = "b"; acme::poll(); name = "c";'
    source = in_class(body, 'std::string name = "a";').replace(
        "rclcpp::spin(std::make_shared<Demo>());", "auto d = std::make_shared<Demo>(); rclcpp::spin(d);"
    )
    assert names(infer(tmp_path / "unknown", source)) == ["b", "c"]
    assert names(infer(tmp_path / "alone", source.replace("acme::poll();", ""))) == ["c"]


def test_the_size_of_a_map_is_not_known(tmp_path: Path) -> None:
    use = f"{{}} create_publisher<{S}>(std::to_string(m.size()), 1);"
    member = 'std::map<std::string, int> m{{"a", 1}};'
    assert names(infer(tmp_path / "asked", in_class(use.format("m[get()];"), member))) == ["?"]


def test_what_a_specialisation_gives_is_not_known(tmp_path: Path) -> None:
    before = "template <typename T> struct P { std::string text(); };\n"
    before += 'template <> std::string P<int>::text() { return "of_int"; }\n'
    source = in_class(f"create_publisher<{S}>(P<int>().text(), 1);", before=before)
    assert names(infer(tmp_path, source)) == ["?"]


def test_a_text_that_a_derived_class_hides_is_told_and_a_pointer_that_it_hides_is_not(tmp_path: Path) -> None:
    def hiding(member: str) -> list[str]:
        before = f"struct B {{ {member} }};\nstruct D : B {{ {member} }};\n"
        return gaps(infer(tmp_path / str(len(member)), in_class("D d;", before=before)))

    assert hiding("std::string name;") == ["D hides name of a base: which of them is meant is not followed"]
    assert hiding("rclcpp::Node * node;") == []


BEHIND = {
    "through a reference that a member of another object is": (
        'h.r = "b";',
        "struct H { std::string & r; }; H h{t};",
        "what h.r refers to is written",
    ),
    "through a pointer that is a member": (
        'p = &t; *p = "b";',
        "std::string * p = nullptr;",
        "what p refers to is written",
    ),
    "through a pointer into an array": (
        'std::string * p = l; p[0] = "b"; t = l[0];',
        'std::string l[1] = {"a"};',
        "what p refers to is written",
    ),
    "through a pointer that another object has": (
        'h.p = &t; *h.p = "b";',
        "struct H { std::string * p; }; H h;",
        "what h.p refers to is written",
    ),
    "by a method, through a pointer that is a member": (
        'p = &t; p->append("b");',
        "std::string * p = nullptr;",
        "what p refers to is written",
    ),
    "by an exchange through a pointer that is a member": (
        'p = &t; std::string other = "b"; std::swap(*p, other);',
        "std::string * p = nullptr;",
        "what p refers to is written",
    ),
    "from a stream, through a pointer that is a member": (
        "p = &t; std::cin >> *p;",
        "std::string * p = nullptr;",
        "what p refers to is written",
    ),
}


@pytest.mark.parametrize(("body", "members", "why"), BEHIND.values(), ids=BEHIND)
def test_a_text_that_is_written_behind_its_variable_is_told(
    body: str, members: str, why: str, tmp_path: Path
) -> None:
    source = in_class(f"{body} create_publisher<{S}>(t, 1);", f'std::string t = "a"; {members}')
    assert [gap.partition(":")[0] for gap in gaps(infer(tmp_path, source))] == [why]


def test_a_text_that_a_member_only_reads_through_a_pointer_stays_known(tmp_path: Path) -> None:
    members = 'std::string t = "a"; const std::string * p = nullptr; size_t n = 0;'
    found = infer(tmp_path, in_class(f"p = &t; n = p->size(); create_publisher<{S}>(t, 1);", members))
    assert (names(found), gaps(found)) == (["a"], [])


def test_a_number_that_unknown_code_gets_as_a_variable_may_be_another_one(tmp_path: Path) -> None:
    body = f'int n = 0; acme::read(n); create_publisher<{S}>("t" + std::to_string(n), 1);'
    assert names(infer(tmp_path, in_class(body))) == ["t0", "t?"]


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


COPIED = {
    "a list that a method gives": ('auto v = list(); v[0].t = "b";', "a"),
    "an element of it": ('auto c = list()[0]; c.t = "b";', "a"),
    "each of its elements": ('for (auto c : list()) { c.t = "b"; }', "a"),
    "pointers that a method gives": ('for (auto p : pointers()) { p->t = "b"; }', "b"),
    "what a pointer that a method gives points to": ("*one() = other_;", "b"),
}


@pytest.mark.parametrize(("body", "expected"), COPIED.values(), ids=COPIED)
def test_what_a_call_gives_is_copied_if_it_is_no_pointer(body: str, expected: str, tmp_path: Path) -> None:
    members = (
        'std::vector<C> l_{C{}}; std::vector<C> & list() { return l_; } C other_{"b"}; C * one() { return &l_[0]; }'
        "std::vector<C *> p_{&l_[0]}; std::vector<C *> & pointers() { return p_; }"
    )
    use = f"{body} create_publisher<{S}>(l_[0].t, 1);"
    assert names(infer(tmp_path, in_class(use, members, before='struct C { std::string t = "a"; };\n'))) == [
        expected
    ]


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
