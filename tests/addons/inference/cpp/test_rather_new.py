"""Programs that make ``new`` when they are compiled and run, where an easy reading gives ``old``.

``COVERED``: ``new`` is listed, or a name is open, or there is a gap. ``KNOWN``: ``new`` alone is listed.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")

PUB = "void pub(const std::string & t) { create_publisher<std_msgs::msg::String>(t, 1); }\n"
EITHER = '{ pub("new"); } else { pub("old"); }'
FOUND = "std::optional<int> f(int k) { if (k < 0) { return std::nullopt; } return k; }"
CONFIG = 'struct C { std::string t = "new"; void set(const std::string & s) { t = s; } };\n'

# what the constructor does, what stands before its class
COVERED = {
    "an optional that holds zero is not empty": (f"if (auto id = f(0)) {EITHER}", FOUND),
    "an optional that holds false is not empty": (f"std::optional<bool> o = false; if (o) {EITHER}", ""),
    "nor is one that is a member": (f"C c; c.id = 0; if (c.id) {EITHER}", "struct C { std::optional<int> id; };"),
    "or an argument": ('pub(g(0) ? "new" : "old");', "bool g(std::optional<int> o) { return o ? true : false; }"),
    "or an element": (f"std::map<int, std::optional<int>> m; m[1] = 0; if (m[1]) {EITHER}", ""),
    "or turned into a condition": (f"auto o = f(0); bool b = static_cast<bool>(o); if (b) {EITHER}", FOUND),
    "a pointer to zero is set": (f"int z = 0; int * p = &z; if (p) {EITHER}", ""),
    "a pointer that is negated twice": (f"bool z = false; auto p = &z; if (!!p) {EITHER}", ""),
    "a pointer that is compared with zero": (f"int z = 0; int * p = &z; if (p != 0) {EITHER}", ""),
    "a pointer that a function gives as a condition": (
        f"int z = 0; if (is_set(&z)) {EITHER}", "bool is_set(int * p) { return p; }",
    ),
    "a pointer to an entry": (
        f"if (find(1)) {EITHER}",
        "std::map<int, int> m{{1, 0}}; const int * find(int k) { auto it = m.find(k); "
        "return it == m.end() ? nullptr : &it->second; }",
    ),
    "a closure that has a copy of its object": (
        "O o; pub(o.get());",
        'struct O { std::string n = "new"; std::string get() { auto f = [*this]() { return n; }; n = "old"; '
        "return f(); } };",
    ),
    "an optional of a base holds no derived object": (
        "std::optional<A> p; p = R(); pub(p->n());",
        'struct A { virtual std::string n() { return "new"; } };\n'
        'struct R : A { std::string n() override { return "old"; } };',
    ),
    "what noexcept asks does not run": ('std::string r = "new"; (void)noexcept(r = "old"); pub(r);', ""),
    "an assignment behind a question": (
        'int k = 1; std::string x; pub((k > 0 ? x = "new" : x = "old"));', "",
    ),
    "braces prefer a list": (
        "O o{1, 2}; pub(o.n);",
        'struct O { std::string n; O(int, int) : n("old") {} O(std::initializer_list<int>) : n("new") {} };',
    ),
    "a sum of letters is a number": (
        "pub(n('a' + 'b'));", 'std::string n(char) { return "old"; } std::string n(int) { return "new"; }',
    ),
    "an algorithm calls an object that it has by reference": (
        'std::vector<std::string> a{"new"}; F f; std::for_each(a.begin(), a.end(), std::ref(f)); pub(f.s);',
        'struct F { std::string s = "old"; void operator()(const std::string & t) { s = t; } };',
    ),
    "a static variable that a method gives a reference to": (
        'A b; b.s() = "new"; pub(b.s());',
        'struct A { std::string & s() { static std::string x = "old"; return x; } };',
    ),
    "assignments and commas in an argument": (
        'std::string a; create_publisher<std_msgs::msg::String>((a = "old", a = "new", a), 1);', "",
    ),
    "a fraction": ("pub(n(1.0));", 'std::string n(double) { return "new"; } std::string n(int) { return "old"; }'),
}  # fmt: skip
KNOWN = {
    "a method gives back a copy": (
        'H h; h.config().t = "old"; pub(h.c_.t);', CONFIG + "struct H { C c_; C config() const { return c_; } };",
    ),
    "a method gives back a copy of an element": (
        'H h; h.at(0).set("old"); pub(h.c_[0].t);',
        CONFIG + "struct H { std::vector<C> c_{C()}; C at(int i) const { return c_[i]; } };",
    ),
    "a function gives back a copy of a global": (
        'config().set("old"); pub(g.t);', CONFIG + "C g; C config() { return g; }",
    ),
    "a method gives back a reference": (
        'H h; h.config().t = "new"; pub(h.c_.t);',
        CONFIG + 'struct H { C c_{"old"}; C & config() { return c_; } };',
    ),
    "a method gives back a pointer to what it shares": (
        'H h; h.config()->t = "new"; pub(h.c_->t);',
        CONFIG + 'struct H { std::shared_ptr<C> c_ = std::make_shared<C>(C{"old"}); '
        "std::shared_ptr<C> config() { return c_; } };",
    ),
    "what is made for a result is not copied": (
        "pub(f().n);",
        'struct O { std::string n = "new"; O() = default; O(const O &) : n("old") {} }; O f() { return O(); }',
    ),
    "a number itself decides": (f"int z = 0; if (!z) {EITHER}", ""),
    "so does one that a function gives": (f"if (!f()) {EITHER}", "bool f() { return false; }"),
    "one that an atomic holds": (f"std::atomic<bool> z{{false}}; if (!z) {EITHER}", ""),
    "one that auto stands for": (f"auto z = false; if (!z) {EITHER}", ""),
    "one in a class": (f"if (!Kind::fast) {EITHER}", "struct Kind { static constexpr bool fast = false; };"),
    "one that an optional shows": (f"std::optional<bool> z = false; if (!*z) {EITHER}", ""),
    "a number without sign": (
        "pub(n(1u));", 'std::string n(int) { return "old"; } std::string n(unsigned) { return "new"; }',
    ),
    "a template rather than a conversion": (
        "pub(n(1));", 'std::string n(long) { return "old"; } template <typename T> std::string n(T) { return "new"; }',
    ),
    "a letter is a number rather than a text": (
        "pub(n('c'));",
        'std::string n(int) { return "new"; } std::string n(const std::string &) { return "old"; }',
    ),
    "a small number": (
        "uint8_t k = 1; pub(n(k));", 'std::string n(uint8_t) { return "new"; } std::string n(int) { return "old"; }',
    ),
    "a later overload is not seen": (
        "pub(get());",
        'std::string n(double) { return "new"; } std::string get() { return n(1); } '
        'std::string n(int) { return "old"; }',
    ),
    "a later overload that makes nothing is not seen": (
        "get(this);",
        'void n(rclcpp::Node * k, double) { k->create_publisher<std_msgs::msg::String>("new", 1); } '
        "void get(rclcpp::Node * k) { n(k, 1); } void n(rclcpp::Node *, int) { }",
    ),
    "a base that depends on a template is not looked into": (
        "R<int> r; pub(r.get());",
        'std::string n() { return "new"; } template <typename T> struct A { std::string n() { return "old"; } };\n'
        "template <typename T> struct R : A<T> { std::string get() { return n(); } };",
    ),
    "unless it is brought in": (
        "R<int> r; pub(r.get());",
        'std::string n() { return "old"; } template <typename T> struct A { std::string n() { return "new"; } };\n'
        "template <typename T> struct R : A<T> { using A<T>::n; std::string get() { return n(); } };",
    ),
    "a friend is found by its argument": (
        "pub(label(q::X{}));",
        'namespace q { struct X { friend std::string label(const X &) { return "new"; } }; }\n'
        'std::string label(int) { return "old"; }',
    ),
    "a function is found by the base of its argument": (
        "pub(label(Y{}));",
        'namespace q { struct X {}; std::string label(const X &) { return "new"; } }\n'
        'struct Y : q::X {}; std::string label(int) { return "old"; }',
    ),
    "a function is found by its argument beside one that is brought in": (
        "using z::label; pub(label(q::X{}));",
        'namespace z { std::string label(int) { return "old"; } }\n'
        'namespace q { struct X {}; std::string label(const X &) { return "new"; } }',
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "before"), COVERED.values(), ids=COVERED)
def test_the_new_name_is_covered(body: str, before: str, tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, PUB, before=f"{before}\n"))
    assert gaps(system) or any(each == "new" or "?" in each for each in names(system))


@pytest.mark.parametrize(("body", "before"), KNOWN.values(), ids=KNOWN)
def test_the_new_name_alone_is_listed(body: str, before: str, tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(body, PUB, before=f"{before}\n"))
    assert (names(system), gaps(system)) == (["new"], [])
