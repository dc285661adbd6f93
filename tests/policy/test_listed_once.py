"""The JSON of a plan lists an interface once, also where a manifest includes what every node has anyway."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from enclave_launch import ResolveOptions, resolve
from enclave_launch.report.plan_json import plan_document
from nodl.ament_index import INDEX_FOLDER

MANIFEST = """nodl_version: 2
include: [{ref: 'nodl://nodl_common_interfaces/node'}, {ref: 'nodl://nodl_common_interfaces/lifecycle_node'}]
service_clients: [{name: /a, type: p/srv/T}]
"""


def test_no_interface_of_a_node_is_listed_twice(tmp_path: Path) -> None:
    for kind, name, text in (("packages", "pk", ""), ("nodl", "pk__e", MANIFEST)):
        (tmp_path / INDEX_FOLDER / kind).mkdir(parents=True)
        (tmp_path / INDEX_FOLDER / kind / name).write_text(text)
    (tmp_path / "lib" / "pk").mkdir(parents=True)
    (tmp_path / "lib" / "pk" / "e").touch(0o755)
    file = tmp_path / "x.launch.xml"
    file.write_text('<launch><lifecycle_node pkg="pk" exec="e" name="n" namespace=""/></launch>')
    plan = resolve(file, options=ResolveOptions(distro="lyrical", prefixes=(tmp_path,)))
    (node,) = (each for each in plan_document(plan)["nodes"] if each["fqn"] == "/n")
    counts = Counter((use["operation"], use["name"]) for use in node["interfaces"])
    assert set(counts.values()) == {1}
    types = {use["name"]: use["type"] for use in node["interfaces"]}
    assert types["/n/change_state"] == "lifecycle_msgs/srv/ChangeState"
    assert types["/a"] == "p/srv/T"
    assert {"/n/get_type_description", "/rosout"} <= types.keys()
