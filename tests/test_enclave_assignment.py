"""Enclave of one process: the rules of the article "ROS 2 Security Enclaves", case by case."""

from __future__ import annotations

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import EnclaveScope, LaunchFileError
from enclave_launch.enclave import AssignmentReason, assign_enclave
from enclave_launch.process import EnclaveRequest, ProcessKind, ResolvedProcess


def process(
    request: EnclaveRequest, fqn: str = "<node_namespace_unspecified>/talker", kind: ProcessKind = "node"
) -> ResolvedProcess:
    return ResolvedProcess(
        number=1, kind=kind, package="p", executable="talker", process_name="talker-1",
        name=fqn.rpartition("/")[2], namespace=fqn.rpartition("/")[0], fqn=fqn, cmd=("talker",), remaps=(),
        parameters={}, environment={}, enclave=request, location=SourceLocation("/w/a.launch.xml", 3, "node"),
    )  # fmt: skip


CASES = {
    "no attribute, nothing pushed: the root": (EnclaveRequest(), "/", AssignmentReason.ROOT),
    "no attribute below a pushed namespace": (EnclaveRequest(scope="/foo"), "/foo", AssignmentReason.SCOPE),
    "relative below the pushed namespace": (
        EnclaveRequest("bar", "/foo"),
        "/foo/bar",
        AssignmentReason.RELATIVE,
    ),
    "relative with nothing pushed": (EnclaveRequest("bar"), "/bar", AssignmentReason.RELATIVE),
    "relative of two parts": (EnclaveRequest("a/b", "/foo"), "/foo/a/b", AssignmentReason.RELATIVE),
    "absolute ignores what was pushed": (EnclaveRequest("/bar", "/foo"), "/bar", AssignmentReason.ABSOLUTE),
    "absolute root": (EnclaveRequest("/", "/foo"), "/", AssignmentReason.ABSOLUTE),
    "relative below the pushed root": (EnclaveRequest("bar", "/"), "/bar", AssignmentReason.RELATIVE),
    "the user's own --enclave wins": (
        EnclaveRequest("bar", "/foo", "/mine"),
        "/mine",
        AssignmentReason.ARGUMENT,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_attribute_and_scope(name: str) -> None:
    request, path, reason = CASES[name]
    assignment = assign_enclave(process(request), EnclaveScope.NAMESPACE)
    assert assignment is not None
    assert (assignment.path, assignment.reason) == (path, reason)


@pytest.mark.parametrize("scope", EnclaveScope)
def test_an_explicit_attribute_wins_in_every_scope(scope: EnclaveScope) -> None:
    assignment = assign_enclave(process(EnclaveRequest("bar", "/foo")), scope)
    assert assignment is not None and assignment.path == "/foo/bar"


DEFAULTS = {
    EnclaveScope.NAMESPACE: "/foo",
    EnclaveScope.NODE: "/foo/talker",
    EnclaveScope.PROCESS: "/foo/talker_1",
    EnclaveScope.LAUNCH: "/",
}


@pytest.mark.parametrize("scope", EnclaveScope)
def test_default_of_each_scope(scope: EnclaveScope) -> None:
    assignment = assign_enclave(process(EnclaveRequest(scope="/foo"), "/foo/talker"), scope)
    assert assignment is not None and assignment.path == DEFAULTS[scope]


def test_the_node_scope_takes_the_name_of_the_manifest_where_launch_knows_none() -> None:
    unnamed = process(EnclaveRequest(), "<node_namespace_unspecified>/<node_name_unspecified>")
    assignment = assign_enclave(unnamed, EnclaveScope.NODE, "chatty")
    assert assignment is not None and assignment.path == "/chatty"


def test_an_executable_gets_an_enclave_only_when_the_launch_file_gives_one() -> None:
    assert (
        assign_enclave(process(EnclaveRequest(scope="/foo"), kind="executable"), EnclaveScope.NAMESPACE)
        is None
    )
    given = assign_enclave(process(EnclaveRequest("bar", "/foo"), kind="executable"), EnclaveScope.NAMESPACE)
    assert given is not None and given.path == "/foo/bar"


@pytest.mark.parametrize("bad", ["..", "../up", "a//b", "a/", "", "a b", "a-b", "1a", "a\n", "é", "x" * 300])
def test_a_path_that_rcl_refuses_is_an_error_naming_the_element(bad: str) -> None:
    with pytest.raises(LaunchFileError, match=r"/w/a\.launch\.xml:3: <node> enclave "):
        assign_enclave(process(EnclaveRequest(bad, "/foo")), EnclaveScope.NAMESPACE)
