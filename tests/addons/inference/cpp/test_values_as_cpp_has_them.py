"""Names that a program computes as C++ does; what was read otherwise before is not in the result, or is not certain.

What each program makes was had by running it on rclcpp.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import HEAD, gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "void pub(std::string t) { create_publisher<std_msgs::msg::String>(t, 1); }\n"


def certain(tmp_path: Path, source: str) -> set[str]:
    """Names that are known in full."""
    system = infer(tmp_path, source)
    return {e.name.text for node in system.nodes for e in node.endpoints if e.name.is_literal}


# what the constructor does, members and classes before it, what is made, what is not
PROGRAMS: dict[str, tuple[str, str, str, set[str], set[str]]] = {
    "a capture by reference sees later values, one by value does not": (
        'std::string t = "one"; auto v = [this, t]() { pub(t + "_v"); }; auto r = [this, &t]() { pub(t + "_r"); };'
        't = "two"; v(); r();',
        "", "", {"one_v", "two_r"}, {"one_r", "two_v"},
    ),
    "a name in a block ends with the block": (
        'std::string t = "outer"; { std::string t = "inner"; pub(t + "_b"); } pub(t);'
        'for (int i = 0; i < 1; ++i) { auto t = std::string("loop"); pub(t + "_l"); } pub(t + "_2");',
        "", "", {"inner_b", "outer", "loop_l", "outer_2"}, {"inner", "loop", "loop_2", "inner_2"},
    ),
    "behind a block the member of that name is meant again": (
        'for (int i = 0; i < 1; ++i) { auto topic = std::string("local"); pub(topic); } pub(topic + "_m");',
        'std::string topic = "member";', "", {"local", "member_m"}, {"local_m"},
    ),
    "a static variable of a function keeps its value": (
        "next(); next();", 'void next() { static int i = 0; pub("s" + std::to_string(i++)); }', "",
        {"s0", "s1"}, set(),
    ),
    "a text beside a number is a pointer that moves on": (
        'const char * t = "abcd"; pub(t + 1); std::string k = "k"; k += \'a\' + 1; pub(k);',
        "", "", set(), {"abcd", "abcd1", "k", "ka1", "k1"},
    ),
    "a member that a helper has under the same name is another variable": (
        'helper.configure(name_); pub(name_ + "_own");', 'std::string name_ = "n"; Helper helper{*this};',
        'struct Helper { rclcpp::Node & node; std::string name_; rclcpp::Publisher<std_msgs::msg::String>::SharedPtr p;'
        ' void configure(const std::string & name) { name_ = "h"; use(name); }'
        ' void use(const std::string & name) { p = node.create_publisher<std_msgs::msg::String>(name + "/p", 1); } };',
        {"n/p", "n_own"}, {"h/p"},
    ),
    "the member that the node's own function writes is the one that it was given": (
        "show(name_);",
        'std::string name_ = "n"; void show(const std::string & name) { name_ = "m"; pub(name + "/p"); }',
        "", set(), {"n/p"},
    ),
    "a list has as many elements as resize() says, new ones empty or as they are given": (
        'std::vector<std::string> v{"a"}; v.resize(3); v[1] = "b"; for (auto & t : v) { pub("v_" + t); }'
        'v.resize(1); pub("n" + std::to_string(v.size())); v.resize(2, "c"); pub(v[1]);',
        "", "", {"v_a", "v_b", "v_", "n1", "c"}, {"b", "n3", "v_c"},
    ),
    "how many elements resize() leaves is not known where its number is not": (
        'std::vector<std::string> v{"a", "b"}; v.resize(now().nanoseconds() % 2);'
        'for (auto & t : v) { pub("v_" + t); }',
        "", "", set(), {"v_a", "v_b"},
    ),
    "a list that a loop fills holds what any of its turns adds": (
        'std::vector<std::string> v; while (now().nanoseconds() % 2) { std::string t = "a"; v.push_back(t); }'
        "for (auto & t : v) { pub(t); }",
        "", "", {"a"}, set(),
    ),
    "closures that are made at one place keep what each was made with": (
        'std::string s = "a"; std::vector<std::function<void()>> made; int i = 2 + now().nanoseconds() % 2;'
        'while (i-- > 0) { std::string t = "t_" + s; made.push_back([this, t]() { pub(t); }); s = "b"; }'
        "for (auto & f : made) { f(); }",
        "", "", {"t_a", "t_b"}, set(),
    ),
    "numbers are those of their types": (
        'uint8_t u = 250; u += 10; pub("u" + std::to_string(u)); pub("d" + std::to_string(-7 / 2 + 9));'
        'bool b = 3; pub("b" + std::to_string(b)); int n = 2; pub("n" + std::to_string(n));'
        'int k = 4; k <<= 1; pub("k" + std::to_string(k)); pub("c" + std::to_string(\'a\'));',
        "", "", {"b1", "n2"}, {"u260", "d5", "d6.5", "b3", "n2.900000", "k4", "ca"},
    ),
    "numbers are read in every base, with their suffixes": (
        'pub("h" + std::to_string(0X1F)); pub("i" + std::to_string(0x1fUL)); pub("o" + std::to_string(017));'
        'pub("b" + std::to_string(0B101)); pub("t" + std::to_string(1\'000u)); pub("z" + std::to_string(0));',
        "", "", {"h31", "i31", "o15", "b5", "t1000", "z0"}, {"h1", "o17", "b101"},
    ),
    "std::string(3, 'a') is three letters, not the number 3": (
        "pub(std::string(3, 'a')); std::string s(2, 'b'); pub(s);", "", "", set(), {"3", "2", "a", "b"},
    ),
    "letters are written as numbers": (r'pub("\x61\142c");', "", "", {"abc"}, {"x61142c"}),
    "a stream that writes in another way is not known": (
        'std::ostringstream h; h << "h" << std::hex << 255; pub(h.str());', "", "", set(), {"h255"},
    ),
    "an algorithm may change what it gets": (
        'std::string r = "rev"; std::reverse(r.begin(), r.end()); pub(r); std::string p = "a.b";'
        "std::replace(p.begin(), p.end(), '.', '_'); pub(p); std::stringstream s; std::getline(s, line_); pub(line_);",
        'std::string line_ = "kept";', "", set(), {"rev", "a.b", "kept"},
    ),
    "lists change as they are told to": (
        'std::vector<std::string> v{"a", "b"}; v.erase(v.begin()); v.insert(v.begin(), "c");'
        'for (size_t i = 0; i < v.size(); i++) pub(v[i] + std::to_string(i)); v.pop_back(); pub("n" + v.back());',
        "", "", set(), {"a0", "nb"},
    ),
    "how many a set holds is not known, nor which value a key has": (
        'std::set<std::string> s{"y", "x", "x"}; pub("n" + std::to_string(s.size()));'
        'std::map<std::string, std::string> m; m["a"] = "1"; m.insert({"a", "2"}); m.emplace("b", "3"); m.erase("b");'
        'for (auto & [k, v] : m) pub(k + v);',
        "", "", set(), {"n3", "a2", "b3"},
    ),
    "texts change as they are told to": (
        'std::string s = "base"; s.insert(0, "x_"); pub(s); s.erase(0, 2); s.pop_back(); pub(s);'
        's.replace(0, 1, "f"); pub(s);',
        "", "", set(), {"base"},
    ),
    "arrays of C are lists": (
        'for (auto e : names) pub(e); pub(names[1] + std::string("_1")); for (const auto & c : cfg) pub(c.t);',
        'struct C { std::string t; int n = 0; }; const C cfg[2] = {{"c0"}, {"c1", 2}};',
        'static const char * names[] = {"n0", "n1"};\n', {"n0", "n1", "n1_1", "c0", "c1"}, {"n", "0"},
    ),
    "enumerators of one enumeration differ, unless one is another": (
        'Side s = Side::Left; if (s == Side::Right) pub("right"); Twin t = Same; if (t == One) pub("one");'
        'pub("p" + std::to_string(One));',
        "", "enum class Side { Left, Right }; enum Twin { One = 1, Same = One };\n", {"one"}, {"right", "p1"},
    ),
    "a switch takes the case of its enumerator, and all that may be meant of a number that is not known": (
        'switch (Side::Right) { case Side::Left: pub("left"); break; default: pub("right"); }'
        'switch (get()) { case 1: pub("one"); break; case 2: pub("two"); }',
        "", "enum class Side { Left, Right };\n", {"right", "one", "two"}, {"left"},
    ),
    "a constructor calls no method of a derived class": (
        "Derived d(this);", "",
        "struct Base { explicit Base(rclcpp::Node * n) : n_(n) { go(); } virtual void go() { make(\"base\"); }\n"
        "void make(std::string t) { n_->create_publisher<std_msgs::msg::String>(t, 1); } rclcpp::Node * n_; };\n"
        'struct Derived : Base { using Base::Base; void go() override { make("derived"); } };\n',
        {"base"}, {"derived"},
    ),
    "a global and a cast are of the class that is written there": (
        "D d; pub(made.text()); pub(S::held.text()); pub(static_cast<B>(d).text() + \"_c\");"
        "pub(static_cast<const B &>(d).text() + \"_r\");", "",
        'struct B { virtual std::string text() const { return "base"; } };\n'
        'struct D : B { std::string text() const override { return "derived"; } };\n'
        "struct S { static B held; }; B S::held = D(); static B made = D();\n",
        {"base", "base_c", "derived_r"}, {"derived", "derived_c"},
    ),
    "what a global or static member is made with may change another one": (
        'pub("n" + std::to_string(count)); pub(who); pub(level);', "",
        "int count = 0; static int last = count++; static int twice = ++count;\n"
        'std::string who = "nobody"; struct Y { static bool set() { who = "y"; return true; }\n'
        "inline static bool r = set(); };\n"
        'std::string level = "info"; struct Z { static bool set() { level = "debug"; return true; } static bool r; };\n'
        "bool Z::r = set();\n",
        {"n2", "y", "debug"}, {"n0", "nobody", "info"},
    ),
    "a static method calls another one of its class, of a base or of a class around by its name alone": (
        "Y::set(); Y::In().more(); pub(who + Y::get());", "",
        'std::string who = "nobody"; struct X { static std::string end() { return "/end"; } };\n'
        'struct Y : X { static void set() { to("y"); } static void to(std::string t) { who = t; }\n'
        "static std::string get() { return end(); } struct In { void more() { to(who + who); } }; };\n",
        {"yy/end"}, {"nobody/end", "y/end"},
    ),
    "a constant of the class around is nearer than a global": (
        "pub(H::In::get()); pub(kT);", "",
        'const char * const kT = "outer";\n'
        'struct H { static constexpr const char * kT = "member";\n'
        "struct In { static std::string get() { return kT; } }; };\n",
        {"member", "outer"}, set(),
    ),
    "an array as a parameter is a pointer": (
        'std::string a[2] = {"a", "b"}; rename(a); pub(a[0]);', "",
        'void rename(std::string names[]) { names[0] = "renamed"; }\n', {"renamed"}, {"a"},
    ),
    "a number is held as its type has it": (
        'P p{300}; pub("a" + std::to_string(p.a)); p.a = 257; pub("b" + std::to_string(p.a)); H h(5);'
        'pub("h" + std::to_string(h.truth)); pub("s" + std::to_string(small(260))); show(7);'
        'std::vector<uint8_t> v; v.push_back(280); pub("v" + std::to_string(v[0])); p.bits = 9;'
        'pub("f" + std::to_string(p.bits)); p.wide = 12; pub("w" + std::to_string(p.wide));',
        'void show(double x) { pub("d" + std::to_string(x)); }',
        "struct P { uint8_t a = 0; unsigned bits : 2; int wide = 0; };\n"
        "struct H { explicit H(int x) : truth(x) {} bool truth; }; uint8_t small(int x) { return x; }\n",
        {"h1", "w12"}, {"a300", "b257", "h5", "s260", "v280", "d7", "f9"},
    ),
    "a std::atomic is written by its methods": (
        'int e = 1; k_.store(2); pub("a" + std::to_string(k_)); n_.fetch_add(2); pub("n" + std::to_string(n_));'
        'm_.compare_exchange_strong(e, 9); pub("m" + std::to_string(m_)); pub("e" + std::to_string(e));'
        'pub("l" + std::to_string(l_.load()) + std::to_string(l_));',
        "std::atomic<int> k_{0}, n_{0}, m_{0}, l_{3};", "", set(), {"a0", "n0", "m0", "e1"},
    ),
    "a fold writes what nobody knows": (
        'std::string s = "s"; add(s, "x", "y"); pub(s);', "",
        "template <typename... T> void add(std::string & s, const T &... p) { (s.append(p), ...); }\n", set(), {"s"},
    ),
    "a method of a library may write to the variable that it gets": (
        'acme::Reader r; std::string a = "a"; r.read(a); pub(a); auto q = acme::make(); std::string b = "b";'
        'q->take(b); pub(b); const std::string c = "c"; q->take(c); pub(c);',
        "", "", {"c"}, {"a", "b"},
    ),
    "a destructor may have written to a global": (
        '{ auto p = std::make_unique<D>(); } pub("l" + text); pub("o" + other);', "",
        'std::string text; std::string other = "x"; struct B { ~B() { text += "B"; } };\n'
        "struct C : B {}; struct D { C c; };\n",
        {"ox"}, {"l"},
    ),
    "a loop by reference over an object with iterators of its own writes to what it holds": (
        'R r, q; for (auto & s : r) { s += "_r"; } pub(r.v[0]); for (const auto & s : q) { (void)s; } pub(q.v[1]);', "",
        'struct R { std::vector<std::string> v{"x", "y"};\n'
        "auto begin() { return v.begin(); } auto end() { return v.end(); } };\n",
        {"y"}, {"x"},
    ),
    "a global is made before main of what others held then": (
        'first = "later"; pub(second); pub(S::held); pub(S::own); pub(kept); pub(same_);', 'std::string same_ = first;',
        'std::string first = "first", second = first, other = "other", kept = other + "_k";\n'
        'struct S { inline static std::string held = first, w = "w"; inline static std::string own = w + "_o"; };',
        {"other_k", "first", "w_o"}, {"later"},
    ),
    "changes of a text in a row": (
        'std::string t = "a"; t.append("b").append("c"); pub(t); t.append("d").insert(0, "x"); pub(t + "_e");',
        "", "", set(), {"a", "ab", "abcd_e"},
    ),
    "other arguments say which constructor a literal is for": (
        'H h(1, "", "n"); pub(h.t);', "",
        "struct H { std::string t; H(int, std::string, std::string n) : t(n) {}\n"
        'H(int, std::string, bool, std::string) : t("long") {} H(int, bool, int) : t("number") {} };\n',
        {"n"}, {"long", "number"},
    ),
    "several variables of one declaration": (
        'std::string q = "q"; H a(1), b(q); pub(a.t); pub(b.t + "_2"); pub(x_); pub(y_); pub(z_);',
        'std::string x_, y_ = "given", z_{"last"};',
        'struct H { std::string t; explicit H(int) : t("number") {} explicit H(std::string s) : t(s) {} };\n',
        {"number", "q_2", "given", "last"}, set(),
    ),
    "members of one declaration have a value each": (
        'pub(x_.t); pub(y_.t + "_2");', 'S x_, y_{std::string("m")};',
        'struct S { std::string t = "d"; S() {} explicit S(std::string s) : t(s) {} };\n', {"d", "m_2"}, {"m", "d_2"},
    ),
    "a copy of an object that holds a node is another object": (
        'B b(this); b.with("x").build(); b.in_brackets("y").build(); B c = b; c.t = "c"; c.build(); b.build();', "",
        'struct B { rclcpp::Node * n; std::string t = "none"; explicit B(rclcpp::Node * n) : n(n) {}\n'
        "B with(std::string x) const { B c = *this; c.t = x; return c; }\n"
        "B in_brackets(std::string x) const { B c(*this); c.t = x; return c; }\n"
        "void build() const { n->create_publisher<std_msgs::msg::String>(t, 1); } };\n",
        {"x", "y", "c", "none"}, set(),
    ),
    "a copy of a list has elements of its own": (
        "std::vector<S> v{S()}; std::vector<S> a = v, b(v), c(v.begin(), v.end()); H h{v};"
        'std::vector<S> d; d.assign(v.begin(), v.end()); H i; i.v = v; v[0].t = "kept";'
        'a[0].t = "a"; b[0].t = "b"; c[0].t = "c"; d[0].t = "e"; h.v[0].t = "h"; i.v[0].t = "i"; pub(v[0].t);'
        "pub(a[0].t); pub(b[0].t); pub(c[0].t); pub(d[0].t); pub(h.v[0].t); pub(i.v[0].t);", "",
        'struct S { std::string t = "d"; };\nstruct H { std::vector<S> v; };\n',
        {"kept", "a", "b", "c", "e", "h", "i"}, {"d"},
    ),
    "a pair and a bound call keep copies, but not of what a pointer shows": (
        'B a{this, "a"}; auto p = std::make_pair(1, a); p.second.t = "pair"; auto f = std::bind(&B::go, a);'
        'auto g = std::bind(&B::go, &b_); B * c = &b_; auto q = std::make_pair(1, c); a.t = "later"; b_.t = "shown";'
        'p.second.go(); f(); g(); q.second->go(); a.go();', "B b_{this, \"b\"};",
        "struct B { rclcpp::Node * n; std::string t;\n"
        "void go() { n->create_publisher<std_msgs::msg::String>(t, 1); } };\n",
        {"pair", "a", "shown", "later"}, {"b"},
    ),
    "elements that are swapped": (
        'std::vector<S> v{S(), S()}; v[1].t = "b"; std::swap(v[0], v[1]); pub(v[0].t + "_0"); pub(v[1].t + "_1");', "",
        'struct S { std::string t = "a"; };\n', set(), {"a_0", "b_1"},
    ),
    "an entry that is erased by its name is gone": (
        'std::map<std::string, std::string> m{{"a", "one"}, {"b", "two"}}; m.erase("a");'
        "for (auto & [k, v] : m) { pub(v); }",
        "", "", {"two"}, {"one"},
    ),
    "nothing follows a call that only throws": (
        'try { fail(); pub("dead"); } catch (...) { pub("caught"); }',
        'void fail() { throw std::runtime_error("x"); }', "", {"caught"}, {"dead"},
    ),
    "the value of structured names is computed once": (
        'auto [x, y] = std::make_pair(next(), 1); pub(x); pub(next() + "_then");',
        'int i = 0; std::string next() { return "s" + std::to_string(++i); }', "", {"s1", "s2_then"}, {"s2", "s3_then"},
    ),
    "structured names in a closure are those of the closure": (
        'auto f = [this]() { const auto & [a, b] = std::make_pair(std::string("in"), 1); pub(a);'
        'return std::string("out"); }; pub(f());',
        "", "", {"in", "out"}, set(),
    ),
    "a macro's argument is expanded before it is filled in": (
        'pub("m" TEXT(NUMBER)); pub(TEXT_(NUMBER));', "",
        "#define NUMBER 42\n#define TEXT_(x) #x\n#define TEXT(x) TEXT_(x)\n", {"m42", "NUMBER"}, {"mNUMBER"},
    ),
    "members of an aggregate use those before them": (
        'Agg a{this}; Agg b{this, "given"};', "",
        'struct Agg { rclcpp::Node * n; std::string t = "default";\n'
        "rclcpp::PublisherBase::SharedPtr p = n->create_publisher<std_msgs::msg::String>(t, 1); };\n",
        {"default", "given"}, set(),
    ),
    "a map makes its values": (
        'm_.try_emplace("a", this, "tried");',
        "std::map<std::string, H> m_;",
        "struct H { H(rclcpp::Node * n, std::string t) { n->create_publisher<std_msgs::msg::String>(t, 1); } };\n",
        {"tried"}, set(),
    ),
    "a method in a table gets its object with the call": (
        'table.at("a")(this);',
        'void a() { pub("of_a"); } const std::map<std::string, std::function<void(Demo *)>> table{{"a", &Demo::a}};',
        "", {"of_a"}, set(),
    ),
    "bound arguments arrive where they are bound": (
        'std::thread t(&Demo::one, this, "thread"); std::mem_fn(&Demo::one)(*this, "mem");'
        'auto b = std::bind(&Demo::two, this, std::placeholders::_2, std::placeholders::_1); b("p", "q");',
        "void one(const char * x) { pub(x); } void two(const char * a, const char * b) "
        '{ pub(std::string(a) + "_" + b); }',
        "", {"thread", "mem"}, {"p_q"},
    ),
    "a literal with a suffix of the program's own": (
        'pub("abc"_t);', "", 'std::string operator""_t(const char * c, size_t) { return std::string(c) + "_t"; }\n',
        set(), {"abc"},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "members", "before", "made", "not_made"), PROGRAMS.values(), ids=PROGRAMS)
def test_names_are_those_of_the_run(
    body: str, members: str, before: str, made: set[str], not_made: set[str], tmp_path: Path
) -> None:
    found = certain(tmp_path, in_class(body, PUB + members, before))
    assert made <= found
    assert not not_made & found


TEXT = 'std::string f(std::string) { return "text"; }\n'
FOR_A_TEXT = {
    "letters": ('pub(f("x"));', 'std::string f(const char *) { return "letters"; }' + TEXT),
    "a condition": ('pub(f("x"));', 'std::string f(bool) { return "true"; }' + TEXT),
    "anything": ('pub(f("x"));', 'template <class T> std::string f(const T &) { return "any"; }' + TEXT),
    "a constructor": (
        'H a("lit"); pub(a.t);',
        'struct H { std::string t; explicit H(bool) : t("true") {} explicit H(std::string s) : t(s) {} };\n',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "before"), FOR_A_TEXT.values(), ids=FOR_A_TEXT)
def test_whether_a_literal_is_rather_for_this_or_for_a_text_is_not_known(
    body: str, before: str, tmp_path: Path
) -> None:
    system = infer(tmp_path, in_class(body, PUB, before))
    assert names(system) == ["?"] or any("is meant here is not known" in why for why in gaps(system))


C_CALLS = {
    "on the handle of a node": (
        'rcl_publisher_init(&p_, get_node_base_interface()->get_rcl_node_handle(), ts, "c_pub", &o);'
    ),
    "on a node of C": 'rcl_service_init(&s_, &node_, ts, "c_srv", &o);',
    "that makes the node": 'rcl_node_init(&node_, "n", "", &context, &o);',
    "of rclc": 'rclc_publisher_init_default(&p_, &node_, ts, "c_pub");',
}  # fmt: skip


@pytest.mark.parametrize("call", C_CALLS.values(), ids=C_CALLS)
def test_a_call_of_c_that_makes_an_interface_is_a_gap(call: str, tmp_path: Path) -> None:
    assert any("_init" in why for why in gaps(infer(tmp_path, in_class(call))))


def test_what_is_no_interface_of_c_is_none(tmp_path: Path) -> None:
    system = infer(
        tmp_path, in_class("rcl_node_options_t o = rcl_node_get_default_options(); rcl_shutdown(&c);")
    )
    assert not gaps(system)


def test_parameters_and_options_that_the_program_gives_its_node(tmp_path: Path) -> None:
    node = 'class Demo : public rclcpp::Node { public: explicit Demo(const rclcpp::NodeOptions & o) : Node("n", o) {\n'
    node += 'create_publisher<std_msgs::msg::String>(declare_parameter("t", "default"), 1); } };\n'
    by_flag = 'auto o = rclcpp::NodeOptions().arguments({"--ros-args", "-p", "t:=flag"}); Demo d(o);'
    beside = by_flag.replace(
        '"t:=flag"', '"t:=flag", "-p", "use_sim_time:=" + std::string(x() ? "true" : "false")'
    )
    by_reference = 'rclcpp::NodeOptions o; o.parameter_overrides() = {{"t", "reference"}}; Demo d(o);'
    for number, (body, expected) in enumerate(
        ((by_flag, "flag"), (beside, "flag"), (by_reference, "reference"))
    ):
        system = infer(tmp_path / str(number), HEAD + node + f"int main() {{ {body} }}\n")
        assert {e.name.fill({}).text for each in system.nodes for e in each.endpoints} == {expected}
        assert not gaps(system)


def test_what_is_written_through_a_function_is_not_known(tmp_path: Path) -> None:
    members = 'std::string t_ = "a"; std::string & ref() { return t_; }\n' + PUB
    assert names(infer(tmp_path, in_class('ref() = "b"; pub(t_);', members))) == ["?"]


def test_what_is_written_to_an_array_of_numbers_is_none_and_never_known(tmp_path: Path) -> None:
    body = 'm_(0, 0) = declare_parameter("w", 1.0); m_(1, 1) = 0.0; if (m_(1, 1) > 0.5) { pub("sometimes"); } pub("b");'
    system = infer(tmp_path, in_class(body, "Eigen::Matrix3d m_;\n" + PUB))
    assert not gaps(system)
    assert {e.name.text for each in system.nodes for e in each.endpoints} == {"sometimes", "b"}


def test_an_element_that_is_made_of_pieces_is_a_gap(tmp_path: Path) -> None:
    body = 'm_.emplace(std::piecewise_construct, std::forward_as_tuple("b"), std::forward_as_tuple(this));'
    before = (
        'struct H { explicit H(rclcpp::Node * n) { n->create_publisher<std_msgs::msg::String>("t", 1); } };\n'
    )
    system = infer(tmp_path, in_class(body, "std::map<std::string, H> m_;", before))
    assert gaps(system)


LIFECYCLE = """
#include <rclcpp_lifecycle/lifecycle_node.hpp>
class Demo : public rclcpp_lifecycle::LifecycleNode {
public:
  Demo() : LifecycleNode("n") {}
  int on_configure(const rclcpp_lifecycle::State &) override { name_ = "arm"; return 0; }
  int on_activate(const rclcpp_lifecycle::State &) override {
    create_publisher<std_msgs::msg::String>(name_ + "/state", 1);
    return 0;
  }
  std::string name_;
};
int main() {
  auto n = std::make_shared<Demo>();
  std::thread t([] {});
  n->configure();
  rclcpp::spin(n->get_node_base_interface());
}
"""


def test_a_node_is_configured_before_it_is_activated(tmp_path: Path) -> None:
    """Also if its main program starts it: what a member holds before is in no name."""
    assert certain(tmp_path, HEAD + LIFECYCLE) == {"arm/state"}
