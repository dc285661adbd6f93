"""Random programs for rclcpp, valid and ending, in which every feature of the language meets every other one.

``program(seed)`` is the same text on every machine. Each program uses a part of the rows and features only, others from
seed to seed: so few of them meet often, instead of all of them once. Nothing that C++ leaves open happens: at most one
part of an expression changes anything, nothing resizes what a reference shows into, every loop and call ends.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

CPP = {
    "text": "std::string",
    "number": "int",
    "truth": "bool",
    "mode": "Mode",
    "texts": "std::vector<std::string>",
    "array": "std::array<std::string, 2>",
    "table": "std::map<std::string, std::string>",
    "maybe": "std::optional<std::string>",
    "pair": "std::pair<std::string, int>",
    "item": "Item",
    "items": "std::vector<Item>",
    "shared": "std::shared_ptr<Item>",
    "owner": "std::unique_ptr<Item>",
    "pointer": "std::string *",
    "maker": "std::function<std::string(const std::string &)>",
    "action": "std::function<void()>",
}
PLAIN = ("text", "text", "text", *list(CPP)[1:-3])
RESIZED = {
    "texts",
    "table",
    "items",
    "maybe",
    "shared",
    "owner",
}  # who writes to one may end references into it
FEATURES = ("edits", "closures", "exchange", "templates", "short circuits", "defaults", "base", "helper", "virtual",
            "two nodes", "macro", "header", "pointers", "kept closures", "recursion", "getters", "static members",
            "constants", "reference member")  # fmt: skip
WORDS = ("scan", "odom", "cmd", "imu", "map", "joy", "left", "right")

HEAD = """#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/string.hpp>
#include <std_srvs/srv/empty.hpp>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>
using S = std_msgs::msg::String;
using Empty = std_srvs::srv::Empty;
using namespace std::chrono_literals;
"""
TYPES = """#define UNDER(name) (std::string("under/") + (name))
enum class Mode { kFirst, kSecond, kThird };
static std::vector<std::shared_ptr<void>> kept;
struct Item {
  Item() = default;
  explicit Item(std::string given) : name(std::move(given)) {}
  Item(const std::string & given, int number) : Item(given) { count = number; }
  virtual ~Item() = default;
  Item(const Item &) = default;
  Item & operator=(const Item &) = default;
  virtual std::string label() const { return name; }
  std::string full() const { return name + "_" + std::to_string(count); }
  void rename(const std::string & to) { name = to; ++count; }
  std::string & own() { return name; }
  std::string name = "item";
  int count = 0;
};
struct Special : Item {
  using Item::Item;
  std::string label() const override { return "special/" + name; }
  std::string full() const { return "hidden/" + name; }
};
template <typename T> struct Box { T value; const T & get() const { return value; } };
template <int N> std::string numbered(const std::string & text) { return text + std::to_string(N); }
inline std::string label_of(const std::string & text) { return "text_" + text; }
inline std::string label_of(int number) { return "number_" + std::to_string(number); }
inline std::string label_of(bool truth) { return truth ? "yes" : "no"; }
"""

# --- rows: "feature | kind of the variable $v | text"; ! after the kind: it is written
#
# $t a text, $o one that is a std::string, $n a number, $b a truth, $i an Item, $w a literal, $d a digit, $m a mode;
# capital letters: it may change something

EXPRESSIONS = {
    "text": """
        |          | $w                                            || | | $w
        | text     | $v                                            || | text | $v
        | text     | $v                                            || | text | $v
        |          | ($o + "/" + $t)                               || | | ($o + std::to_string($n))
        |          | ($o + "_left")                                || | | UNDER($t)
        |          | @call                                         || | | @call
        |          | ($B ? $O : $O)                                || | | label_of($t)
        |          | label_of($b)                                  || | | label_of($n)
        | texts    | ($v.empty() ? std::string($w) : $v[0])        || | texts | ($v.size() > 1 ? $v.at(1) : $o)
        | texts    | ($v.empty() ? std::string($w) : $v.back())    || | array | $v[$n % 2]
        | array    | std::get<1>($v)                               || | table | ($v.count("odom") ? $v.at("odom") : $o)
        | table    | ($v.empty() ? $o : $v.begin()->second)        || | maybe | $v.value_or($w)
        | maybe    | ($v ? *$v : $o)                               || | pair | $v.first
        | pair     | ($v.first + std::to_string($v.second))        || | item | $v.name
        | item     | $v.full()                                     || | item | $v.label()
        | items    | ($v.empty() ? $o : $v[0].name)                || | items | ($v.empty() ? $o : $v.back().label())
        | shared   | $v->name                                      || | shared | $v->label()
        | owner    | $v->full()                                    || | owner | $v->label()
        edits      | | $o.substr(0, 3)                             || pointers | pointer | (*$v)
        edits      | text! | $v.append($w)                         || exchange | text! | std::exchange($v, $t)
        templates  | | numbered<$d>($t)                            || templates | | Box<std::string>{$t}.get()
        kept closures | maker | $v($t)                             || closures | | @closure
    """,
    "number": """
        |          | $d                                            || | number | $v
        | number   | $v                                            || | | ($n + 1)
        |          | ($B ? 1 : 2)                                  || | texts | static_cast<int>($v.size())
        | text     | static_cast<int>($v.size() % 3)               || | mode | static_cast<int>($v)
        | pair     | $v.second                                     || | | @call
        exchange   | number! | $v++                                || exchange | number! | ++$v
    """,
    "truth": """
        |          | true                                          || | | false
        |          | (std::rand() % 2 == 0)                        || | truth | $v
        | truth    | !$v                                           || | | $N < 2
        | text     | $v == $w                                      || | text | $v.find($w) != std::string::npos
        | texts    | $v.empty()                                    || | maybe | $v.has_value()
        | mode     | $v == $m                                      || | | @call
        short circuits | | ($B $x $B)                              || short circuits | | ($B $x $B)
    """,
    "mode": "| | $m || | mode | $v || | | ($b ? $m : $m)",
    "texts": "| | @T{} || | | @T{$o} || | | @T{$o, $o} || | texts | $v",
    "array": "| | @T{$o, $o} || | array | $v",
    "table": "| | @T{} || | | @T{{$w, $t}} || | | @T{{$w, $t}, {$w, $t}} || | table | $v",
    "maybe": "| | @T() || | | @T($t) || | | @T($t) || | maybe | $v",
    "pair": "| | @T($t, $n) || | pair | $v",
    "item": "| | Item($t) || | | Item($t, $n) || | | Item() || | | Special($t) || | item | $v",
    "items": "| | @T{} || | | @T{$i} || | items | $v",
    "shared": "| | std::make_shared<Item>($t) || | | std::make_shared<Special>($t) || | shared | $v",
    "owner": "| | std::make_unique<Item>($t) || | | std::make_unique<Special>($t)",
}
EDITS = """
    | text! | $v = $T;              || | text! | $v = $T;                    || | text! | $v += $t;
    | text! | $v += "_map";         || | text! | $v = $v + std::to_string($n); || edits | text! | $v.append("_x");
    edits | text! | $v.insert(0, $w); || edits | text! | if ($v.size() > 4) { $v.erase(3, 1); }
    edits | text! | if ($v.size() > 2) { $v.replace(0, 2, $w); }
    edits | text! | if (!$v.empty()) { $v.back() = 'k'; }
    edits | text! | $v.push_back('z'); || edits | text! | $v.assign($w);     || edits | text! | $v.resize(3, 'r');
    | number! | ++$v;               || | number! | $v += $n % 4;             || | number! | $v = ($v + 2) % 5;
    | truth! | $v = $B;             || | mode! | $v = $m;                    || | texts! | $v.push_back($t);
    | texts! | $v.emplace_back($t); || | texts! | if (!$v.empty()) { $v.pop_back(); } || | texts! | $v.clear();
    | texts! | $v.insert($v.begin(), $t); || | texts! | if (!$v.empty()) { $v.erase($v.begin()); }
    | texts! | if (!$v.empty()) { $v[0] = $t; } || | texts! | if (!$v.empty()) { $v.back() += $t; }
    | texts! | $v.resize(2, $t);    || | texts! | $v = @texts;               || | array! | $v[0] = $t;
    | array! | $v.at(1) += $t;      || | array! | std::swap($v[0], $v[1]);   || | array! | $v.fill($t);
    | table! | $v[$w] = $t;         || | table! | $v[$w] += $t;              || | table! | $v.emplace($w, $t);
    | table! | $v.erase($w);        || | table! | $v.insert({$w, $t});       || | table! | $v = @table;
    | maybe! | $v = $t;             || | maybe! | $v.reset();                || | maybe! | if ($v) { *$v += $t; }
    | pair! | $v.first = $t;        || | pair! | $v = {$t, $n};              || | item! | $v.name = $t;
    | item! | $v.rename($t);        || | item! | $v = $i;                    || | item! | $v.own().append($t);
    | items! | $v.push_back($i);    || | items! | $v.emplace_back($t);
    | items! | if (!$v.empty()) { $v[0].rename($t); }
    | items! | if (!$v.empty()) { $v.erase($v.begin()); } || | shared! | $v->name = $t; || | shared! | $v = @shared;
    | owner! | $v->rename($t);      || | owner! | $v.reset(new Special($t)); || | owner! | $v = @owner;
    pointers | pointer! | *$v = $t; || pointers | pointer! | $v->append($t); || pointers | pointer! | $v = @pointer;
    kept closures | maker! | $v = @maker; || kept closures | action! | $v = @action; || | | @call;
"""
BLOCKS = """
    if ($B) { / $S / }
    if ($B) { / $S / } else { / $S / }
    if ($B) { / $S / } else if ($B) { / $S / } else { / $S / }
    switch ($N) { / case 0: { / $K / } / break; / case 1: { / $K / } / [[fallthrough]]; / default: { / $K / } / }
    switch ($m) { / case Mode::kFirst: { / $K / } / [[fallthrough]]; / case Mode::kThird: { / $K / } / break; / }
    for (int $c = 0; $c < 2; ++$c) { / $L / }
    for (int $c = 0; $c < $d; ++$c) { / $L / }
    { / int $c = 0; / while ($c < 2 && $B) { / ++$c; / $L / } / }
    { / int $c = 0; / do { / ++$c; / $L / } while ($c < 2); / }
    try { / $G / } catch (const std::exception & error) { / $S / (void)error; / }
    try { / $G / } catch (...) { / $S / }
    { / $S / }
"""
INTO = {  # a name of a part, in a block in which nothing may resize the whole
    "texts": ["if (!$v.empty()) { / auto & $e = $v.back(); / $S / }", "for (auto & $e : $v) { / $L / }",
              "for (const auto & $e : $v) { / $L / }", "for (auto $e : $v) { / $L / }",
              "for (auto at = $v.begin(); at != $v.end(); ++at) { / auto & $e = *at; / $L / }",
              "for (std::size_t at = 0; at < $v.size(); ++at) { / std::string & $e = $v[at]; / $L / }"],
    "array": ["for (auto & $e : $v) { / $L / }", "{ / auto & $e = $v[1]; / $S / }"],
    "items": ["if (!$v.empty()) { / auto & $e = $v[0].name; / $S / }",
              "for (auto & x : $v) { / auto & $e = x.name; / $L / }"],
    "table": ["for (auto & [key, $e] : $v) { / $L / }", "if (!$v.empty()) { / auto & $e = $v.begin()->second; / $S / }",
              "if (auto at = $v.find($w); at != $v.end()) { / auto & $e = at->second; / $S / }"],
    "maybe": ["if ($v) { / auto & $e = *$v; / $S / }"],
    "shared": ["{ / auto & $e = $v->name; / $S / }"],
    "owner": ["{ / auto & $e = $v->name; / $S / }"],
}  # fmt: skip
ALIASES = {
    "text": ["auto & $e = $v;", "std::string & $e = $v;", "auto * $p = &$v;"],
    "item": ["auto & $e = $v.name;", "auto & $e = $v.own();"],
    "array": ["auto & $e = $v[0];"],
    "pair": ["auto & $e = $v.first;", "auto & [$e, rest_$e] = $v;"],
}


class Row(NamedTuple):
    feature: str
    kind: str
    text: str
    writes: bool


def _rows(table: str) -> list[Row]:
    found = []
    for row in re.split(r"\|\||\n(?=[^\n]*\|)", table):
        if row.strip():
            feature, kind, text = (part.strip() for part in row.split("|", 2))
            found.append(Row(feature, kind.rstrip("!"), text, kind.endswith("!")))
    return found


ROWS = {kind: _rows(table) for kind, table in EXPRESSIONS.items()}
EDIT_ROWS = _rows(EDITS)
BLOCK_ROWS = [line.strip() for line in BLOCKS.strip().splitlines()]


class Variable(NamedTuple):
    """A variable, or a part of one, that an expression may name.

    ``root``: the variable that owns its memory.
    """

    text: str
    kind: str
    root: str
    constant: bool = False

    @property
    def lasts(self) -> bool:
        """Return True for a global and for a member."""
        return self.text.startswith("g_") or self.text.endswith("_")


class Function(NamedTuple):
    """A function that the program defines.

    ``parameters``: the kind of each, with how it is passed. ``changes``: roots that a call may resize. ``pure``: it
    writes nothing that other code reads. ``node``: its first parameter is the node.
    """

    name: str
    result: str
    parameters: tuple[tuple[str, str], ...]
    changes: frozenset[str]
    throws: bool
    pure: bool
    node: bool


class Generator:
    """Write one random program.

    ``nasty``: from 0 to 1, how many of the features a program uses.
    """

    def __init__(self, seed: int, nasty: float) -> None:
        self.random = random.Random(seed)
        share = 0.25 + 0.5 * nasty * self.random.random() + 0.2 * self.random.random()
        self.features = {"", *(each for each in FEATURES if self.random.random() < share)}
        self.edits = [row for row in EDIT_ROWS if row.feature in self.features and self.random.random() < 0.7]
        self.blocks = [row for row in BLOCK_ROWS if self.random.random() < 0.5]
        more = [
            self.alias,
            self.closure,
            self.callback,
            self.bound,
            self.leave,
            self.leave,
            self.swap,
            self.static_local,
        ]
        self.more = [make for make in more if self.random.random() < 0.5]
        self.count = 0
        self.scope: list[Variable] = []
        self.functions: list[Function] = []
        self.parameters: dict[str, str] = {}  # of the node: name and kind
        self.node: str | None = (
            None  # how the node is written before a name: "" for this, None where there is none
        )
        self.result: str | None = None  # what the function around gives back; None where it may not end early
        self.here: set[str] = set()  # variables that the innermost block declares
        self.frozen: set[str] = set()  # roots into which a reference shows
        self.changes: set[str] = set()  # roots that the function around may resize
        self.pure = False  # nothing may change anything here
        self.changed = False  # the function around changes what others see
        self.throws = False
        self.guarded = False  # an exception is caught
        self.kept = False  # in a closure that a variable keeps: it must not lead back to itself
        self.loops = self.depth = self.nested = 0

    # --- choices and scopes

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def has(self, feature: str) -> bool:
        return feature in self.features

    def name(self, start: str) -> str:
        self.count += 1
        return f"{start}{self.count}"

    def word(self) -> str:
        return f'"{self.random.choice(WORDS)}"'

    def add(self, text: str, kind: str, root: str = "", constant: bool = False) -> None:
        self.scope.append(Variable(text, kind, root or text, constant))

    @contextmanager
    def block(self, **state: object) -> Iterator[None]:
        """Open a block: drop its variables at the end. ``state``: attributes to change in between."""
        before = {name: getattr(self, name) for name in ("frozen", "depth", "scope", "here", *state)}
        self.scope, self.frozen, self.depth, self.here = (
            list(self.scope),
            set(self.frozen),
            self.depth + 1,
            set(),
        )
        for name, value in state.items():
            setattr(self, name, value)
        yield
        for name, value in before.items():
            setattr(self, name, value)

    def variable(self, kind: str, write: bool = False) -> Variable | None:
        found = [v for v in self.scope if v.kind == kind]
        if write:
            found = [v for v in found if not v.constant and not (kind in RESIZED and v.root in self.frozen)]
        if not found:
            return None
        chosen = self.random.choice(found[-4:] if self.chance(0.5) else found)
        if write:
            self.changes |= {chosen.root} if kind in RESIZED else set()
            self.changed = self.changed or not chosen.root.startswith("v")
        return chosen

    # --- expressions

    def value(self, kind: str, pure: bool = False) -> str:
        """An expression of that kind; ``pure``: it changes nothing."""
        if kind in ("pointer", "maker", "action"):
            return self.kept_value(kind)
        before, self.pure, self.nested = self.pure, self.pure or pure, self.nested + 1
        made = None
        while made is None:
            row = self.random.choice(ROWS[kind])
            simple = kind not in ("text", "number", "truth") or not re.search(r"\$[^vwdm]|@", row.text)
            if (
                row.feature in self.features
                and (simple or self.nested < 5)
                and not (row.writes and self.pure)
            ):
                made = self.filled(row, kind)
        self.pure, self.nested = before, self.nested - 1
        return made

    def filled(self, row: Row, kind: str = "") -> str | None:
        """The text of a row; None if it has no variable, or nothing to call."""
        found = self.variable(row.kind, row.writes) if row.kind else None
        if (row.kind and found is None) or (row.kind == "maker" and (self.kept or self.frozen)):
            return None
        if row.text.startswith("@call"):
            called = self.call(kind or self.random.choice(["void", "void", "text", "number"]))
            return called and called + row.text[5:]
        if row.text == "@closure":
            return self.closure_at_once()
        return self.text(row.text, found.text if found else "", kind)

    def text(self, template: str, v: str = "", kind: str = "") -> str:
        """The template with everything that its placeholders stand for."""

        def part(match: re.Match[str]) -> str:
            sign = match[0][1:]
            if match[0][0] == "@":
                return CPP[kind] if sign == "T" else self.value(sign, pure=True)
            plain: dict[str, Callable[[], str]] = {
                "v": lambda: v,
                "w": self.word,
                "d": lambda: str(self.random.randint(0, 3)),
            }
            plain["x"] = lambda: self.random.choice(["&&", "||"])
            plain["m"] = lambda: f"Mode::k{self.random.choice(['First', 'Second', 'Third'])}"
            if sign in plain:
                return plain[sign]()
            of = {"t": "text", "o": "text", "n": "number", "b": "truth", "i": "item"}[sign.lower()]
            made = self.value(of, pure=sign.islower())
            return f"std::string({made})" if sign in "oO" and made.startswith('"') else made

        return re.sub(r"\$[a-zA-Z]|@\w+", part, template)

    def kept_value(self, kind: str) -> str:
        """Return a value that stays valid while the node lives: an address, or a closure that calls no other."""
        if kind == "pointer":
            found = [
                v for v in self.scope if v.kind == "text" and v.lasts and v.text == v.root and not v.constant
            ]
            return f"&{self.random.choice(found).text}" if found else "&g_text"
        with self.in_kept_closure():
            if kind == "maker":
                self.add("t", "text", constant=True)
                return f"[{self.capture}](const std::string & t) {{ return {self.text('$o')}; }}"
            return f"[{self.capture}]() {{ {' '.join(self.simple())} }}"

    @property
    def capture(self) -> str:
        return "this" if self.node == "" else ""

    @contextmanager
    def in_kept_closure(self, callback: bool = False) -> Iterator[None]:
        """Let a closure use only variables that outlive it. A callback may also resize containers."""
        seen = [
            v for v in self.scope if v.text.startswith("g_") or (v.text.endswith("_") and self.node == "")
        ]
        if not callback:
            seen = [v._replace(constant=v.constant or v.kind in (*RESIZED, "maker")) for v in seen]
        with self.block(kept=not callback, node="" if self.node == "" else None, result=None, guarded=False, loops=0,
                        pure=False, changes=set(), changed=self.changed, throws=False, nested=0):  # fmt: skip
            self.scope, self.frozen = seen, set()
            yield

    def closure_at_once(self) -> str | None:
        if self.node is None and not self.result:
            return None
        with self.block():
            self.scope = [v for v in self.scope if not v.text.startswith("key")]
            return self.text("[&]() { return $o; }()")

    # --- calls

    def call(self, result: str) -> str | None:
        found = [f for f in self.functions if f.result == result and not f.changes & self.frozen]
        found = [
            f
            for f in found
            if (f.pure or not self.pure)
            and (f.name.startswith("free") or not (self.kept or self.node is None))
        ]
        found = [f for f in found if not f.node or self.node is not None]
        found = [f for f in found if not f.throws or self.guarded or self.result == "void"]
        self.random.shuffle(found)
        for function in found:
            given = self.arguments(function)
            if given is not None:
                self.changes |= function.changes
                self.changed = self.changed or not function.pure
                self.throws = self.throws or (function.throws and not self.guarded)
                return f"{function.name}({', '.join(given)})"
        return None

    def arguments(self, function: Function) -> list[str] | None:
        given = [self.itself] if function.node else []
        for kind, passing in function.parameters:
            found = self.variable(kind, write=True) if passing == "reference" else None
            if passing == "reference" and found is None:
                return None
            if passing == "default" and self.chance(0.5):
                break
            given.append(found.text if found else self.value(kind, pure=True))
        return given

    @property
    def itself(self) -> str:
        """The node as an argument."""
        node = self.node or ""
        return "*this" if not node else f"*{node[:-2]}" if node.endswith("->") else node[:-1]

    # --- statements

    def statements(self, most: int) -> list[str]:
        return [line for _ in range(self.random.randint(1, most)) for line in self.one()]

    def one(self) -> list[str]:
        ways: list[Callable[[], list[str]]] = [
            self.make,
            self.make,
            self.local,
            self.edit,
            self.edit,
            *([] if self.kept else self.more),
        ]
        if self.depth < 4 and not self.kept:
            ways += [self.nested_block, self.nested_block, self.into]
        for _ in range(20):
            if lines := self.random.choice(ways)():
                return lines
        return ["++g_number;"]

    def simple(self) -> list[str]:
        return self.random.choice([self.make, self.edit])() or self.edit() or ["++g_number;"]

    def edit(self) -> list[str]:
        for _ in range(5):
            row = self.random.choice(self.edits or EDIT_ROWS)
            if row.kind == "action!" and (self.kept or self.frozen):
                continue
            line = self.filled(row)
            if line and not (row.kind in ("action", "maker") and self.kept):
                return [line]
        return []

    def local(self) -> list[str]:
        kind = self.random.choice(PLAIN)
        value, name = self.value(kind), self.name("v")
        outer = [v.text for v in self.scope if v.kind == kind and re.fullmatch(r"v\d+", v.text)]
        if (
            outer
            and self.depth > 2
            and outer[0] not in self.here
            and not re.search(rf"\b{outer[0]}\b", value)
        ):
            name = outer[0]  # hides it
            self.scope = [v for v in self.scope if not re.search(rf"\b{name}\b", v.text)]
        self.here.add(name)
        constant = kind in ("text", "number") and self.chance(0.1)
        self.add(name, kind, constant=constant)
        inferred = kind not in ("text", "item", "shared", "owner") and self.chance(0.3)
        return [f"{'const ' if constant else ''}{'auto' if inferred else CPP[kind]} {name} = {value};"]

    def make(self) -> list[str]:
        """The point of it all: an interface under a name that is made of everything else."""
        if self.node is None:
            return []
        self.changed = True
        name = self.text("UNDER($T)" if self.has("macro") and self.chance(0.3) else "$T")
        kind = self.random.randint(0, 9)
        if kind < 6:
            return [f"kept.push_back({self.node}create_publisher<S>({name}, 1));"]
        if kind < 7:
            return [f"kept.push_back({self.node}create_client<Empty>({name}));"]
        with self.in_kept_closure(callback=True):
            body, capture = " ".join(self.simple()) if self.chance(0.5) else "", self.capture
            if kind < 9 and self.chance(0.2) and (text := self.variable("text", write=True)):
                body += f" {text.text} = message->data;"
        if kind < 9:
            head = f"create_subscription<S>({name}, 1, [{capture}](S::SharedPtr message) {{ (void)message;"
        else:
            arguments = "Empty::Request::SharedPtr, Empty::Response::SharedPtr"
            head = f"create_service<Empty>({name}, [{capture}]({arguments}) {{"
        return [f"kept.push_back({self.node}{head} {body} }}));"]

    def nested_block(self) -> list[str]:
        return self.lines(self.random.choice(self.blocks or BLOCK_ROWS))

    def lines(self, template: str, v: str = "", entry: Variable | None = None) -> list[str]:
        """The lines of a block; ``entry``: what ``$e`` is in the blocks inside."""
        counter, found = self.name("c"), []
        template = template.replace("$c", counter).replace("$e", entry.text if entry else "")
        inner = [
            *([Variable(counter, "number", counter, True)] if counter in template else []),
            *([entry] if entry else []),
        ]
        for line in template.split(" / "):
            if line not in ("$S", "$L", "$K", "$G"):
                found.append(self.text(line, v))
                continue
            states: dict[str, dict[str, object]] = {
                "$L": {"loops": self.loops + 1},
                "$K": {"loops": 0},
                "$G": {"guarded": True},
            }
            with self.block(**states.get(line, {})):
                self.scope += inner
                found += self.statements(2)
                if line == "$G" and self.chance(0.5):
                    found += self.text("if ($B) { / throw std::runtime_error($t); / }").split(" / ")
        return found

    def into(self) -> list[str]:
        """A name of an element, or of each, as long as nothing may move it."""
        kind = self.random.choice(list(INTO))
        found = self.variable(kind)
        if found is None:
            return []
        template = self.random.choice(INTO[kind])
        by_value = "auto $e " in template
        name = self.name("key" if "[key" in template else "e")
        fixed = "const auto" in template or (found.constant and kind not in ("shared", "owner"))
        if fixed and not by_value:
            template = template.replace("std::string &", "const std::string &")
        with self.block():
            self.frozen.add(found.root)
            entry = Variable(name, "text", name if by_value else found.root, fixed and not by_value)
            return self.lines(template, found.text, entry)

    def alias(self) -> list[str]:
        kind = self.random.choice(list(ALIASES))
        found, template = self.variable(kind, write=True), self.random.choice(ALIASES[kind])
        if found is None:
            return []
        name = self.name("key" if "[" in template.split("=")[0] else "r")  # no closure can have it in C++17
        self.add(f"(*{name})" if "$p" in template else name, "text", found.root)
        return [template.replace("$p", name).replace("$e", name).replace("$v", found.text)]

    def closure(self) -> list[str]:
        """A closure that is called here: with references, copies, or a variable of its own."""
        capture = self.random.choice(["&", "&", "=", "&, own = "])
        own = self.text("$o") if "own" in capture else ""
        node = None if capture == "=" and self.node == "node." else self.node  # a node has no copy
        with self.block(result="void", loops=0, node=node):
            self.scope = [v for v in self.scope if not v.text.startswith("key")]
            if capture == "=":
                self.scope = [
                    v if v.lasts else v._replace(constant=True)
                    for v in self.scope
                    if v.lasts or v.kind != "owner"
                ]
            if own:
                self.add("own", "text")
            body = self.statements(2)
        name = self.name("f")
        calls = [f"{name}();"] * self.random.randint(1, 2)
        return [f"auto {name} = [{capture}{own}]() {'mutable ' if own else ''}{{", *body, "};", *calls]

    def callback(self) -> list[str]:
        if self.node != "":
            return []
        own = self.text(", own = std::string($t)") if self.chance(0.3) else ""
        with self.in_kept_closure(callback=True), self.block(result="void"):
            functions, self.functions = self.functions, [f for f in self.functions if not f.throws]
            if own:
                self.add("own", "text")
            body = self.statements(3)
            self.functions = functions
        if own or self.chance(0.8):
            return [
                f"kept.push_back(create_wall_timer(1s, [this{own}]() {'mutable ' if own else ''}{{",
                *body,
                "}));",
            ]
        head = "kept.push_back(add_on_set_parameters_callback([this](const std::vector<rclcpp::Parameter> & changed) {"
        body = [
            "auto apply = [this]() {",
            *body,
            "};",
            "for (const auto & each : changed) {",
            "(void)each;",
            "apply();",
            "}",
        ]
        return [head, *body, "return rcl_interfaces::msg::SetParametersResult();", "}));"]

    def bound(self) -> list[str]:
        """A method of the node as a callback, with its arguments."""
        found = [
            f for f in self.functions if f.name.startswith("do_") and f.result == "void" and not f.throws
        ]
        found = [f for f in found if not any(p == "reference" or k == "owner" for k, p in f.parameters)]
        if self.node != "" or not found:
            return []
        chosen = self.random.choice(found)
        given = "".join(", " + self.text("$o" if k == "text" else f"@{k}") for k, _ in chosen.parameters)
        return [f"kept.push_back(create_wall_timer(1s, std::bind(&Demo::{chosen.name}, this{given})));"]

    def leave(self) -> list[str]:
        """A way out: of a turn, of a loop, of the function, by an exception."""
        ways = ["break;", "continue;"] if self.loops else []
        if self.result:
            ways.append(
                "return;"
                if self.result == "void"
                else self.text("return $o;" if self.result == "text" else f"return @{self.result};")
            )
        if self.guarded or self.result == "void":
            ways.append("throw std::runtime_error($t);")
        if not ways:
            return []
        way = self.random.choice(ways)
        self.throws = self.throws or (way.startswith("throw") and not self.guarded)
        return [self.text("if ($B) {"), self.text(way), "}"]

    def swap(self) -> list[str]:
        kind = self.random.choice(["text", "texts", "table", "item", "shared"])
        one, other = self.variable(kind, write=True), self.variable(kind, write=True)
        if one is None or other is None or one.root == other.root:
            return []
        if self.chance(0.5):
            return [f"std::swap({one.text}, {other.text});"]
        return [f"{one.text} = std::move({other.text});", f"{other.text} = {self.fresh(kind)};"]

    def fresh(self, kind: str) -> str:
        return {"text": '"again"', "item": 'Item("again")', "shared": 'std::make_shared<Item>("again")'}.get(
            kind, "{}"
        )

    def static_local(self) -> list[str]:
        name = self.name("s")
        self.add(name, kind := self.random.choice(["text", "number"]))
        return [f"static {CPP[kind]} {name} = {self.word() if kind == 'text' else '0'};"]

    # --- functions and classes

    def function(
        self, name: str, result: str, parameters: Sequence[tuple[str, str]], node: bool = False, most: int = 3
    ) -> list[str]:
        """The lines of a function, which can be called from then on."""
        written, counter = ["rclcpp::Node & node"] if node else [], ""
        again = self.has("recursion") and not node and tuple(parameters[-1:]) == (("number", "value"),)
        with self.block(changes=set(), changed=node, throws=False, result=result):
            for kind, passing in parameters:
                counter = self.name("p")
                default = f" = {self.constant(kind)}" if passing == "default" else ""
                const, sign = (
                    ("const " if passing == "const" else ""),
                    (" &" if passing in ("const", "reference") else ""),
                )
                written.append(f"{const}{CPP[kind]}{sign} {counter}{default}")
                self.add(counter, kind, constant=passing == "const" or again)
            lines = self.statements(most)
            if again and all(passing != "reference" for _, passing in parameters):
                given = ", ".join(
                    [*(self.value(kind, pure=True) for kind, _ in parameters[:-1]), f"{counter} - 1"]
                )
                call = f"{name}({given});"
                lines += [
                    f"if ({counter} > 0 && {counter} < 4) {{",
                    call if result == "void" else f"return {call}",
                    "}",
                ]
            if result != "void":
                lines.append(self.text("return $o;" if result == "text" else f"return @{result};"))
            changed = self.changed or self.throws or any(passing == "reference" for _, passing in parameters)
            made = Function(
                name, result, tuple(parameters), frozenset(self.changes), self.throws, not changed, node
            )
        self.functions.append(made)
        return [f"{'void' if result == 'void' else CPP[result]} {name}({', '.join(written)}) {{", *lines, "}"]

    def constant(self, kind: str) -> str:
        """A value that can stand in a declaration: of a default argument, of a parameter."""
        known = [f"g_{kind}"] if any(v.text == f"g_{kind}" for v in self.scope) else []
        return self.random.choice([*known, {"text": self.word(), "number": "1"}.get(kind, "true")])

    def some_parameters(self) -> list[tuple[str, str]]:
        kinds = ["text", "text", *(k for k in PLAIN if k != "owner")]
        passing = ["value", "const", "reference"]
        found = [
            (self.random.choice(kinds), self.random.choice(passing)) for _ in range(self.random.randint(0, 2))
        ]
        if self.has("defaults") and self.chance(0.4):
            found.append((self.random.choice(["text", "number", "truth"]), "default"))
        elif self.has("recursion") and self.chance(0.5):
            found.append(("number", "value"))
        return found

    def fields(self, start: str, most: int) -> list[str]:
        lines = []
        with self.block(node=None):
            for kind in [
                "text",
                *self.random.choices([*PLAIN, "pointer", "maker", "action"], k=self.random.randint(1, most)),
            ]:
                feature = {"pointer": "pointers", "maker": "kept closures", "action": "kept closures"}.get(
                    kind, ""
                )
                if feature not in self.features:
                    continue
                name = self.name(start) + "_"
                static = self.has("static members") and kind != "pointer" and self.chance(0.3)
                seen = self.scope
                self.scope = [v for v in seen if v.text.startswith("g_")] if static else seen
                lines.append(
                    f"{'inline static ' if static else ''}{CPP[kind]} {name} = {self.value(kind, pure=bool(static))};"
                )
                self.scope = [*seen, Variable(name, kind, name)]
            found = self.scope
        self.scope = found
        return lines


class Program(NamedTuple):
    """``files`` by path; ``parameters``: those that the node declares, with their kinds."""

    files: dict[str, str]
    parameters: dict[str, str]


def program(seed: int, nasty: float = 0.4) -> Program:
    """Return the program of this seed."""
    return _Writer(seed, nasty).program()


class _Writer(Generator):
    """The parts of a whole program, from top to bottom."""

    def program(self) -> Program:
        lines = []
        for kind in ["text", "number", *self.random.sample(PLAIN[3:], 2)]:
            if not any(v.text == f"g_{kind}" for v in self.scope):
                lines.append(f"static {CPP[kind]} g_{kind} = {self.value(kind, pure=True)};")
                self.add(f"g_{kind}", kind)
        if self.has("constants"):
            lines += [
                f"constexpr const char * g_word = {self.word()};",
                f"static const std::string g_fixed = {self.word()};",
            ]
            self.add("std::string(g_word)", "text", "g_word", constant=True)
            self.add("g_fixed", "text", constant=True)
        for _ in range(self.random.randint(0, 3)):
            lines += self.free()
        helper = self.helper() if self.has("helper") else []
        base = self.base() if self.has("base") else []
        lines += [*helper, *base, *self.demo(), *self.main()]
        text = "\n".join(indented(lines))
        if self.has("header"):
            files = {
                "src/main.cpp": f'{HEAD}#include "types.hpp"\n{text}\n',
                "src/types.hpp": f"#pragma once\n{TYPES}",
            }
        else:
            files = {"src/main.cpp": f"{HEAD}{TYPES}{text}\n"}
        return Program(files, self.parameters)

    def free(self) -> list[str]:
        node = self.chance(0.4)
        result = self.random.choice(
            ["void", "void", "text"] if node else ["text", "text", "number", "truth", "void"]
        )
        with self.block(node="node." if node else None):
            lines = self.function(self.name("free"), result, self.some_parameters(), node)
        return ["static " + lines[0], *lines[1:]]

    def helper(self) -> list[str]:
        """A class that is given the node and a text of it."""
        sign, text = (
            self.random.choice("&*"),
            "std::string &" if self.has("reference member") else "std::string",
        )
        functions = list(self.functions)
        with self.block(node="node_->" if sign == "*" else "node_."):
            self.add("h_text_", "text")
            fields = self.fields("h", 2)
            methods = self.function(self.name("assist"), "void", self.some_parameters())
            methods += self.function(self.name("assist"), "text", self.some_parameters())
        own = [f._replace(name=f"helper_->{f.name}", pure=False) for f in self.functions[len(functions) :]]
        self.functions, self.helpers, self.helper_takes = functions, own, "this" if sign == "*" else "*this"
        start = [f"Helper(rclcpp::Node {sign} node, {text} text) : node_(node), h_text_(text) {{}}"]
        members = ["private:", f"rclcpp::Node {sign} node_;", f"{text} h_text_;", *fields]
        return ["class Helper {", "public:", *start, *methods, *members, "};"]

    helpers: Sequence[Function] = ()
    helper_takes = "this"

    def base(self) -> list[str]:
        fields = self.fields("b", 2)
        with self.block(node=None, functions=[f for f in self.functions if f.name.startswith("free")]):
            text = self.function("topic", "text", ())
            virtual = self.functions[-1]._replace(pure=False)
        self.functions.append(virtual)
        with self.block(node=""):
            method = self.function(self.name("base_do_"), "void", self.some_parameters())
            with self.block(result="void", changes=set()):
                body = self.statements(2)
        start = ["explicit Base(const std::string & name) : Node(name) {", *body, "}"]
        return ["class Base : public rclcpp::Node {", "public:", "virtual " + text[0], *text[1:], *method, *start,
                "protected:", *fields, "};"]  # fmt: skip

    def demo(self) -> list[str]:
        base = "Base" if self.has("base") else "rclcpp::Node"
        fields = self.fields("f", 4)
        lines = [f"class Demo : public {base} {{", "public:"]
        if self.has("getters"):
            held = self.random.choice(
                [v.text for v in self.scope if v.kind == "text" and v.text.endswith("_")]
            )
            lines.append(f"std::string & {(getter := self.name('get'))}() {{ return {held}; }}")
            self.add(f"{getter}()", "text", held)
        if base == "Base" and self.has("virtual"):
            free = [f for f in self.functions if f.name.startswith("free")]
            with self.block(node=None, functions=free):
                self.frozen |= {v.root for v in self.scope}  # it resizes no more than the method of the base
                text = self.function("topic", "text", ())
            lines += [text[0].replace(" {", " override {"), *text[1:]]
        self.functions += self.helpers
        with self.block(node=""):
            for _ in range(self.random.randint(1, 3)):
                result = self.random.choice(["void", "void", "text", "number", "truth"])
                lines += self.function(self.name("do_"), result, self.some_parameters(), most=4)
            lines += self.constructor(base)
        if self.has("helper"):
            fields.append("std::unique_ptr<Helper> helper_;")
        return [*lines, "private:", *fields, "};"]

    def constructor(self, base: str) -> list[str]:
        lines = [f'Demo() : {base.rpartition(":")[2]}("n") {{']
        with self.block(result="void", changes=set()):
            if self.has("helper"):
                texts = [
                    v.text
                    for v in self.scope
                    if v.kind == "text" and v.lasts and v.text == v.root and not v.constant
                ]
                lines.append(
                    f"helper_ = std::make_unique<Helper>({self.helper_takes}, {self.random.choice(texts)});"
                )
            for kind in self.random.choices(["text", "text", "number", "truth"], k=self.random.randint(0, 2)):
                local, name = self.name("v"), f"q{len(self.parameters)}"
                declare = f'declare_parameter<{CPP[kind]}>("{name}", {self.constant(kind)});'
                if self.chance(0.3):
                    lines += [
                        declare,
                        f"{CPP[kind]} {local} = {self.value(kind, pure=True)};",
                        f'get_parameter("{name}", {local});',
                    ]
                else:
                    lines.append(f"{CPP[kind]} {local} = {declare}")
                self.parameters[name] = kind
                self.add(local, kind)
            lines += self.statements(6)
        return [*lines, "}"]

    def main(self) -> list[str]:
        two, lines = (
            self.has("two nodes"),
            ["int main(int argc, char ** argv) {", "rclcpp::init(argc, argv);"],
        )
        self.scope = [v for v in self.scope if "g_" in v.text]
        self.functions = [f for f in self.functions if f.name.startswith("free") and not f.throws]
        with self.block(node="other->"):
            if two:
                lines += ['auto other = std::make_shared<rclcpp::Node>("other");', *self.statements(2)]
            lines.append("auto node = std::make_shared<Demo>();")
            self.node = "node->"
            lines += self.statements(2) if self.chance(0.4) else []
            if two and self.chance(0.6):
                lines += ["rclcpp::executors::SingleThreadedExecutor executor;", "executor.add_node(node);",
                          "executor.add_node(other);", "executor.spin();"]  # fmt: skip
            else:
                lines.append("rclcpp::spin(node);")
            lines += self.statements(2) if self.chance(0.3) else []
        return [*lines, "rclcpp::shutdown();", "return 0;", "}"]


def indented(lines: Sequence[str]) -> Iterator[str]:
    depth = 0
    for line in lines:
        yield "  " * (depth - line.startswith("}")) + line
        depth += line.count("{") - line.count("}")
