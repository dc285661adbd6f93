"""NoDL v2 documents (ros-tooling/nodl, nodl_schema): schema, includes, identity, and what YAML can be abused for."""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodl import errors
from nodl.document import read_document
from nodl.document.v2 import parse_v2
from nodl.node_interface import ClientLibrary, ManifestNode

QOS = "{history: KEEP_LAST, depth: 10, reliability: RELIABLE}"


def parse(text: str, name: str = "talker") -> ManifestNode:
    return parse_v2(text.encode(), "talker.nodl.yaml", package="demo", name=name)


def endpoints(node: ManifestNode) -> list[str]:
    return [f"{e.kind.value} {e.name} {e.type} :{e.source.line}" for e in node.interface.endpoints]


FULL = f"""\
nodl_version: 2
description: talks
codegen:
  cpp: {{namespace: demo}}
parameters:
  rate:
    type: int
    default_value: 5
    read_only: true
    validation:
      bounds<>: [1, 10]
      one_of: [[1, 2]]
      "my::check": null
  label: {{type: string_fixed_25}}
publishers:
  - name: chatter
    type: std_msgs/String
    qos: {QOS}
subscriptions:
  - {{name: /clock, type: rosgraph_msgs/msg/Clock, qos: {{history: KEEP_ALL, reliability: BEST_EFFORT}}}}
service_servers:
  - {{name: ~/reset, type: std_srvs/srv/Trigger, description: starts again}}
service_clients:
  - {{name: plan, type: nav_msgs/GetPlan}}
action_servers:
  - {{name: fib, type: example_interfaces/Fibonacci}}
action_clients:
  - {{name: go, type: nav2_msgs/action/NavigateToPose}}
"""


def test_a_full_document() -> None:
    node = parse(FULL)
    assert endpoints(node) == [
        "publisher chatter std_msgs/msg/String :16",
        "subscription /clock rosgraph_msgs/msg/Clock :20",
        "service_server ~/reset std_srvs/srv/Trigger :22",
        "service_client plan nav_msgs/srv/GetPlan :24",
        "action_server fib example_interfaces/action/Fibonacci :26",
        "action_client go nav2_msgs/action/NavigateToPose :28",
    ]
    assert dict(node.parameter_types) == {"rate": "int", "label": "string_fixed_25"}
    assert node.interface.parameters == ("rate", "label")


def test_json_is_accepted_too() -> None:
    text = json.dumps({"nodl_version": 2, "service_clients": [{"name": "a", "type": "p/B"}]}, indent=2)
    assert endpoints(parse(text)) == ["service_client a p/srv/B :5"]


def test_the_registered_name_is_executable_and_node_name() -> None:
    interface = parse("nodl_version: 2").interface
    assert (interface.executable, interface.name, interface.plugin) == ("talker", "talker", None)
    plugin = parse("nodl_version: 2", name="demo::Talker").interface
    assert (plugin.executable, plugin.name, plugin.plugin) == (None, None, "demo::Talker")


def test_our_section_says_who_runs_the_node() -> None:
    node = parse(
        "nodl_version: 2\ncodegen:\n  enclave_launch: {executable: talker.py, node: mouth, namespace: /tester,"
        " library: rclpy, lifecycle: true}"
    )
    interface = node.interface
    assert (interface.executable, interface.name, interface.namespace) == ("talker.py", "mouth", "/tester")
    assert (interface.library, interface.lifecycle, node.explicit_executable) == (
        ClientLibrary.RCLPY,
        True,
        True,
    )


def doc(body: str) -> str:
    return f"nodl_version: 2\n{body}"


BROKEN = {
    "empty": ("", "empty", None),
    "no mapping": ("- a", "must be a mapping", 1),
    "no version": ("publishers: []", "needs the key 'nodl_version'", 1),
    "version 1": ("nodl_version: 1", "must be 2", 1),
    "version as text": ("nodl_version: '2'", "must be 2", 1),
    "unknown key": (doc("topics: []"), "no key 'topics'", 2),
    "duplicate key": (doc("description: a\ndescription: b"), "given twice, first on line 2", 3),
    "publisher without qos": (doc("publishers:\n- {name: a, type: p/T}"), "needs the key 'qos'", 3),
    "keep last without depth": (
        doc("publishers:\n- {name: a, type: p/T, qos: {history: KEEP_LAST, reliability: RELIABLE}}"),
        "needs the key 'depth'",
        3,
    ),
    "depth 0": (
        doc(f"publishers:\n- name: a\n  type: p/T\n  qos: {QOS.replace('10', '0')}"),
        "at least 1",
        5,
    ),
    "unknown qos key": (
        doc("publishers:\n- {name: a, type: p/T, qos: {history: KEEP_ALL, reliability: RELIABLE, x: 1}}"),
        "no key 'x'",
        3,
    ),
    "unknown history": (
        doc("publishers:\n- {name: a, type: p/T, qos: {history: ALL, reliability: RELIABLE}}"),
        "must be one of KEEP_LAST",
        3,
    ),
    "qos of an action": (doc("action_servers:\n- {name: a, type: p/T, qos: {}}"), "no key 'qos'", 3),
    "bad type": (doc("service_clients:\n- {name: a, type: String}"), "not an interface type", 3),
    "duplicate name": (
        doc("service_clients:\n- {name: a, type: p/T}\n- {name: a, type: p/T}"),
        "listed twice under service_clients, first at talker.nodl.yaml:3",
        4,
    ),
    "parameter without type": (doc("parameters:\n  a: {default_value: 1}"), "needs the key 'type'", 3),
    "unknown parameter type": (doc("parameters:\n  a: {type: integer}"), "not a parameter type", 3),
    "unknown validator": (doc("parameters:\n  a: {type: int, validation: {max: 1}}"), "no key 'max'", 3),
    "bounds of one number": (doc("parameters:\n  a: {type: int, validation: {bounds: [1]}}"), "exactly 2", 3),
    "bytes over 255": (
        doc("parameters:\n  a: {type: byte_array, default_value: [256]}"),
        "between 0 and 255",
        3,
    ),
    "read_only as text": (doc("parameters:\n  a: {type: int, read_only: 'yes'}"), "true or false", 3),
    "codegen of a scalar": (doc("codegen: {cpp: 1}"), "must be a mapping", 2),
    "unknown identity": (doc("codegen: {enclave_launch: {nodess: a}}"), "no key 'nodess'", 2),
    "bad node name": (doc("codegen: {enclave_launch: {node: a b}}"), "invalid node name", 2),
    "include without ref": (doc("include: [{file: a}]"), "needs the key 'ref'", 2),
    "include without scheme": (doc("include: [{ref: a/b}]"), "is not a reference", 2),
    "unknown scheme": (doc("include: [{ref: 'http://a/b'}]"), "only nodl://", 2),
    "not YAML": ("nodl_version: [2", "not well-formed YAML", None),
    "a tag that makes objects": (doc("description: !!python/object/apply:os.system [ls]"), "must be text", 2),
    "a scalar tag": (doc("description: !!binary aGk="), "tag", 2),
    "two documents": ("nodl_version: 2\n---\nnodl_version: 2", "not well-formed YAML", None),
    "a number as key": (doc("1: a"), "key must be text", 2),
    "a huge integer": ("nodl_version: " + "9" * 5000, "not a number we can read", 1),
    "control characters": ("nodl_version: 2\x00", "not", None),
}
for _label, _name in {
    **{
        "wildcard": "/*",
        "class": "[ab]",
        "tilde alone": "'~'",
        "tilde without slash": "~ab",
        "blank": "'a b'",
    },
    **{"empty part": "a//b", "trailing slash": "a/", "digit after slash": "a/1", "empty": "''"},
}.items():
    BROKEN[f"name with {_label}"] = (doc(f"service_clients:\n- {{name: {_name}, type: p/T}}"), "name", 3)


@pytest.mark.parametrize("label", BROKEN)
def test_broken_documents_are_told_with_their_line(label: str) -> None:
    text, reason, line = BROKEN[label]
    with pytest.raises(errors.InvalidNoDLError, match=re.escape(reason)) as caught:
        parse(text)
    place = "talker.nodl.yaml" if line is None else f"talker.nodl.yaml:{line}"
    assert re.match(rf"{re.escape(place)}(:\d+)?: .", str(caught.value))


def test_aliases_and_merge_keys_work_within_bounds() -> None:
    text = doc(
        "publishers:\n- name: a\n  type: p/T\n  qos: &q {history: KEEP_ALL, reliability: RELIABLE}\n"
        "- {name: b, type: p/T, qos: *q}\n- {name: c, type: p/T, qos: {<<: *q, reliability: BEST_EFFORT}}"
    )
    assert len(parse(text).interface.endpoints) == 3


def test_an_alias_bomb_is_stopped_early() -> None:
    """Unfolded, it would have nine to the twelfth elements."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
    with pytest.raises(errors.InvalidYAMLError, match="aliases stand for more than"):
        parse("\n".join(lines))


def test_an_alias_to_its_own_list_is_stopped() -> None:
    with pytest.raises(errors.InvalidYAMLError, match="a value contains itself: line 1"):
        parse("description: &a [*a]")


def test_too_large_and_too_deep_documents() -> None:
    with pytest.raises(errors.InvalidYAMLError, match="larger than"):
        parse("#" * 1_000_001)
    with pytest.raises(errors.InvalidYAMLError):
        parse("description: " + "[" * 3000 + "]" * 3000)


@settings(max_examples=80, deadline=None)
@given(st.text(max_size=60), st.sampled_from(["", "nodl_version: 2\n", "nodl_version: 2\npublishers:\n- "]))
def test_any_text_is_a_node_or_an_error_of_ours(text: str, start: str) -> None:
    with contextlib.suppress(errors.InvalidNoDLError):
        assert parse(start + text.encode("utf-8", "replace").decode())


# -- includes -------------------------------------------------------------------------------------------


def write(folder: Path, name: str, *references: str, client: str = "") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    include = f"include: [{', '.join(f'{{ref: {ref!r}}}' for ref in references)}]\n" if references else ""
    clients = f"service_clients: [{{name: {client}, type: p/T}}]\n" if client else ""
    path.write_text(f"nodl_version: 2\n{include}{clients}")
    return path


def register(prefix: Path, package: str, name: str, *references: str, client: str = "") -> Path:
    return write(
        prefix / "share/ament_index/resource_index/nodl", f"{package}__{name}", *references, client=client
    )


def read(path: Path, *prefixes: Path) -> list[str]:
    (node,) = read_document(path, prefixes=[str(prefix) for prefix in prefixes])
    return [endpoint.name.text for endpoint in node.interface.endpoints]


def test_includes_from_the_index_and_local_ones(tmp_path: Path) -> None:
    register(tmp_path, "common", "imu", "nodl://common/time", client="imu")
    register(tmp_path, "common", "time", client="time")
    write(tmp_path, "parts/more.yaml", client="more")
    main = write(tmp_path, "main.nodl.yaml", "nodl://common/imu", "local://parts/more.yaml", client="main")
    assert read(main, tmp_path) == ["main", "imu", "time", "more"]


def test_common_documents_resolve_without_ros(tmp_path: Path) -> None:
    main = write(tmp_path, "main.nodl.yaml", "nodl://rclcpp_lifecycle/lifecycle_node", client="main")
    assert {"main", "~/change_state", "~/transition_event"} <= set(read(main, tmp_path))
    assert len(read(main, tmp_path)) == 7


def test_an_installed_document_comes_before_the_common_one(tmp_path: Path) -> None:
    register(tmp_path, "rclcpp_lifecycle", "lifecycle_node", client="installed")
    main = write(tmp_path, "main.nodl.yaml", "nodl://rclcpp_lifecycle/lifecycle_node", client="main")
    assert read(main, tmp_path) == ["main", "installed"]


def test_every_endpoint_keeps_the_place_where_it_is_written(tmp_path: Path) -> None:
    write(tmp_path, "more.yaml", client="more")
    (node,) = read_document(write(tmp_path, "main.nodl.yaml", "local://more.yaml"))
    assert str(node.interface.endpoints[0].source) == f"{tmp_path}/more.yaml:2"
    assert node.included == (f"{tmp_path}/more.yaml",)


def test_a_local_include_may_climb_within_its_package(tmp_path: Path) -> None:
    write(tmp_path, "pkg/shared/base.yaml", client="base")
    (tmp_path / "pkg/package.xml").touch()
    main = write(tmp_path, "pkg/nodl/main.nodl.yaml", "local://../shared/base.yaml")
    assert read(main) == ["base"]


REFUSED = {
    "a parent folder": (["local://../outside.yaml"], "outside of"),
    "round about": (["local://sub/../../outside.yaml"], "outside of"),
    "a link that leaves": (["local://link.yaml"], "outside of"),
    "an absolute path": (["local:///etc/passwd"], "not a reference"),
    "a missing file": (["local://none.yaml"], "cannot read"),
    "a folder": (["local://sub"], "cannot read"),
    "itself": (["local://main.nodl.yaml"], "a second time"),
    "itself round about": (["local://sub/../main.nodl.yaml"], "a second time"),
    "itself through a link": (["local://self.yaml"], "a second time"),
    "a cycle of two": (
        ["local://ping.yaml"],
        "local://ping.yaml > local://sub/../pong.yaml > local://ping.yaml",
    ),
    "a diamond": (["local://left.yaml", "local://right.yaml"], "a second time"),
    "a diamond spelled differently": (["local://left.yaml", "local://sub/../top.yaml"], "a second time"),
    "an unknown resource": (["nodl://common/none"], "no document 'nodl://common/none'"),
    "a resource outside of the index": (["nodl://common/../../x"], "is not nodl://<package>/<name>"),
    "a hidden resource": (["nodl://common/.x"], "is not nodl://<package>/<name>"),
    "a resource with backslash": (["nodl://common/a\\b"], "is not nodl://<package>/<name>"),
    "a resource without name": (["nodl://common"], "is not nodl://<package>/<name>"),
    "a document that is broken": (["local://broken.yaml"], "broken.yaml:1: nodl_version must be 2"),
}


@pytest.mark.parametrize("label", REFUSED)
def test_includes_that_are_refused(label: str, tmp_path: Path) -> None:
    folder = tmp_path / "pkg"
    write(tmp_path, "outside.yaml")
    write(folder, "sub/x.yaml")
    write(folder, "ping.yaml", "local://sub/../pong.yaml")
    write(folder, "pong.yaml", "local://ping.yaml")
    write(folder, "top.yaml")
    write(folder, "left.yaml", "local://top.yaml")
    write(folder, "right.yaml", "local://top.yaml")
    (folder / "broken.yaml").write_text("nodl_version: 3")
    (folder / "link.yaml").symlink_to(tmp_path / "outside.yaml")
    (folder / "self.yaml").symlink_to(folder / "main.nodl.yaml")
    references, reason = REFUSED[label]
    main = write(folder, "main.nodl.yaml", *references)
    with pytest.raises(errors.InvalidNoDLError, match=re.escape(reason)):
        read_document(main, prefixes=[str(tmp_path)])


def test_names_that_collide_between_documents_are_an_error(tmp_path: Path) -> None:
    write(tmp_path, "more.yaml", client="a")
    main = write(tmp_path, "main.nodl.yaml", "local://more.yaml", client="a")
    with pytest.raises(
        errors.InvalidNoDLDocumentError, match=r"listed twice under service_clients, first at .*main"
    ):
        read_document(main)


def test_a_deep_chain_of_includes_is_stopped(tmp_path: Path) -> None:
    for depth in range(60):
        write(tmp_path, f"f{depth}.yaml", f"local://f{depth + 1}.yaml")
    with pytest.raises(errors.IncludeError, match="nested more than"):
        read_document(tmp_path / "f0.yaml")
