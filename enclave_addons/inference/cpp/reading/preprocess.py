"""What the preprocessor leaves of a C++ file, line by line: the half of it that decides interfaces.

Macros that the sources in reach define are expanded, conditionals over known symbols are decided. What depends on a
symbol that is not known keeps its directives; those lines are remembered as ``uncertain``. Pure, but for the
``include`` that is handed in.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

from enclave_addons.inference.cpp.reading.built import Definitions

# Name as written, in quotes -> the file, None if not in reach.
Include = Callable[[str, bool], "Preprocessed | None"]

_TOKENS = re.compile(
    r'R"(?P<d>[^\s()\\]{0,16})\((?:.|\n)*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*(?:.|\n)*?\*/'
)
_USED = re.compile(r'(?<!["\w])[A-Za-z_]\w*')
_CALLED = re.compile(r"\b([A-Za-z_]\w*)\s*\(")
_DIRECTIVE = re.compile(r"\s*#\s*(\w+)\s*(.*)")
_DEFINE = re.compile(r"(\w+)(\(([^)]*)\))?\s*(.*)", re.DOTALL)
_INCLUDE = re.compile(r'([<"])([^>"]+)[>"]')
_EXPORT = re.compile(
    r"\b[A-Z][A-Z0-9_]*_(?:PUBLIC|EXPORT|API|LOCAL|DLL|IMPORT|PUBLIC_TYPE|VISIBILITY|DECL|SYMBOL)\b(?!\s*\()"
)
_BEFORE_CLASS_NAME = re.compile(
    r"\b(class|struct)(\s+)([A-Za-z_]\w*)(\s*\([^()]*\))?(?=\s+(?!final\b)[A-Za-z_]\w*(?:\s*::\s*\w+)*\s*(?:final\s*)?[:{<])"
)
_DISAMBIGUATOR = re.compile(
    r"(?<=->)\s*template\b|(?<=\.)\s*template\b|(?<=::)\s*template\b|\btypename\b(?=\s+[\w:]+::)"
)
_BARE_MACRO = re.compile(r"[ \t]*([A-Z][A-Z0-9_]{2,})\s*(\([^()\n]*\))?[ \t]*;?[ \t]*\Z")
_ATTRIBUTE = re.compile(
    r"\[\[[^\[\]]*\]\]|__attribute__\s*\(\([^()]*(?:\([^()]*\))?[^()]*\)\)|\balignas\s*\([^()]*\)|\b__declspec\s*\([^()]*\)"
)
_CUDA = re.compile(
    r"\b__(?:global|device|host|shared|constant|managed|forceinline|noinline|restrict)__\b|<<<[^;{}]*?>>>"
)
_HARMLESS_MACROS = re.compile(
    r"(?:Q_|RCLCPP_|RCUTILS_|RCPPUTILS_|PLUGINLIB_|CLASS_LOADER_|EIGEN_|BOOST_|TEST|CERES_|CREATE_LOGGER|"
    r"GENERATE_|COMPOSITION_|YAML_|TRACETOOLS_|TRACEPOINT|ROSIDL_|DIAGNOSTIC_|NOLINT|POINT_CLOUD_REGISTER|G2O_|PCL_ADD_|"
    r"(?:ROS|U|RVIZ_COMMON_LOG|LOG|SPDLOG)_?(?:DEBUG|INFO|WARN|WARNING|ERROR|FATAL|ASSERT)(?:_STREAM)?(?:_THROTTLE|_ONCE|_COND|_NAMED)?\b|"
    r"ASSERT_|EXPECT_|MOVEIT_(?:CLASS|STRUCT)_FORWARD|FD_(?:SET|CLR|ZERO)\b|CPU_(?:SET|CLR|ZERO)\b)"
)  # fmt: skip


# <cinttypes>: formats between string literals, which the grammar does not take for texts
_STANDARD = {f"PRI{form}{size}": '""' for form in "diuxX" for size in ("8", "16", "32", "64", "PTR")}


@dataclass
class Preprocessed:
    """``text`` has the lines of the file. ``uncertain``: first line, last line, condition and line of the ``#if``."""

    file: str
    text: str = ""
    macros: dict[str, Macro] = field(default_factory=dict)
    includes: list[str] = field(default_factory=list)  # files in reach
    foreign: dict[str, int] = field(default_factory=dict)  # headers that are not, with their line
    uncertain: list[tuple[int, int, str, int]] = field(default_factory=list)
    unknown_macros: list[tuple[int, str]] = field(default_factory=list)
    # Line, name and body of those that are used where it is not known, or not followed, what they stand for.
    open_macros: list[tuple[int, str, str]] = field(default_factory=list)

    @cached_property
    def called(self) -> frozenset[str]:
        """Return every word in front of a parenthesis: a macro of who includes the file may be among them."""
        return frozenset(_CALLED.findall(self.text))


def preprocess(file: str, source: str, definitions: Definitions, include: Include) -> Preprocessed:
    """Preprocess a file that is compiled with ``definitions``."""
    return _Pass(file, definitions, include).run(source)


@dataclass
class _Conditional:
    line: int
    parent: bool
    taken: bool  # a branch before was certainly taken
    state: bool | None  # of this branch
    written: bool  # the directives stay in the text
    condition: str
    start: int = 0


class _Pass:
    def __init__(self, file: str, definitions: Definitions, include: Include):
        self.result = Preprocessed(file)
        symbols = {**_STANDARD, **dict(definitions.symbols)}
        self.macros = {name: Macro(None, value) for name, value in symbols.items()}
        self.macros |= {name: Macro(None, "", uncertain=True) for name in definitions.open}
        self.bodies: dict[str, str] = {}  # by name: all that it was ever defined as in this file
        self.complete = definitions.complete
        self.include = include
        self.stack: list[_Conditional] = []
        self.pending: list[str] = []
        self.expanded: list[str] = []

    def run(self, source: str) -> Preprocessed:
        lines = _without_comments(source).split("\n")
        self.guards = _guards_of(lines)
        out = self.pending
        index = 0
        while index < len(lines):
            line, first = lines[index], index
            if line.lstrip().startswith("#"):
                while line.endswith("\\") and index + 1 < len(lines):
                    index += 1
                    line = line[:-1] + " " + lines[index]
                out.append(self._directive(line, first + 1))
                out.extend("" for _ in range(index - first))
            else:
                out.append(line if self._active() else "")
            index += 1
        self._expand()
        self.result.text = self._tidied("\n".join(self.expanded))
        self.result.macros = self.macros
        return self.result

    def _expand(self) -> None:
        """Expand what was read by the macros that are defined here; those behind it may be others."""
        source = "\n".join(self.pending)
        if self.pending:
            first = 1 + sum(part.count("\n") + 1 for part in self.expanded)
            source = expanded(source, self.macros)
            self.expanded.append(source)
            self.pending.clear()
            for match in _USED.finditer(source):
                macro = self.macros.get(match[0])
                if macro is not None and macro.uncertain:
                    line = first + source.count("\n", 0, match.start())
                    self.result.open_macros.append((line, match[0], macro.body))

    def _active(self) -> bool:
        return not self.stack or (self.stack[-1].parent and self.stack[-1].state is not False)

    def _directive(self, line: str, number: int) -> str:
        match = _DIRECTIVE.match(line)
        if match is None:
            return ""
        word, rest = match[1], match[2].strip()
        if word in ("if", "ifdef", "ifndef"):
            return self._open(word, rest, number)
        if word in ("elif", "else", "endif"):
            return self._next(word, rest, number) if self.stack else ""
        if self._active() and word in ("define", "undef", "include"):
            if any(map(str.strip, self.pending)):
                self._expand()
            if word == "define":
                self._define(rest)
            elif word == "undef":
                self._undefine(rest)
            else:
                self._include(rest, number)
        return ""

    def _open(self, word: str, rest: str, number: int) -> str:
        parent = self._active()
        condition = {"ifdef": f"defined({rest})", "ifndef": f"!defined({rest})"}.get(word, rest)
        state: bool | None = False
        if parent:
            state = True if word == "ifndef" and rest in self.guards else self._decide(condition)
        written = parent and state is None
        self.stack.append(_Conditional(number, parent, state is True, state, written, condition, number))
        return f"#if {_symbol(condition)}" if written else ""

    def _next(self, word: str, rest: str, number: int) -> str:
        top = self.stack[-1]
        self._close(top, number)
        if word == "endif":
            self.stack.pop()
            return "#endif" if top.written else ""
        top.start = number
        before = top.state
        if not top.parent or top.taken:
            top.state = False
        elif word == "else":
            top.state = None if top.written else True
            top.condition = f"else of {top.condition}"
        else:
            top.state = self._decide(rest)
            top.condition = rest
            if top.state is True and top.written:
                top.taken, top.state = True, None
            elif top.state is True:
                top.taken = True
        if not top.written:
            if top.state is None and before is False:
                top.written = True
                return f"#if {_symbol(rest)}"
            return ""
        return "#else" if top.state is not False else ""

    def _close(self, top: _Conditional, number: int) -> None:
        if top.parent and top.state is None:
            self.result.uncertain.append((top.start + 1, number - 1, top.condition, top.line))

    def _decide(self, condition: str) -> bool | None:
        return decided(condition, self.macros, self.complete, self._has_include)

    def _has_include(self, name: str) -> bool | None:
        return True if self.include(name, False) is not None else None

    def _define(self, rest: str) -> None:
        match = _DEFINE.match(rest)
        if match is None:
            return
        parameters = [part.strip() for part in match[3].split(",")] if match[2] else None
        uncertain = any(each.state is None for each in self.stack)
        body = match[4].strip()
        before = self.macros.get(match[1])
        if uncertain and before is not None:
            body = f"{before.body} {body}"  # either may be meant: who asks what an uncertain one leads to reads both
        self.macros[match[1]] = Macro(parameters, body, uncertain)
        self.bodies[match[1]] = f"{self.bodies.get(match[1], '')} {body}"

    def _undefine(self, name: str) -> None:
        """Forget a macro; one that is undefined under an open condition may still be there."""
        if not any(each.state is None for each in self.stack):
            self.macros.pop(name, None)
        elif name in self.macros:
            self.macros[name] = self.macros[name]._replace(uncertain=True)

    def _include(self, rest: str, number: int) -> None:
        match = _INCLUDE.search(rest)
        if match is None:
            return
        found = self.include(match[2], match[1] == '"')
        if found is None:
            self.result.foreign.setdefault(match[2], number)
            return
        self.result.includes.append(found.file)
        for name in sorted(found.called & self.macros.keys() - found.macros.keys()):
            if self.macros[name].parameters is not None:
                self.result.open_macros.append((number, name, self.macros[name].body))
        for name, macro in found.macros.items():
            self.macros.setdefault(name, macro)

    def _tidied(self, source: str) -> str:
        """Expand macros, and blank what only the compiler and linker read, such as export macros."""
        source = _EXPORT.sub(_blank, source)
        source = _ATTRIBUTE.sub(_blank, source)
        source = _CUDA.sub(_blank, source)
        source = _DISAMBIGUATOR.sub(_blank, source)
        source = _BEFORE_CLASS_NAME.sub(self._class_macro, source)
        return self._bare_macros(source)

    def _class_macro(self, match: re.Match[str]) -> str:
        whole = match[0]
        return match[1] + re.sub(r"[^\n]", " ", whole[len(match[1]) :])

    def _bare_macros(self, source: str) -> str:
        """Blank macros that stand alone on their line, as ``Q_OBJECT`` does: they confuse the grammar."""
        lines = source.split("\n")
        before = ";"
        for index, line in enumerate(lines):
            match = _BARE_MACRO.match(line)
            if (
                match
                and before in ";{}:#"
                and not match[1].startswith(("PLUGINLIB_EXPORT", "RCLCPP_COMPONENTS_REG", "CLASS_LOADER_REG"))
            ):
                if not _HARMLESS_MACROS.match(match[1]) and not _follows(lines, index):
                    self._standing_alone(match[1], index + 1)
                if not line.rstrip().endswith(";"):
                    lines[index] = ""
            stripped = lines[index].strip()
            if stripped:
                before = "#" if stripped.startswith("#") else stripped[-1]
        return "\n".join(lines)

    def _standing_alone(self, name: str, number: int) -> None:
        """Note a macro: one that this file or its headers define is judged by that, another is not known."""
        if name in self.bodies or name in self.macros:
            included = self.macros[name].body if name in self.macros else ""
            self.result.open_macros.append((number, name, f"{self.bodies.get(name, '')} {included}"))
        else:
            self.result.unknown_macros.append((number, name))


def _follows(lines: list[str], index: int) -> bool:
    """Return whether the next text goes on with the same declaration: then it was an attribute."""
    for line in lines[index + 1 :]:
        if line.strip():
            return bool(re.match(r"\s*(?:[a-z_]\w*[\s:<*&]|~|[A-Z]\w*\s*\()", line))
    return False


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match[0])


def _symbol(condition: str) -> str:
    return re.sub(r"[^\w]", "_", condition)[:60] or "X"


def _without_comments(source: str) -> str:
    def kept(match: re.Match[str]) -> str:
        found = match[0]
        return re.sub(r"[^\n]", " ", found) if found.startswith(("//", "/*")) else found

    return _TOKENS.sub(kept, source.replace("\r\n", "\n"))


def _guards_of(lines: list[str]) -> frozenset[str]:
    """Return symbols that guard against a second inclusion: ``#ifndef X`` and, with nothing between, ``#define X``."""
    words = [line.split() for line in lines if line.strip()]
    return frozenset(
        first[1]
        for first, second in pairwise(words)
        if len(first) == 2 == len(second) and first[0] == "#ifndef" and second == ["#define", first[1]]
    )


# --- macros -----------------------------------------------------------------------------------------------------


MAX_DEPTH = 12

_WORD = re.compile(
    r'R"(?P<d>[^\s()\\]{0,16})\((?:.|\n)*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|[A-Za-z_]\w*'
)
_CLOSERS = {")": "(", "]": "[", "}": "{"}

# What compilers for ROS 2's Linux targets define, with its value if that is always the same, and what they never define
# (GCC and Clang, predefined macros).
_PREDEFINED: dict[str, int | None] = {
    "__linux__": 1, "__unix__": 1, "__GNUC__": None, "__cplusplus": None, "__has_include": None, "true": 1, "false": 0,
}  # fmt: skip
_NEVER_DEFINED = frozenset({
    "_WIN32", "WIN32", "_WIN64", "_MSC_VER", "__MINGW32__", "__CYGWIN__", "__APPLE__", "__ANDROID__", "__QNX__",
    "__EMSCRIPTEN__", "__CUDACC__", "_DEBUG",
})  # fmt: skip


class Macro(NamedTuple):
    """``parameters``: ``None`` for a macro without parentheses. ``uncertain``: defined under an open condition."""

    parameters: list[str] | None
    body: str
    uncertain: bool = False


def expanded(source: str, macros: Mapping[str, Macro], depth: int = 0) -> str:
    """Replace every use of ``macros`` in ``source``, on the line where the use begins."""
    if not macros or depth > MAX_DEPTH:
        return source
    out: list[str] = []
    position = 0
    for match in _WORD.finditer(source):
        word = match[0]
        macro = macros.get(word)
        if match.start() < position or macro is None or macro.uncertain:
            continue
        end, given = match.end(), None
        if macro.parameters is not None:
            given, end = _arguments(source, match.end())
            if given is None:
                continue
        rest = {name: each for name, each in macros.items() if name != word}
        scanned = [expanded(each, macros, depth + 1) for each in given or ()]
        body = expanded(_filled(macro, given or [], scanned), rest, depth + 1)
        out += [source[position : match.start()], body, "\n" * source.count("\n", match.start(), end)]
        position = end
    out.append(source[position:])
    return "".join(out)


def _arguments(source: str, position: int) -> tuple[list[str] | None, int]:
    """Return the texts between parentheses and the place behind them."""
    while position < len(source) and source[position].isspace():
        position += 1
    if position >= len(source) or source[position] != "(":
        return None, position
    found: list[str] = [""]
    depth = 0
    while position < len(source):
        literal = _WORD.match(source, position) if source[position] in "\"'R" else None
        piece = literal[0] if literal else source[position]
        position += len(piece)
        if piece in ("(", "[", "{"):
            depth += 1
            if depth == 1:
                continue
        elif piece in _CLOSERS:
            depth -= 1
            if depth == 0:
                return [each.strip() for each in found], position
        if piece == "," and depth == 1:
            found.append("")
        else:
            found[-1] += " " if piece == "\n" else piece
    return None, position


def _filled(macro: Macro, given: list[str], scanned: list[str]) -> str:
    """Fill the body with its arguments: as written beside ``#`` and ``##``, else ``scanned`` ([cpp.subst])."""
    if not macro.parameters:
        return macro.body
    values, expanded_ones = _by_name(macro, given), _by_name(macro, scanned)
    body = re.sub(r"(?<!#)#\s*(\w+)", lambda m: _quoted(values[m[1]]) if m[1] in values else m[0], macro.body)
    if "##" in body:
        body = re.sub(r"(\w+)(?=\s*##)|(?<=##)(\s*\w+)", lambda m: values.get(m[0].strip(), m[0]), body)
        body = re.sub(r"\s*##\s*", "", body)
    return _WORD.sub(lambda m: expanded_ones.get(m[0], m[0]), body)


def _by_name(macro: Macro, given: list[str]) -> dict[str, str]:
    names = [name for name in macro.parameters or () if name]
    values = dict(zip(names, given, strict=False))
    if names and names[-1].endswith("..."):
        values["__VA_ARGS__"] = ", ".join(given[len(names) - 1 :])
    return values


def _quoted(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'


# --- conditions ---------------------------------------------------------------------------------------------


MAX_CONDITION = 1_000
"""Characters of an ``#if`` that is looked at."""
_OPEN = "open"
_OPERAND = re.compile(
    r"__has_include\s*\(\s*[<\"](?P<header>[^>\"]*)[>\"]\s*\)"
    r"|\bdefined\s*\(\s*(?P<within>\w+)\s*\)|\bdefined\s+(?P<behind>\w+)"
    r"|\b(?P<called>[A-Za-z_]\w*)\s*\((?P<given>[^()]*)\)"
    r"|\b(?P<number>\d+)[uUlL]*\b|\b(?P<symbol>[A-Za-z_]\w*)"
)
_SIGNS = {r"&&": " and ", r"\|\|": " or ", r"!(?!=)": "~"}  # ~ binds as tightly as ! does
_COMPARE: dict[type[ast.cmpop], Callable[[int, int], bool]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.Gt: operator.gt,
    ast.LtE: operator.le, ast.GtE: operator.ge,
}  # fmt: skip


def decided(
    condition: str, macros: Mapping[str, Macro], complete: bool, has_include: Callable[[str], bool | None]
) -> bool | None:
    """Return the value of an ``#if``; ``None`` if a symbol in it may be defined where we cannot see it."""

    def operand(match: re.Match[str]) -> str:
        found: int | None
        if match["header"]:
            found = has_include(match["header"])
        elif name := match["within"] or match["behind"]:
            found = _is_defined(name, macros, complete)
        elif match["called"]:
            found = _at_least(match["called"], match["given"], macros)
        else:
            found = int(match["number"]) if match["number"] else _number(match["symbol"], macros, complete)
        return _OPEN if found is None else str(int(found))

    written = _OPERAND.sub(operand, condition[:MAX_CONDITION])
    for sign, in_python in _SIGNS.items():
        written = re.sub(sign, in_python, written)
    try:
        value = _evaluated(ast.parse(written.strip(), mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    return None if value is None else bool(value)


def _evaluated(node: ast.expr) -> int | None:
    """Return the value of a condition that is written as in Python; ``None`` if something open decides it."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int):
        return node.value
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Invert):
        inner = _evaluated(node.operand)
        return None if inner is None else int(not inner)
    if isinstance(node, ast.BoolOp):
        found = [_evaluated(each) for each in node.values]
        decisive = isinstance(node.op, ast.Or)
        if any(each is not None and bool(each) is decisive for each in found):
            return int(decisive)
        return None if None in found else int(not decisive)
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        left, right = _evaluated(node.left), _evaluated(node.comparators[0])
        return None if left is None or right is None else int(_COMPARE[type(node.ops[0])](left, right))
    return None


def _is_defined(name: str, macros: Mapping[str, Macro], complete: bool) -> bool | None:
    if name in macros:
        return None if macros[name].uncertain else True
    if name in _PREDEFINED:
        return True
    is_ours = complete and not name.startswith("_")  # other compilers and processors define names with _
    return False if is_ours or name in _NEVER_DEFINED else None


def _at_least(name: str, given: str, macros: Mapping[str, Macro]) -> bool | None:
    """Decide ``RCLCPP_VERSION_GTE(28, 0, 0)``, of the ``version.h`` that ament_generate_version_header() writes."""
    wanted = [int(each) for each in re.findall(r"\d+", given)]
    stem = name.removesuffix("GTE")
    present = [_number(stem + part, macros, False) for part in ("MAJOR", "MINOR", "PATCH")]
    known = [each for each in present if each is not None]
    return known >= wanted if name.endswith("_VERSION_GTE") and len(known) == 3 == len(wanted) else None


def _number(name: str, macros: Mapping[str, Macro], complete: bool) -> int | None:
    macro = macros.get(name)
    if macro is None and _is_defined(name, macros, complete) is False:
        return 0
    if macro is None or macro.parameters is not None or macro.uncertain:
        return _PREDEFINED.get(name) if macro is None else None
    body = macro.body.strip("() LlUu")
    return int(body) if body.isdecimal() else {"": 1, "true": 1, "ON": 1, "false": 0}.get(body)
