"""Every place that could make an interface ends as one, as dead for a reason, or as a gap."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import infer_paths
from tests.addons.inference.cpp.workspace import HEAD, gaps, in_class, infer, names, package

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
    "in the same method of a base class, called by its bare name": HEAD
    + """
namespace base { class B : public rclcpp::Node { public: explicit B(std::string n) : rclcpp::Node(n) {}
  void setup() { create_publisher<std_msgs::msg::String>("a", 1); } }; }
class App : public base::B { public: App() : B("app") { setup(); } void setup() { B::setup(); } };
int main() { App app; }
""",
    "of a node that is spun without a namespace": in_class(
        'create_publisher<std_msgs::msg::String>("a", 1);'
    ).replace("rclcpp::spin(", "spin("),
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


def test_classes_of_one_name_in_two_files_stay_two(tmp_path: Path) -> None:
    from enclave_addons.inference import infer_paths

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


@pytest.mark.parametrize(
    ("before", "source"),
    [
        (
            "#include <apriltag.h>\n#include <opencv2/core.hpp>\n#include <sensor_msgs/image_encodings.hpp>",
            "",
        ),
        ("#include <gtsam/nonlinear/ISAM2.h>\n#include <vector>\nusing namespace gtsam;", ""),
        ("#include <time.h>\n#include <std_msgs/msg/string.hpp>", ""),
        ("#include <acme/thing.hpp>", "acme/thing.hpp"),  # its package is missing in package.xml
        ("#include <thing.h>", "thing.h"),
        ('#include "thing.hpp"', "thing.hpp"),
        ("using namespace rclcpp_lifecycle;", "namespace rclcpp_lifecycle"),
    ],
)
def test_a_class_without_a_namespace_is_a_gap_unless_all_headers_that_may_have_it_are_reviewed(
    before: str, source: str, tmp_path: Path
) -> None:
    made = package(tmp_path / "demo", {"src/main.cpp": in_class("Thing thing(1);", before=f"{before}\n")})
    expected = f"the class Thing is not in reach ({source}): it may be a node or make one"
    assert gaps(infer_paths([made])) == ([expected] if source else [])


@pytest.mark.parametrize(("namespace", "is_gap"), [("ouster", False), ("rover", True)])
def test_a_constructor_without_source_is_a_gap_unless_its_library_knows_nothing_of_ros(
    namespace: str, is_gap: bool, tmp_path: Path
) -> None:
    header = f"namespace {namespace} {{ struct Client {{ explicit Client(int port); }}; }}\n"
    source = in_class(f"{namespace}::Client client(1);", before=header)
    expected = "the source of the constructor of Client is not in reach"
    assert gaps(infer(tmp_path, source)) == ([expected] if is_gap else [])


@pytest.mark.parametrize("header", ["grid_planner.hpp", "planners/GridPlanner.h"])
def test_a_gap_names_the_header_that_is_called_as_the_class(header: str, tmp_path: Path) -> None:
    source = in_class(
        "GridPlanner planner(3);", before=f'#include <eigen3/Eigen/Dense>\n#include "{header}"\n'
    )
    made = package(tmp_path / "demo", {"src/main.cpp": source}, depends=("rclcpp", "eigen3"))
    expected = f"the class GridPlanner is not in reach ({header}): it may be a node or make one"
    assert gaps(infer_paths([made])) == [expected]


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


S = "std_msgs::msg::String"


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
        "Demo::next calls itself, or is called deeper than is followed"
    ]


def test_a_jump_is_told_where_interfaces_are_made_and_nowhere_else(tmp_path: Path) -> None:
    jump = "void jump() {{ int i = 0; again: {} if (++i < 3) {{ goto again; }} }}"
    made = f'create_publisher<{S}>("t" + std::to_string(i), 1);'
    told = gaps(infer(tmp_path / "made", in_class("jump();", jump.format(made))))
    assert "goto again: what this function does is not followed" in told
    assert gaps(infer(tmp_path / "counted", in_class("jump();", jump.format("")))) == []


def test_the_size_of_a_map_is_not_known(tmp_path: Path) -> None:
    use = f"{{}} create_publisher<{S}>(std::to_string(m.size()), 1);"
    member = 'std::map<std::string, int> m{{"a", 1}};'
    assert names(infer(tmp_path / "asked", in_class(use.format("m[get()];"), member))) == ["?"]


def test_a_program_of_ros_1_is_one_gap_and_one_that_also_has_rclcpp_is_analysed(tmp_path: Path) -> None:
    source = """#include <ros/ros.h>
int main(int argc, char ** argv) {
  ros::init(argc, argv, "n"); ros::NodeHandle nh; ros::Timer timer;
  auto pub = nh.advertise<std_msgs::String>("a", 1); auto sub = nh.subscribe("b", 1, called);
}
"""
    system = infer(tmp_path, source)
    assert (names(system), gaps(system)) == ([], ["this is a program of ROS 1, which is not analysed"])
    both = in_class(f'create_publisher<{S}>("a", 1);', before="#include <ros/ros.h>\n")
    assert names(infer(tmp_path / "both", both)) == ["a"]
