"""PyYAML within launch files: libyaml where it does the same, PyYAML's own way elsewhere."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from enclave_launch.frontend.libyaml import dump, libyaml_for_launch_files, load

SAFE_LOAD, DUMP = yaml.safe_load, yaml.dump


@pytest.fixture
def swapped() -> Iterator[None]:
    with libyaml_for_launch_files():
        yield


def test_pyyaml_is_as_it_was_afterwards() -> None:
    before = yaml.load, yaml.dump, yaml.safe_load, yaml.safe_dump
    with libyaml_for_launch_files():
        assert yaml.load is not before[0]
        with libyaml_for_launch_files():
            assert yaml.safe_load("1") == 1
        assert yaml.load is not before[0]
    assert (yaml.load, yaml.dump, yaml.safe_load, yaml.safe_dump) == before


@pytest.mark.usefixtures("swapped")
def test_a_stream_is_read_and_written() -> None:
    written = io.StringIO()
    yaml.safe_dump(yaml.safe_load(io.StringIO("a: [1, x]\n")), written)
    assert written.getvalue() == "a:\n- 1\n- x\n"


@pytest.mark.usefixtures("swapped")
@pytest.mark.parametrize("text", ["a: [1", "a:\n\t- b", "a: 1\t", "[a?]", "a: !x 1", "? [1]\n: 2", "a: *x"])
def test_errors_are_those_of_pyyaml(text: str) -> None:
    file = io.StringIO(text)
    file.name = "params.yaml"
    again = io.StringIO(text)
    again.name = "params.yaml"
    with pytest.raises(yaml.YAMLError) as theirs:
        SAFE_LOAD(file)
    with pytest.raises(yaml.YAMLError) as ours:
        yaml.safe_load(again)
    assert (type(ours.value), str(ours.value)) == (type(theirs.value), str(theirs.value))
    assert "params.yaml" in str(ours.value)


@pytest.mark.usefixtures("swapped")
def test_what_a_launch_file_taught_its_loader_and_dumper_counts() -> None:
    class Loader(yaml.SafeLoader):
        pass

    class Dumper(yaml.SafeDumper):
        pass

    Loader.add_constructor("!twice", lambda loader, node: 2 * node.value)
    Dumper.add_representer(
        str, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"')
    )
    assert yaml.load("a: !twice x", Loader) == {"a": "xx"}
    assert yaml.dump({"a": "x"}, Dumper=Dumper) == '"a": "x"\n'


@pytest.mark.usefixtures("swapped")
def test_what_a_launch_file_taught_pyyaml_itself_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml.SafeLoader, "yaml_constructors", yaml.SafeLoader.yaml_constructors.copy())
    yaml.SafeLoader.add_constructor("!twice", lambda loader, node: 2 * node.value)
    assert yaml.safe_load("a: !twice x") == {"a": "xx"}


@pytest.mark.usefixtures("swapped")
def test_without_a_loader_pyyaml_answers() -> None:
    if yaml.__version__ < "6":
        with pytest.warns(match="without Loader"):
            assert yaml.load("a: 1") == {"a": 1}  # type: ignore[call-arg]
    else:
        with pytest.raises(TypeError, match="Loader"):
            yaml.load("a: 1")  # type: ignore[call-arg]


@pytest.mark.usefixtures("swapped")
def test_a_list_with_two_names_is_one_list() -> None:
    read = yaml.safe_load("a: &x [1]\nb: *x\n")
    assert read["a"] is read["b"]


WRITTEN = [
    "",
    "x",
    "a b",
    "on",
    "1.5",
    "é",
    "a\nb",
    'a"\\',
    "x" * 200,
    "word " * 40,
    "\t",
    "- a",
    "a: b",
    "#",
]
TEXTS = st.sampled_from(WRITTEN) | st.text(max_size=120)
VALUES: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | TEXTS,
    lambda inner: st.lists(inner) | st.dictionaries(TEXTS, inner) | st.tuples(inner),
    max_leaves=20,
)


@given(VALUES, st.sampled_from([None, True, False]), st.booleans())
def test_what_is_written_is_what_pyyaml_writes(value: Any, flow: bool | None, in_order: bool) -> None:
    options: dict[str, Any] = {"default_flow_style": flow, "sort_keys": not in_order}
    assert dump(value, **options) == DUMP(value, **options)
    assert dump(value) == DUMP(value)


@given(VALUES)
def test_what_pyyaml_writes_is_read_as_pyyaml_reads_it(value: Any) -> None:
    text = DUMP(value)
    assert load(text, yaml.UnsafeLoader) == yaml.unsafe_load(text)
