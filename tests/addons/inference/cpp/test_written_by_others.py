"""What is written through references, pointers, algorithms and unknown code, and what a copy keeps."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

S = "std_msgs::msg::String"


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
    use = f"std::vector<B> v{{B()}}; B b; {body} create_publisher<std_msgs::msg::String>(b.t, 1);"
    assert {"a", "?"} & set(names(infer(tmp_path, in_class(use, before=before))))


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
    system = infer(tmp_path, source)
    assert names(system) == ["?"] or [gap.partition(":")[0] for gap in gaps(system)] == [why]


def test_a_text_whose_address_is_kept_is_not_known(tmp_path: Path) -> None:
    members = 'std::string t = "a", u = "b"; const std::string * p = nullptr;'
    found = infer(
        tmp_path, in_class(f"p = &t; create_publisher<{S}>(t, 1); create_publisher<{S}>(u, 1);", members)
    )
    assert (names(found), gaps(found)) == (["?", "b"], [])


def test_a_number_that_unknown_code_gets_as_a_variable_may_be_another_one(tmp_path: Path) -> None:
    body = f'int n = 0; acme::read(n); create_publisher<{S}>("t" + std::to_string(n), 1);'
    assert names(infer(tmp_path, in_class(body))) == ["t?"]


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


KEPT = {
    "a number behind a member that is a pointer": (
        "int n = 0; Flag f{&n}; f.mine[0] = 1;",
        "std::to_string(n)",
        "what f.mine[0] refers to is written",
    ),
    "an array of its own": ("int n[2] = {0, 0}; n[1] = 7;", "std::to_string(n[1])", ""),
    "a text that an unknown class may keep": ('std::string t = "x"; acme::Keeper k(t); t = "a";', "t", ""),
    "a constant that it may keep": ('const std::string t = "a"; acme::Keeper k(t);', "t", ""),
}


@pytest.mark.parametrize(
    ("kept", "made"),
    [
        ("a number behind a member that is a pointer", ["?"]),
        ("an array of its own", ["7"]),
        ("a text that an unknown class may keep", ["?"]),
        ("a constant that it may keep", ["a"]),
    ],
)
def test_what_somebody_may_write_later_is_told_or_open(kept: str, made: list[str], tmp_path: Path) -> None:
    body, name, why = KEPT[kept]
    before = "#include <acme/keeper.hpp>\nstruct Flag { int * mine; };\n"
    system = infer(tmp_path, in_class(f"{body} create_publisher<{S}>({name}, 1);", before=before))
    assert names(system) == made
    assert not why or any(why in each for each in gaps(system))


ORDERS = {
    "the last of an unordered map": ("std::unordered_map", "last = k;", "last", ["?"]),
    "the last of a map": ("std::map", "last = k;", "last", ["?"]),
    "each of an unordered map": ("std::unordered_map", "pub(k);", '"c"', ["a", "b", "c"]),
}


@pytest.mark.parametrize(("container", "turn", "name", "made"), ORDERS.values(), ids=ORDERS)
def test_the_order_of_an_unordered_container_is_not_known(
    container: str, turn: str, name: str, made: list[str], tmp_path: Path
) -> None:
    entries = f'{container}<std::string, int> m{{{{"b", 1}}, {{"a", 2}}}}; std::string last = "x";'
    body = f"{entries} for (auto & [k, v] : m) {{ {turn} }} create_publisher<{S}>({name}, 1);"
    pub = f"void pub(const std::string & t) {{ create_publisher<{S}>(t, 1); }}"
    assert names(infer(tmp_path, in_class(body, pub))) == made


LOOPS = {
    "that gives them to its own code": ("look(t);", ["a", "b"]),
    "that gives them to a class of its own": ("kept_.push_back(std::make_shared<Keep>(t));", ["a", "b"]),
    "that writes to them": ('t += "_x";', ["?"]),
    "that writes to them and ends": ('if (t == given) { t = "c"; break; }', ["?"]),
}


@pytest.mark.parametrize(("turn", "made"), LOOPS.values(), ids=LOOPS)
def test_a_loop_writes_to_its_elements_where_it_does(turn: str, made: list[str], tmp_path: Path) -> None:
    before = "struct Keep { std::string t; explicit Keep(const std::string & s) : t(s) {} };\n"
    before += "void look(const std::string &) {}\n"
    members = 'std::vector<std::string> all_{"a", "b"}; std::vector<std::shared_ptr<Keep>> kept_;'
    body = f'auto given = std::string(getenv("X")); for (auto & t : all_) {{ {turn} }}'
    use = f"{body} for (const auto & t : all_) {{ create_publisher<{S}>(t, 1); }}"
    assert names(infer(tmp_path, in_class(use, members, before))) == made


THROUGH_A_LIST = {
    "of pointers": 'std::vector<std::string *> v{&t}; for (auto p : v) { *p += "_x"; }',
    "of pointers, by a method": 'std::vector<std::string *> v{&t}; for (auto p : v) { p->append("_x"); }',
    "of references": 'std::vector<std::reference_wrapper<std::string>> v{t}; for (std::string & r : v) { r += "_x"; }',
}


@pytest.mark.parametrize("body", THROUGH_A_LIST.values(), ids=THROUGH_A_LIST)
def test_what_is_written_through_a_list_of_pointers_is_told(body: str, tmp_path: Path) -> None:
    use = f'std::string t = "a"; {body} create_publisher<{S}>(t, 1);'
    assert names(infer(tmp_path, in_class(use))) == ["?"]
    only_read = (
        use.replace("*p += ", "look(*p) + ").replace("append", "compare").replace("r += ", "look(r) + ")
    )
    assert gaps(infer(tmp_path / "read", in_class(only_read))) == []


DESTROYED = {
    "writes to what it refers to": ("s += 1;", ["~G changes what others have: when it runs is not followed"]),
    "sets its own pointer": ("p = nullptr;", []),
    "writes to its own member": ("own = 1;", []),
}


@pytest.mark.parametrize(("body", "told"), DESTROYED.values(), ids=DESTROYED)
def test_a_destructor_that_changes_what_others_have_is_told(
    body: str, told: list[str], tmp_path: Path
) -> None:
    before = f"struct G {{ int & s; int * p = nullptr; int own = 0; ~G() {{ {body} }} }};\n"
    assert gaps(infer(tmp_path, in_class("int n = 0; { G g{n}; }", before=before))) == told


FROM_ELSEWHERE = {
    "an iterator to the first": ('std::vector<std::string> v{"a"};', "auto it = v.begin();", "*it"),
    "a reference to an element": ('std::vector<std::string> v{"a"};', "auto & it = v.front();", "it"),
    "a reference that a method gives": (
        "std::vector<std::string> & v = kept();",
        "auto & it = kept()[0];",
        "it",
    ),
    "names of a structured binding": (
        'auto v = std::make_pair(std::string("a"), 1);',
        "auto & [it, n] = v;",
        "it",
    ),
}
FIRST = {"std::map<std::string, std::string> v": 'v.at("k")', "auto v": "v.first"}


@pytest.mark.parametrize(("made", "seen", "name"), FROM_ELSEWHERE.values(), ids=FROM_ELSEWHERE)
def test_what_is_written_from_elsewhere_is_not_known_and_stays_known_if_it_is_not(
    made: str, seen: str, name: str, tmp_path: Path
) -> None:
    first = FIRST.get(re.split(r"[{=]", made)[0].strip(), "v[0]")
    members = 'std::vector<std::string> l_{"a"}; std::vector<std::string> & kept() { return l_; }'
    use = f"{made} {seen} {{}} create_publisher<{S}>({first}, 1);"
    written = infer(tmp_path / "written", in_class(use.replace("{} ", f'{name} = "b"; '), members))
    assert set(names(written)) <= {"?", "b"} or gaps(written)
    assert names(infer(tmp_path / "read", in_class(use.replace("{} ", ""), members))) == ["a"]


def test_what_an_iterator_shows_may_have_changed_since(tmp_path: Path) -> None:
    body = 'std::map<std::string, std::string> m{{"k", "a"}}; auto it = m.find("k");'
    use = f"create_publisher<{S}>(it->second, 1);"
    assert names(infer(tmp_path, in_class(f'{body} m["k"] = "b"; {use}'))) == ["?"]


def test_what_a_function_writes_behind_a_pointer_into_an_array_is_not_known(tmp_path: Path) -> None:
    before = 'void up(std::string * p, size_t n) { for (size_t i = 0; i < n; ++i) { p[i] = "b"; } }\n'
    use = f"create_publisher<{S}>(a[1], 1);"
    for call, made in (("up(a + 1, 1);", ["?"]), ("", ["a"])):
        body = f'std::string a[] = {{"z", "a"}}; {call} {use}'
        assert names(infer(tmp_path / str(len(call)), in_class(body, before=before))) == made


TWICE = {
    "twice": "both(t, t);",
    "and by a reference to it": "std::string & r = t; both(r, t);",
    "by two references to it": "std::string & r = t; std::string & q = r; both(q, r);",
}


@pytest.mark.parametrize("body", TWICE.values(), ids=TWICE)
def test_a_variable_that_a_function_gets_twice_is_open(body: str, tmp_path: Path) -> None:
    both = "void both(std::string & a, const std::string & b) { a += b; a += b; }\n"
    use = 'std::string t = "x"; %s create_publisher<std_msgs::msg::String>(t, 1);'
    assert names(infer(tmp_path, in_class(use % body, before=both))) == ["?"]
    other = use % 'std::string u = "y"; both(t, u);'
    assert names(infer(tmp_path / "other", in_class(other, before=both))) == ["xyy"]


BESIDES = {
    "a constructor": "Acc a(t);",
    "an object without a name": "Acc{t};",
    "a method of what a method gives": 't.append("y").append(t, 0, 1);',
    "a method of an element": "std::vector<std::string> v{t}; v.back().append(t, 0, 1); t = v.back();",
}


@pytest.mark.parametrize("body", BESIDES.values(), ids=BESIDES)
def test_what_is_written_without_being_followed_is_not_the_text_before(body: str, tmp_path: Path) -> None:
    before = 'struct Acc { Acc(std::string & a) { a += "y"; } };\n'
    use = f'std::string t = "x", u = "u"; {body} create_publisher<std_msgs::msg::String>(t + u, 1);'
    assert names(infer(tmp_path, in_class(use, before=before))) == ["?u"]
