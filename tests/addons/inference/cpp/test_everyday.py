"""What ordinary packages do: parameter libraries, formats, structures in structures, CMake modules."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import infer_paths
from enclave_addons.inference.cpp.reading.cmake import read_build
from nodl.package_xml import read_package_xml
from tests.addons.inference.cpp.workspace import HEAD, endpoints, gaps, in_class, infer, names, package

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "create_publisher<std_msgs::msg::String>"

LISTENER = """demo:
  topic: {type: string, default_value: "chatter"}
  topics: {type: string_array, default_value: ["a", "b"]}
  out:
    name: {type: string}
  __map_joints:
    gain: {type: double}
"""


def _with_listener(folder: Path, body: str, parameters: str = LISTENER) -> Path:
    source = in_class(
        f"listener_ = std::make_shared<demo::ParamListener>(get_node_parameters_interface()); "
        f"params_ = listener_->get_params(); {body}",
        "std::shared_ptr<demo::ParamListener> listener_; demo::Params params_;",
        before='#include "demo_parameters.hpp"\n',
    )
    cmake = "generate_parameter_library(demo_parameters src/p.yaml)\nadd_executable(node src/main.cpp)"
    files = {"src/main.cpp": source, "src/p.yaml": parameters}
    return package(folder / "demo", files, cmake, ("rclcpp", "generate_parameter_library"))


def test_a_parameter_library_names_parameters_with_their_defaults(tmp_path: Path) -> None:
    system = infer_paths([_with_listener(tmp_path, f"{PUB}(params_.topic, 1); {PUB}(params_.out.name, 1);")])
    (node,) = system.nodes
    assert gaps(system) == []
    assert [str(e.name) for e in node.endpoints] == ["param:topic", "param:out.name"]
    assert [e.name.fill({}).text for e in node.endpoints] == ["chatter", "*"]
    assert [e.name.fill({"out.name": "x"}).text for e in node.endpoints] == ["chatter", "x"]


@pytest.mark.parametrize("given", ['"arm"', 'get_logger(), "arm"'])
def test_a_parameter_library_puts_its_prefix_before_each_name(given: str, tmp_path: Path) -> None:
    made = f"listener_ = std::make_shared<demo::ParamListener>(get_node_parameters_interface(), {given});"
    body = f"{made} params_ = listener_->get_params(); {PUB}(params_.topic, 1);"
    system = infer_paths([_with_listener(tmp_path, body)])
    assert names(system) == ["param:arm.topic"]
    assert gaps(system) == []


def test_entries_that_other_parameters_name_are_not_known(tmp_path: Path) -> None:
    body = f"for (auto & [name, joint] : params_.joints_map) {{ {PUB}(name, 1); }}"
    assert names(infer_paths([_with_listener(tmp_path, body)])) == ["?"]


def test_a_file_of_parameters_that_is_none_is_told(tmp_path: Path) -> None:
    system = infer_paths([_with_listener(tmp_path, f'{PUB}("a", 1);', "[not, a, mapping]")])
    assert any("a file of parameters has one name at its top" in why for why in gaps(system))


FOUND = {
    "structures by typedef, one in another": (
        f'o.i.t = "x"; {PUB}(o.i.t, 1);',
        "typedef struct { typedef struct { std::string t; } I; I i; } O; O o;",
        ["x"],
    ),
    "structures without a name": (
        f'o.i.t = "x"; {PUB}(o.i.t, 1);',
        "struct { struct { std::string t; } i; } o;",
        ["x"],
    ),
    "an enumeration where it is used": (f'{PUB}("x", 1);', "enum class S { a, b } s_; union { int i; } u_;", ["x"]),
    "names bound to members": (
        f"auto [a, b] = get(); {PUB}(a, 1); {PUB}(b, 1);",
        'struct P { std::string a; std::string b; }; P get() { P p; p.a = "x"; p.b = "y"; return p; }',
        ["x", "y"],
    ),
    "names bound to an array": (f'std::string l[2] = {{"x", "y"}}; auto & [a, b] = l; {PUB}(b, 1);', "", ["y"]),
    "letters that are replaced": (
        f"std::string s = \"a-b\"; std::replace(s.begin(), s.end(), '-', '_'); {PUB}(s, 1);", "", ["?"]
    ),
    "a text by snprintf": (f'char b[32] = "old"; snprintf(b, sizeof(b), "t%02d", 3); {PUB}(b, 1);', "", ["?"]),
    "a text by fmt": (f'{PUB}("a/" + fmt::format("{{}}", 2), 1);', "", ["a/?"]),
    "a word from a stream": (
        f'std::string w = "old"; std::istringstream s("a b"); s >> w; {PUB}(w, 1);', "", ["?"]
    ),
    "a part behind a letter is not followed": (
        f'std::string s = "a/b"; auto at = s.rfind("/"); '
        f"if (at != std::string::npos) {{ {PUB}(s.substr(at + 1), 1); }}",
        "", ["?"],
    ),
    "an entry that is not there": (
        f'std::map<std::string, int> m{{{{"a", 1}}}}; if (m.find("b") != m.end() || m.count("b")) {{ {PUB}("b", 1); }}',
        "", [],
    ),
    "a loop that tests at its end": (
        f'int i = 2; do {{ {PUB}("t" + std::to_string(i), 1); }} while (--i > 0);', "", ["t1", "t2"]
    ),
    "whole numbers that are divided": (f'{PUB}("t" + std::to_string(7 / 2 + 7 % 4), 1);', "", ["t6"]),
    "an object that hands itself on": (
        "auto h = std::make_shared<H>(this); h->start();",
        "struct H : std::enable_shared_from_this<H> { rclcpp::Node * n; explicit H(rclcpp::Node * x) : n(x) {} "
        "void start() { auto self = shared_from_this(); self->go(); this->weak_from_this().lock()->go(); } "
        f'void go() {{ n->{PUB}("a", 1); }} }};',
        ["a"],
    ),
    "an element by at": (
        f'std::vector<std::string> v{{"a", "b"}}; v.at(1) = "c"; std::map<std::string, std::string> m{{{{"k", "d"}}}}; '
        f'm.at("k") = "e"; {PUB}(v[0], 1); {PUB}(v[1], 1); {PUB}(m["k"], 1);',
        "", ["a", "c", "e"],
    ),
    "structures and macros of POSIX": (
        f'sockaddr_in address; fd_set set; FD_ZERO(&set);\nFD_SET(1, &set);\n{PUB}("a", 1);', "struct sockaddr_in a_;",
        ["a"],
    ),
    "objects in closures": (
        'C a; a.t = "a"; auto copy = [a]() { return a.t; }; auto same = [&a]() { return a.t; }; a.t = "b"; '
        f'{PUB}("copy_" + copy(), 1); {PUB}("same_" + same(), 1);',
        "struct C { std::string t; };", ["copy_a", "same_b"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "members", "made"), FOUND.values(), ids=FOUND)
def test_a_name_is_known(body: str, members: str, made: list[str], tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, members))
    assert (names(system), gaps(system)) == (made, [])


def test_a_header_may_bring_in_the_names_of_std(tmp_path: Path) -> None:
    body = f'stringstream s; s << "a" << 1; {PUB}(s.str(), 1); vector<string> v{{"b"}}; for (auto & e : v) {PUB}(e, 1);'
    source = '#include "all.hpp"\n' + in_class(body)
    assert names(infer(tmp_path, source, src__all_hpp="using namespace std;\n")) == ["a1", "b"]
    assert "a1" not in names(infer(tmp_path / "without", source, src__all_hpp=""))


MODULE = "macro(robot_node name)\n  add_executable(${name} ${ARGN})\nendmacro()\n"


@pytest.mark.parametrize(
    "include",
    [
        "include(cmake/robot.cmake)",
        "include(${CMAKE_CURRENT_SOURCE_DIR}/cmake/robot.cmake)",
        "list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_SOURCE_DIR}/cmake)\ninclude(robot)",
        "list(INSERT CMAKE_MODULE_PATH 0 ${PROJECT_SOURCE_DIR}/cmake)\ninclude(robot)",
    ],
)
def test_a_module_of_cmake_is_read_where_it_is_included(include: str, tmp_path: Path) -> None:
    files = {"src/main.cpp": in_class(f'{PUB}("a", 1);'), "cmake/robot.cmake": MODULE}
    system = infer_paths([package(tmp_path / "demo", files, f"{include}\nrobot_node(talker src/main.cpp)")])
    assert [(node.executable, str(e.name)) for node in system.nodes for e in node.endpoints] == [
        ("talker", "a")
    ]


def test_a_project_named_by_a_macro_has_the_name_of_its_package(tmp_path: Path) -> None:
    folder = package(tmp_path / "demo", {}, "")
    target = "add_executable(${PROJECT_NAME}_node src/node.cpp)"
    name = read_package_xml(folder).name
    for project, made in (("${extracted} VERSION 1.0", name), ("other", "other")):
        (folder / "CMakeLists.txt").write_text(f"project({project})\n{target}\n")
        assert list(read_build(str(folder)).targets) == [f"{made}_node"]


def test_a_folder_that_includes_itself_is_read_once(tmp_path: Path) -> None:
    folder = package(tmp_path / "demo", {}, "add_subdirectory(${UNKNOWN})\nadd_executable(node src/node.cpp)")
    assert list(read_build(str(folder)).targets) == ["node"]


def test_a_source_without_its_suffix_is_found(tmp_path: Path) -> None:
    cmake = "add_library(lib src/lib)\nadd_executable(node src/main.cpp)\ntarget_link_libraries(node lib)"
    files = {
        "src/main.cpp": HEAD + 'void make(rclcpp::Node & n);\nint main() { rclcpp::Node n("n"); make(n); }',
        "src/lib.cpp": HEAD + f'void make(rclcpp::Node & n) {{ n.{PUB}("a", 1); }}',
    }
    system = infer_paths([package(tmp_path / "demo", files, cmake)])
    assert (names(system), gaps(system)) == (["a"], [])


def test_parameter_clients_of_a_node_whose_name_is_not_known_are_not_of_the_node_itself(
    tmp_path: Path,
) -> None:
    made = "std::make_shared<rclcpp::AsyncParametersClient>(this{});"
    own = endpoints(infer(tmp_path / "own", in_class(made.format(""))))
    other = endpoints(infer(tmp_path / "other", in_class(made.format(", compute()"))))
    assert ("service_client", "~/get_parameters") in own
    assert not any(name.startswith("~") for _, name in other)


@pytest.mark.parametrize(
    "executor", ["rclcpp::experimental::executors::EventsExecutor", "rclcpp::StaticWaitSet<1>"]
)
def test_what_waits_for_a_node_makes_nothing_on_it(executor: str, tmp_path: Path) -> None:
    body = f'{executor} e; e.add_node(n); n->{PUB}("a", 1);'
    main = f'int main() {{ auto n = std::make_shared<rclcpp::Node>("n"); {body} }}'
    system = infer(tmp_path, HEAD + main)
    assert (names(system), gaps(system)) == (["a"], [])


@pytest.mark.parametrize(
    "cls", ["self_test::TestRunner", "tf2_ros::BufferServer", "rclcpp::experimental::IntraProcessManager"]
)
def test_a_class_of_a_library_that_is_not_in_the_table_is_a_gap(cls: str, tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(f"t = std::make_shared<{cls}>(this);", f"std::shared_ptr<{cls}> t;"))
    assert any(cls.partition("<")[0] in why for why in gaps(system))


def test_a_class_of_a_plugin_loader_is_no_component(tmp_path: Path) -> None:
    source = in_class("").partition("int main")[0] + "CLASS_LOADER_REGISTER_CLASS({})\n"
    for number, (registered, nodes) in enumerate(
        [("Demo, rclcpp::Node", ["n"]), ("Factory<Demo>, Base", [])]
    ):
        files = {
            "src/a.cpp": source.format(registered) if "{}" not in source else source.replace("{}", registered)
        }
        found = infer_paths([package(tmp_path / str(number), files, "add_library(l SHARED src/a.cpp)")])
        assert [node.name for node in found.nodes if node.plugin] == nodes


MADE_LATER = f"struct A {{ void go(rclcpp::Node * n, const char * t) {{ n->{PUB}(t, 1); }} }};"


@pytest.mark.parametrize(
    "body",
    [
        'if (auto a = w_.lock()) { a->go(this, "a"); }',
        'if (A * a = get()) { a->go(this, "a"); }',
        'while (auto * a = get()) { a->go(this, "a"); break; }',
        'if (auto * a = dynamic_cast<A *>(b_)) { a->go(this, "a"); }',
        'o_.emplace(); if (o_) { o_->go(this, "a"); }',
        'std::invoke(&A::go, a_, this, "a");',
        'more_.emplace_back(&A::go, &a_, this, "a");',
    ],
)
def test_an_object_is_known_where_it_is_got(body: str, tmp_path: Path) -> None:
    members = """std::shared_ptr<A> s_ = std::make_shared<A>(); std::weak_ptr<A> w_ = s_; A a_; A * b_ = new A();
A * get() { return &a_; } std::optional<A> o_; std::thread t_; std::vector<std::thread> more_;"""
    system = infer(tmp_path, in_class(body, members, before=f"{MADE_LATER}\n"))
    assert (names(system), gaps(system)) == (["a"], [])


def test_a_method_that_is_handed_over_beside_its_object_runs_on_that(tmp_path: Path) -> None:
    member = f'void run() {{ {PUB}(topic_, 1); }} std::string topic_ = "a";'
    system = infer(tmp_path, in_class("somebody::call_back(&Demo::run, this);", member))
    assert names(system) == ["a"]
    assert gaps(system) == ["the node is handed to somebody::call_back(), which may make interfaces on it"]


CONFIG = """struct Config { std::string in{"in"}; std::string out{"out"}; };
Config load() { Config c; c.out = "set"; return c; }
"""


@pytest.mark.parametrize(
    ("taken", "member"),
    [
        ("const Config & c", "c_(c)"),
        ("const Config & c", "c_{c}"),
        ("Config c", "c_{std::move(c)}"),
        ("Config", "c_{load()}"),
        ("Config", "c_(load())"),
    ],
)
def test_a_structure_made_of_another_one_is_its_copy(taken: str, member: str, tmp_path: Path) -> None:
    source = f"""{HEAD}{CONFIG}class D : public rclcpp::Node {{ public:
  explicit D({taken}) : Node("n"), {member} {{ {PUB}(c_.out, 1); create_subscription<X>(c_.in, 1, cb); }}
  Config c_; }};
int main() {{ auto d = std::make_shared<D>(load()); }}"""
    system = infer(tmp_path, source)
    assert (names(system), gaps(system)) == (["in", "set"], [])


def test_what_fills_the_only_field_of_a_structure_runs_once(tmp_path: Path) -> None:
    members = "struct F { int n; }; int i = 0; int next() { return i++; }"
    body = f'F f{{next()}}; F g{{next()}}; {PUB}("t" + std::to_string(f.n) + std::to_string(g.n), 1);'
    assert names(infer(tmp_path, in_class(body, members))) == ["t01"]


ITEM = 'struct Item { std::string t = "d"; };'
SEVERAL = (
    "std::vector<Item> v(2);", "std::vector<Item> v(count());", "Item v[2];", "std::array<Item, 2> v;",
    "auto * v = new Item[count()];",
)  # fmt: skip


@pytest.mark.parametrize("made", SEVERAL)
def test_an_element_that_stands_for_all_keeps_what_was_written(made: str, tmp_path: Path) -> None:
    body = f'{made} v[0].t = "a"; v[1].t = "b"; {PUB}(v[0].t, 1); {PUB}(v[1].t, 1);'
    found = set(names(infer(tmp_path, in_class(body, ITEM))))
    assert {"a", "b"} <= found or "?" in found


INTO_A_POINTER = (
    "void square(const std::vector<double> & v, double * out) {"
    " std::transform(v.begin(), v.end(), out, [](double x) { return x * x; }); }"
    "double held_[3];"
)


def test_an_algorithm_writes_through_a_pointer_to_what_the_caller_gave(tmp_path: Path) -> None:
    publishes = f'{PUB}("a", 1);'
    given = infer(tmp_path / "1", in_class(f"square({{1.0, 2.0}}, held_); {publishes}", INTO_A_POINTER))
    assert names(given) == ["a"]
    assert not gaps(given)
    iterator = "std::vector<double> v{1.0}; auto it = v.begin(); std::fill(it, v.end(), 2.0);"
    use = "create_publisher<std_msgs::msg::String>(std::to_string(v[0]), 1);"
    assert names(infer(tmp_path / "2", in_class(f"{iterator} {use}"))) == ["?"]


PARTS = {
    "taken apart of what is not known": ('std::string a = "d"; int b; std::tie(a, b) = get();', "a", ["?"]),
    "turned round": (
        'std::vector<std::string> a{"x", "y"}; std::reverse(a.begin(), a.end());',
        "a[0]",
        ["?"],
    ),
}


@pytest.mark.parametrize(("body", "name", "made"), PARTS.values(), ids=PARTS)
def test_what_the_standard_library_writes_is_seen(
    body: str, name: str, made: list[str], tmp_path: Path
) -> None:
    assert names(infer(tmp_path, in_class(f"{body} {PUB}({name}, 1);"))) == made


NESTED = f"{ITEM} struct Box {{ Item item; std::vector<Item> list; std::map<std::string, Item> m; }};"
COPIES = {
    "a member": ("Box a; Box b = a;", "a.item.t", "b.item.t"),
    "a list": ("std::vector<Item> a{Item()}; auto b = a;", "a[0].t", "b[0].t"),
    "a list that is assigned": (
        "std::vector<Item> a{Item()}; std::vector<Item> b; b = a;",
        "a[0].t",
        "b[0].t",
    ),
    "a list in a structure": ("Box a; a.list.push_back(Item()); Box b = a;", "a.list[0].t", "b.list[0].t"),
}


@pytest.mark.parametrize(("made", "first", "second"), COPIES.values(), ids=COPIES)
def test_what_is_copied_is_another_one(made: str, first: str, second: str, tmp_path: Path) -> None:
    body = f'{made} {first} = "a"; {second} = "b"; {PUB}({first}, 1); {PUB}({second}, 1);'
    assert names(infer(tmp_path, in_class(body, NESTED))) == ["a", "b"]


def test_a_key_that_is_only_read_is_in_the_map_afterwards(tmp_path: Path) -> None:
    body = f'm_["a"]; int n = m_["b"]; for (auto & [k, v] : m_) {{ {PUB}(k, 1); }}'
    assert names(infer(tmp_path, in_class(body, "std::map<std::string, int> m_;"))) == ["a", "b"]


def test_a_pattern_with_an_unknown_variable_reads_nothing_outside_the_workspace(tmp_path: Path) -> None:
    """``${GENERATED}/**/*`` becomes ``/**/*``: every file of the machine."""
    folder = tmp_path / "demo"
    files = {"src/main.cpp": in_class(f'{PUB}("a", 1);'), "more/b.cpp": "", "more/deep/c.cpp": ""}
    package(
        folder,
        files,
        "file(GLOB_RECURSE found ${GENERATED}/*.cpp)\nadd_executable(node src/main.cpp ${found})",
    )
    assert names(infer_paths([folder])) == ["a"]
    patterns = (
        "GLOB_RECURSE found more/*.cpp",
        "GLOB found more/**/*.cpp",
        "GLOB found ${GENERATED}/**/*.cpp",
    )
    assert [len(_sources(folder, pattern)) for pattern in patterns] == [2, 1, 0]


def _sources(folder: Path, pattern: str) -> list[str]:
    (folder / "CMakeLists.txt").write_text(f"file({pattern})\nadd_executable(node ${{found}})")
    return read_build(str(folder)).targets["node"].sources


HALF_DONE = {
    "before a call that may throw": ('x = "b"; risky(); x = "c";', ["a", "b", "c"]),
    "of a copy": ("copied(x);", ["a"]),
    "of an object made meanwhile": ('Item made; made.t = "b"; risky();', ["a"]),
}


@pytest.mark.parametrize(("body", "made"), HALF_DONE.values(), ids=HALF_DONE)
def test_a_catch_finds_what_was_written_before_the_exception(
    body: str, made: list[str], tmp_path: Path
) -> None:
    before = (
        'void risky();\nstruct Item { std::string t; void set() { if (rand()) { t = "b"; throw 1; } } };\n'
        'void set(std::string & s, int n) { if (n) { s = "b"; throw 1; } }\n'
        'void always(std::string & s) { s = "b"; throw 1; }\nvoid copied(std::string s) { s = "b"; throw 1; }\n'
        'void further(std::string & s) { set(s, rand()); s = "c"; risky(); }\n'
    )
    program = f'std::string x = "a"; try {{ {body} }} catch (...) {{ }} {PUB}(x, 1);'
    assert names(infer(tmp_path, in_class(program, before=before))) == made


GUARDED = """#ifdef DEMO_DEBUG
#define GUARD(x) if (!(x)) abort()
#else
#define GUARD(x) {DEFINITION}
#endif
"""
MACROS = {
    "in every branch": (GUARDED.replace("{DEFINITION}", "{}"), "", []),
    "and undefines it": (GUARDED.replace("{DEFINITION}", "assert(x)"), "#undef GUARD", []),
    "as a publisher": (
        GUARDED.replace("{DEFINITION}", f'{PUB}("b", 1)'),
        "#undef GUARD",
        ["what the macro GUARD stands for here is not known; it may make interfaces"],
    ),
}


@pytest.mark.parametrize(("before", "after", "told"), MACROS.values(), ids=MACROS)
def test_a_macro_that_the_file_defines(before: str, after: str, told: list[str], tmp_path: Path) -> None:
    source = in_class(f'int x = 1; {PUB}("a", 1);\n  GUARD(x > 0);\n', before=before) + after
    assert sorted(set(gaps(infer(tmp_path, source)))) == told


@pytest.mark.parametrize("name", MACROS)
def test_a_macro_of_a_header(name: str, tmp_path: Path) -> None:
    before, _, told = MACROS[name]
    files = {
        "src/g.hpp": before,
        "src/main.cpp": in_class("\n  GUARD(x > 0);\n", before='#include "g.hpp"\n'),
    }
    assert sorted(set(gaps(infer_paths([package(tmp_path / "demo", files)])))) == told


def test_members_may_be_defined_under_a_name_that_a_using_declaration_brings_in(tmp_path: Path) -> None:
    files = {
        "include/wrapper.hpp": "#pragma once\n"
        + HEAD
        + "namespace drivers { class Wrapper : public rclcpp::Node {"
        " public: Wrapper(); void more(); static const char * topic; };"
        " class Other { public: void more(); }; }",
        "src/wrapper.cpp": '#include "wrapper.hpp"\nusing drivers::Wrapper;\n'
        'const char * Wrapper::topic = "b";\n'
        f'Wrapper::Wrapper() : Node("wrapper") {{ {PUB}("a", 1); more(); }}\n'
        f"void Wrapper::more() {{ {PUB}(topic, 1); }}",
        "src/main.cpp": '#include "wrapper.hpp"\nint main(int argc, char ** argv) { rclcpp::init(argc, argv);'
        " rclcpp::spin(std::make_shared<drivers::Wrapper>()); }",
    }
    cmake = "include_directories(include)\nadd_executable(node src/main.cpp src/wrapper.cpp)"
    system = infer_paths([package(tmp_path / "demo", files, cmake, ("rclcpp",))])
    assert gaps(system) == []
    assert [str(node.name) for node in system.nodes] == ["wrapper"]
    assert sorted(names(system)) == ["a", "b"]


@pytest.mark.parametrize(
    ("installed", "included", "found"),
    [
        ("DIRECTORY include/ DESTINATION include/${PROJECT_NAME}", "common/topics.hpp", True),
        ("DIRECTORY include DESTINATION include/${PROJECT_NAME}", "common/include/topics.hpp", True),
        ("DIRECTORY include/ DESTINATION include/other", "common/topics.hpp", False),
        ("DIRECTORY include/ DESTINATION share/${PROJECT_NAME}", "common/topics.hpp", False),
    ],
)
def test_a_header_of_another_package_is_included_by_the_name_that_it_is_installed_under(
    installed: str, included: str, found: bool, tmp_path: Path
) -> None:
    topics = {"include/topics.hpp": 'namespace topics { const std::string kMap{"map"}; }\n'}
    package(tmp_path / "common", topics, f"install({installed})")
    source = f"#include <{included}>\n" + in_class(f"{PUB}(topics::kMap, 1);")
    package(tmp_path / "demo", {"src/main.cpp": source}, depends=("rclcpp", "common"))
    system = infer_paths([tmp_path])
    assert (names(system) == ["map"]) == found


def test_what_another_middleware_subscribes_is_none_of_ros(tmp_path: Path) -> None:
    body = f'{PUB}("a", 1); lcm_.subscribe("b", 1, this);'
    assert not gaps(infer(tmp_path, in_class(body, "lcm::LCM lcm_;", "#include <lcm/lcm-cpp.hpp>\n")))
    other = in_class(body.replace("lcm_", "acme_"), "acme::Bus acme_;", "#include <acme/bus.hpp>\n")
    assert any("acme::Bus" in why for why in gaps(infer(tmp_path / "other", other)))


def test_a_copy_of_nlohmann_json_is_not_read(tmp_path: Path) -> None:
    header = "// JSON for Modern C++\nnamespace nlohmann { class json { void start(rclcpp::Node * n) { $$$"
    source = '#include "own/json.hpp"\n' + in_class(f'nlohmann::json j; j.start(1); {PUB}("a", 1);')
    system = infer(tmp_path, source, include__own__json_hpp=header)
    assert (names(system), gaps(system)) == (["a"], [])
    other = header.replace("JSON for Modern C++", "ours").replace("$$$", f'n->{PUB}("b", 1); }} }}; }}')
    body = f'nlohmann::json j; j.start(this); {PUB}("a", 1);'
    source = '#include "own/json.hpp"\n' + in_class(body)
    assert names(infer(tmp_path / "other", source, include__own__json_hpp=other)) == ["a", "b"]


def test_methods_of_qt_know_nothing_of_ros(tmp_path: Path) -> None:
    source = in_class(f'{PUB}("a", 1); this->connect(1, 2, this); this->strange(this);')
    both = source.replace("public rclcpp::Node", "public QWidget, public rclcpp::Node")
    assert not gaps(infer(tmp_path, both))
    assert any("handed to Demo::strange()" in why for why in gaps(infer(tmp_path / "without", source)))


def test_a_loader_in_a_template_loads_the_plugins_that_the_program_names(tmp_path: Path) -> None:
    """Plugins of another base are not read: they are none of its."""
    source = in_class(
        'loader_.load("p::Speaker", this);',
        "Loader<p::Base> loader_;",
        '#include "p/base.hpp"\ntemplate <typename T> struct Loader {\n'
        '  pluginlib::ClassLoader<T> all{"p", "p::Base"};\n'
        "  void load(std::string name, rclcpp::Node * node) { all.createSharedInstance(name)->start(node); }\n};\n",
    )
    package(tmp_path / "demo", {"src/main.cpp": source}, depends=("rclcpp", "p"))
    speaker = (
        '#include "p/base.hpp"\nnamespace p { class Speaker : public Base { '
        f'void start(rclcpp::Node * n) override {{ n->{PUB}("a", 1); }} }}; }}\n'
        "PLUGINLIB_EXPORT_CLASS(p::Speaker, p::Base)\n"
    )
    files = {
        "include/p/base.hpp": "namespace p { class Base { public: virtual void start(rclcpp::Node * n) = 0; }; }\n",
        "src/speaker.cpp": HEAD + speaker,
        "plugins.xml": '<library path="p"><class type="p::Speaker" base_class_type="p::Base"/></library>',
    }
    cmake = "add_library(p src/speaker.cpp)\npluginlib_export_plugin_description_file(p plugins.xml)"
    package(tmp_path / "p", files, cmake)
    assert endpoints(infer_paths([tmp_path])) == {("publisher", "a")}


BRACES = {
    "of texts, the inner ones left out": ('std::array<std::string, 2> all{"a", "b"};', "e", ["a", "b"]),
    "of one structure": ('std::array<E, 1> all{E{"a", 1}};', "e.t", ["a"]),
}


@pytest.mark.parametrize(("made", "name", "expected"), BRACES.values(), ids=BRACES)
def test_the_inner_braces_of_an_array_hold_its_elements(
    made: str, name: str, expected: list[str], tmp_path: Path
) -> None:
    use = f"{made} for (const auto & e : all) {{ create_publisher<std_msgs::msg::String>({name}, 1); }}"
    before = "struct E { std::string t; int n; };\n"
    assert names(infer(tmp_path, in_class(use, before=before))) == expected


RANGES = {
    "turned round in a list": ("std::vector<std::string> r(v.rbegin(), v.rend()); s = r[0];", ["b"]),
    "by an algorithm": ("std::for_each(v.begin(), v.end(), [&](auto & t) { s += t; });", ["?"]),
}


def test_a_byte_order_mark_hides_no_include(tmp_path: Path) -> None:
    program = '\ufeff#include "own.hpp"\n' + in_class(f"{PUB}(OWN, 1);")
    system = infer_paths(
        [package(tmp_path / "demo", {"src/main.cpp": program, "src/own.hpp": '#define OWN "own"\n'})]
    )
    assert names(system) == ["own"] and gaps(system) == []


PAIRS = {
    "of texts": (
        'std::vector<std::pair<std::string, std::string>> v; v.emplace_back("a", "b");',
        "second",
        "ab",
    ),
    "of a text and a pointer": (
        'E e; std::vector<std::pair<std::string, E *>> v; v.emplace_back("a", &e); e.t = "late";',
        "second->t",
        "alate",
    ),
}


@pytest.mark.parametrize(("made", "second", "name"), PAIRS.values(), ids=PAIRS)
def test_a_pair_made_in_a_list_holds_what_it_is_given(
    made: str, second: str, name: str, tmp_path: Path
) -> None:
    use = f"{made} {PUB}(v[0].first + v[0].{second}, 1);"
    assert names(infer(tmp_path, in_class(use, before='struct E { std::string t = "x"; };\n'))) == [name]


@pytest.mark.parametrize("own", [False])
def test_a_message_is_not_the_class_of_the_same_name(own: bool, tmp_path: Path) -> None:
    late = f'namespace msg {{ struct Imu {{ explicit Imu(rclcpp::Node * n) {{ n->{PUB}("late", 1); }} }}; }}'
    before = f"""namespace own {{
{late if own else ""}
struct Sensor {{ virtual void publish() = 0; }};
struct Imu : Sensor {{
  explicit Imu(rclcpp::Node * node) : n(node), pub(n->{PUB}("imu", 1)) {{}}
  void publish() override {{ pub->publish({"own::msg::Imu(n)" if own else "sensor_msgs::msg::Imu()"}); }}
  rclcpp::Node * n; rclcpp::Publisher<std_msgs::msg::String>::SharedPtr pub;
}};
}}
"""
    use = "all.push_back(new own::Imu(this)); create_wall_timer(1s, [this]() { for (auto s : all) { s->publish(); } });"
    system = infer(tmp_path, in_class(use, "std::list<own::Sensor *> all;", before=before))
    assert "imu" in names(system)
    assert ("late" in names(system) or bool(gaps(system))) == own
