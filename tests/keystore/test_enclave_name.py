"""What is an enclave name: rcl's rules, tightened by what the DDS implementations carry."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from keystore import InvalidEnclaveNameError
from keystore.disk import layout
from keystore.formats.enclave_name import MAX_LENGTH, check_distinct, segments, validate_enclave_name

GOOD = ["/", "/a", "/_", "/a/_b", "/Front/camera_2", "/" + "a" * 244, "/" + "/".join("abcdefghijklmnopqrs")]
BAD = {
    "": "empty",
    "a": "absolute",
    "a/b": "absolute",
    "/a/": "end with '/'",
    "//": "end with '/'",
    "//a": "'//'",
    "/a//b": "'//'",
    "/..": "not paths",
    "/a/../b": "not paths",
    "/./a": "not paths",
    "/1a": "digit",
    "/a b": "characters",
    "/a\n": "characters",
    "/a\0": "characters",
    "/a%2e%2e": "characters",
    "/é": "characters",
    "/cert.pem": "characters",
    "/~": "characters",
    "/\x1b[31mred": "characters",
    "/" + "a" * 245: "246 characters",
    "/" + "/".join("abcdefghijklmnopqrst"): "20 segments",
}


@pytest.mark.parametrize("name", GOOD)
def test_good_names_come_back_unchanged(name: str) -> None:
    assert validate_enclave_name(name) == name


@pytest.mark.parametrize(("name", "reason"), BAD.items())
def test_bad_names_are_refused_with_the_reason(name: str, reason: str) -> None:
    with pytest.raises(InvalidEnclaveNameError) as caught:
        validate_enclave_name(name)
    assert reason in caught.value.reason
    assert str(caught.value).isprintable(), "a name must not smuggle escape sequences into the terminal"


@given(st.text(alphabet=st.sampled_from("aZ_9/.\\ ~%\0\n-é"), max_size=30) | st.text(max_size=MAX_LENGTH + 9))
def test_no_name_however_hostile_has_a_directory_outside_the_enclaves(name: str) -> None:
    try:
        directory = layout.enclave_directory(name)
    except InvalidEnclaveNameError:
        return
    resolved = os.path.normpath(f"/keystore/{directory}")
    assert resolved == f"/keystore/{directory}", "one name, one spelling"
    assert resolved == "/keystore/enclaves" or resolved.startswith("/keystore/enclaves/")
    assert Path(directory).name not in layout.ENCLAVE_FILES, "a directory never takes a file's place"


def test_segments() -> None:
    assert segments("/") == ()
    assert segments("/a/b") == ("a", "b")


def test_names_that_differ_only_in_case_would_share_a_directory_on_some_file_systems() -> None:
    check_distinct(["/a/b", "/a/c", "/a"])
    for names in (["/a", "/A"], ["/front/camera", "/Front/lidar"], ["/a/b", "/A"]):
        with pytest.raises(InvalidEnclaveNameError, match="only in case"):
            check_distinct(names)
