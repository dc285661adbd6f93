"""What launch files read and write with PyYAML is the same with libyaml behind it, errors included."""

from __future__ import annotations

import copy
import io
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from enclave_launch.boundary.plain_yaml import block_text, known_parts
from enclave_launch.frontend import fast_yaml
from enclave_launch.frontend.fast_yaml import accelerated, libyaml_for_launch_files
from enclave_launch.ros_rules.parameter_file import parts_of

LOADERS = [yaml.SafeLoader, yaml.FullLoader]
YAML = "tag:yaml.org,2002:"
INCREASE_INDENT = yaml.emitter.Emitter.increase_indent

# fmt: off
FRAGMENTS = [
    "a", "b: ", "- ", ": ", "\n", "  ", "'", '"', "#c", "{", "}", "[", "]", ",", "&x ", "*x", "1", "0o7", "1e3", "true",
    "~", "null", "2001-01-01", "|\n", ">-\n  ", "...\n", "---\n", "%", "@", "`", "é", "\\", "k: v\n", "- 1\n", "? ",
    "!", "!!str ", "\t", "<<: ", "0x1F", "1:30", ".inf", " ",
]
# fmt: on

texts = st.lists(st.sampled_from(FRAGMENTS), max_size=14).map("".join)
words = st.sampled_from(
    ["a", "true", "1", "1.0", "~", "", "-", "- x", "a b", "a: b", "#", "'q'", "x" * 60, "word " * 7, "=", "<<", "é",
     "a\nb", "*", "%x", "@", "[b]", ":", "a:", "?", " lead", "trail ", "1e5", "1_000", "12:30", "2001-01-01", "...",
     "---", "/a/path.xml", "a #b", ">", "|"]
)  # fmt: skip
printable = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=8)
sentences = st.lists(printable, max_size=30).map(" ".join)  # longer than a line
keys_of_sentences = sentences.map(lambda text: text[:100])
scalars = st.one_of(
    sentences,
    st.booleans(),
    st.none(),
    st.integers(),
    st.floats(allow_nan=False),
    words,
    st.text(max_size=50),
)
trees = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(st.one_of(words, keys_of_sentences, scalars), inner, max_size=4),
    ),
    max_leaves=25,
)


def outcome(function: Callable[[], Any]) -> tuple[str, str]:
    try:
        return "gives", repr(function())
    except Exception as error:
        return type(error).__name__, str(error)


@pytest.mark.parametrize("loader", LOADERS)
@given(text=texts)
@example(text="a: 1\t#c")  # a tab before a comment: libyaml takes it, PyYAML does not
@example(text="a: [1, 2\n")
@example(text="a: &x {b: 1}\nc: *x\n")
@settings(max_examples=150)
def test_a_text_reads_the_same(loader: Any, text: str) -> None:
    plainly = outcome(lambda: yaml.load(text, loader))
    of_a_file = outcome(lambda: yaml.load(named(text), loader))
    with accelerated(yaml):
        assert outcome(lambda: yaml.load(text, loader)) == plainly
        assert outcome(lambda: yaml.load(named(text), loader)) == of_a_file


def named(text: str) -> io.StringIO:
    file = io.StringIO(text)
    file.name = "params.yaml"
    return file


@pytest.mark.parametrize(
    "options",
    [{}, {"sort_keys": False}, {"default_flow_style": True}, {"width": 20}, {"Dumper": yaml.SafeDumper}],
    ids=str,
)
@given(tree=trees)
@example(tree={"": 1})  # an empty key has a form of its own
@example(
    tree={
        "a": "word " * 40 + "end",
        "b": ["'" + " word" * 40 + " '", [("x  y " * 20,), {"k" * 90: "a b" * 9}]],
    }
)
@example(
    tree={"a": 1e-10, "b": -1e300, "c": 5e-324, "d": float("inf"), "e": float("nan"), "f": 1e16, "g": -0.0}
)
@example(tree={"a": "$" + "x" * 90 + " '"})  # its last quote closes nothing: folded before it
@example(tree=[[], {}, (), [[[]]], ({},), {"a": [{"b": (1, [2])}]}])
@example(
    tree={
        "a": "::",
        "b": "a::b",
        "c": "a:",
        "d": ": a",
        "e": "a: b",
        "f": "a #b",
        "g": "Y",
        "h": "1.0",
        "i": "1:30",
    }
)
@settings(max_examples=60)
def test_values_are_written_the_same(options: dict[str, Any], tree: Any) -> None:
    plainly = outcome(lambda: yaml.dump(tree, **options))
    with accelerated(yaml):
        assert outcome(lambda: yaml.dump(tree, **options)) == plainly
        into = io.StringIO()
        if plainly[0] == "gives":
            assert yaml.dump(tree, into, **options) is None
            assert repr(into.getvalue()) == plainly[1]
            known = known_parts(into.getvalue())
            assert known is None or known == [part[:3] for part in parts_of(into.getvalue())]


def test_nesting_that_ends_the_stack_of_libyaml_is_pyyamls_error() -> None:
    deep = "[" * 3_000
    with accelerated(yaml), pytest.raises(RecursionError):
        yaml.safe_load(deep)


def test_without_a_loader_it_is_as_in_pyyaml() -> None:
    plainly = outcome(lambda: yaml.load("a: 1"))  # type: ignore[call-arg]
    with accelerated(yaml):
        assert outcome(lambda: yaml.load("a: 1"))[0] == plainly[0]  # type: ignore[call-arg]


def test_each_reader_has_values_of_its_own() -> None:
    with accelerated(yaml):
        first, second = yaml.safe_load("a: [1]\n"), yaml.safe_load("a: [1]\n")
        first["a"].append(2)
        assert second == {"a": [1]}


def test_a_loader_that_was_taught_a_tag_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    class Taught(yaml.SafeLoader):
        pass

    Taught.add_constructor("tag:yaml.org,2002:int", lambda loader, node: "a number")
    with accelerated(yaml):
        assert yaml.load("a: 1", Taught) == {"a": "a number"}
        monkeypatch.setattr(yaml.SafeLoader, "yaml_constructors", dict(Taught.yaml_constructors))
        assert yaml.safe_load("a: 1") == {"a": "a number"}


def no_value_twice(self: Any, node: Any, deep: bool = False) -> Any:
    raise ValueError("this one refuses every mapping")


@pytest.mark.parametrize(
    ("teach", "text"),
    [
        (
            lambda: yaml.SafeLoader.add_constructor("!twice", lambda loader, node: 2 * node.value),
            "a: !twice x",
        ),
        (
            lambda: yaml.constructor.SafeConstructor.add_constructor(f"{YAML}int", lambda loader, node: "n"),
            "a: 1",
        ),
        (lambda: setattr(yaml.constructor.SafeConstructor, "construct_mapping", no_value_twice), "a: 1"),
        (lambda: yaml.resolver.Resolver.add_implicit_resolver("!e", re.compile("1e3"), ["1"]), "a: 1e3"),
        (lambda: yaml.resolver.Resolver.add_implicit_resolver("!w", re.compile("w"), None), "a: w"),
        (lambda: yaml.resolver.Resolver.yaml_implicit_resolvers.update(t=[]), "a: true"),
        (
            lambda: yaml.resolver.Resolver.yaml_implicit_resolvers.update(
                t=[(f"{YAML}int", re.compile("t"))]
            ),
            "a: true",
        ),
        (lambda: yaml.resolver.Resolver.add_path_resolver(f"{YAML}set", [], dict), "a: 1"),
        (lambda: setattr(yaml.SafeLoader, "flatten_mapping", no_value_twice), "a: 1"),
    ],
)
def test_what_is_taught_in_place_counts_at_once(
    teach: Callable[[], None], text: str, untouched: None
) -> None:
    with accelerated(yaml):
        before = yaml.safe_load("a: 1")
        teach()
        fast = outcome(lambda: yaml.safe_load(text))
        assert before == {"a": 1}
    assert fast == outcome(lambda: yaml.safe_load(text))
    assert fast != ("gives", "{'a': 1}")


@pytest.mark.parametrize(
    "teach",
    [
        lambda: yaml.add_representer(str, lambda dumper, text: dumper.represent_scalar("!t", text)),
        lambda: yaml.representer.SafeRepresenter.add_representer(str, in_quotes),
        lambda: yaml.SafeDumper.add_representer(str, in_quotes),
        lambda: yaml.representer.Representer.add_representer(str, in_quotes),
        lambda: setattr(yaml.Dumper, "increase_indent", deeper),
        lambda: setattr(yaml.emitter.Emitter, "increase_indent", deeper),
    ],
)
def test_a_dumper_that_was_taught_writes_so(teach: Callable[[], None], untouched: None) -> None:
    values = {"a": ["text", "a #b"]}
    with accelerated(yaml):
        plain = yaml.dump(values), yaml.safe_dump(values)
        teach()
        taught = yaml.dump(values), yaml.safe_dump(values)
    assert taught == (yaml.dump(values), yaml.safe_dump(values))
    assert taught != plain


def in_quotes(dumper: Any, text: str) -> Any:
    return dumper.represent_scalar(f"{YAML}str", text, style='"')


def deeper(self: Any, flow: bool = False, indentless: bool = False) -> None:
    INCREASE_INDENT(self, flow, False)


@pytest.fixture
def untouched() -> Iterator[None]:
    """PyYAML's classes afterwards as they were."""
    classes = {
        base: {
            name: {key: copy.copy(found) for key, found in value.items()} if type(value) is dict else value
            for name, value in vars(base).items()
        }
        for own in (yaml.SafeLoader, yaml.Dumper, yaml.SafeDumper)
        for base in own.__mro__[:-1]
    }
    yield
    for base, before in classes.items():
        for name in [name for name in vars(base) if name not in before]:
            delattr(base, name)
        for name, value in before.items():
            if callable(value) or type(value) is dict:
                setattr(base, name, value)


def test_pyyaml_is_as_it_was_afterwards() -> None:
    before = yaml.load, yaml.dump, yaml.safe_load, yaml.safe_dump
    with libyaml_for_launch_files():
        assert yaml.load is not before[0]
        with libyaml_for_launch_files():
            assert yaml.safe_load("1") == 1
        assert yaml.load is not before[0]
    assert (yaml.load, yaml.dump, yaml.safe_load, yaml.safe_dump) == before


def test_a_later_import_gets_it_too() -> None:
    program = (
        "import sys\n"
        "from enclave_launch.frontend.fast_yaml import libyaml_for_launch_files\n"
        "with libyaml_for_launch_files():\n"
        "    assert 'yaml' not in sys.modules\n"
        "    import yaml\n"
        "    fast = type(yaml.load).__name__\n"
        "print(fast, type(yaml.load).__name__, yaml.safe_load('a: 1'))\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.split("\n")[0] == "_Load function {'a': 1}"


def test_what_may_not_stand_in_yaml_is_refused_though_its_pattern_is_compiled_late() -> None:
    program = (
        "from enclave_launch.frontend.fast_yaml import libyaml_for_launch_files\n"
        "with libyaml_for_launch_files():\n"
        "    import re, yaml\n"
        "import copy\n"
        "compiled = isinstance(yaml.reader.Reader.NON_PRINTABLE, re.Pattern)\n"
        "for _, pattern in yaml.SafeLoader.yaml_implicit_resolvers['t']:\n"
        "    assert isinstance(copy.copy(pattern), re.Pattern) and pattern.match('true')\n"
        "for text in ('a: 1 \\u00e9\\U0001f600', 'a: \\x01'):\n"
        "    try:\n"
        "        print(compiled, yaml.safe_load(text))\n"
        "    except yaml.reader.ReaderError as error:\n"
        "        print(str(error).splitlines()[0])\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, check=True, encoding="utf-8",
        env={**os.environ, "PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip
    assert run.stdout.splitlines() == [
        "False {'a': '1 é😀'}",
        "unacceptable character #x0001: special characters are not allowed",
    ]


def test_parameter_files_of_nav2s_size_go_the_fast_way(tmp_path: Path) -> None:
    tree = {f"server_{i}": {"ros__parameters": {f"p{j}": j * 0.5 for j in range(30)}} for i in range(10)}
    file = tmp_path / "nav2_params.yaml"
    file.write_text(yaml.dump(tree))
    fast_yaml._read.cache_clear()
    with accelerated(yaml), file.open() as stream:
        assert yaml.safe_load(stream) == tree
    assert fast_yaml._read.cache_info().currsize == 1
    assert block_text(tree) == file.read_text()


def test_what_an_alias_names_is_the_same_object_for_its_reader() -> None:
    with accelerated(yaml):
        for _ in range(2):
            read = yaml.safe_load("a: &x [1]\nb: *x\n")
            assert read["a"] is read["b"]


@pytest.mark.parametrize(
    "text", ["a: 2026-11-22\n", "a: !!set {b, c}\n", "a: !!binary aGk=\n", "a: .inf\nb: -0.0\n"]
)
def test_values_of_every_kind_are_those_of_pyyaml(text: str) -> None:
    plainly = yaml.safe_load(text)
    with accelerated(yaml):
        for _ in range(2):
            assert repr(yaml.safe_load(text)) == repr(plainly)


EQUAL_TO_PYTHON = (
    {"a": 1},
    {"a": 1.0},
    {"a": True},
    {"b": 1, "a": 2},
    {"a": 2, "b": 1},
    {"a": 0.0},
    {"a": -0.0},
)


@pytest.mark.parametrize(
    "options", [{}, {"sort_keys": False}, {"default_flow_style": None}, {"sort_keys": 0}]
)
def test_values_that_python_takes_for_equal_are_written_each_in_its_own_way(options: dict[str, Any]) -> None:
    plainly = [yaml.dump(value, **options) for value in EQUAL_TO_PYTHON]
    with accelerated(yaml):
        for _ in range(2):
            assert [yaml.dump(value, **options) for value in EQUAL_TO_PYTHON] == plainly


def test_what_is_written_is_as_it_is_at_that_moment() -> None:
    values = {"a": [1]}
    with accelerated(yaml):
        first = yaml.dump(values)
        values["a"].append(2)
        assert yaml.dump(values) != first
