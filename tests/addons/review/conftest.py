"""Plans in a few words: enclaves with the nodes in them and what each asks for."""

from __future__ import annotations

from typing import Any

from enclave_addons.review.document import PlanDocument, plan_from_document
from enclave_launch import DryRun

EVERYWHERE = {"publish": ["/rosout"], "subscribe": ["/parameter_events"]}
LISTS = ("publish", "subscribe", "call_services", "serve_services", "call_actions", "serve_actions")

Asked = dict[str, list[str]]


def interface(operation: str, name: str, *, built_in: bool = False, type: str = "") -> dict[str, Any]:
    return {
        "operation": operation,
        "name": name,
        "type": type,
        "built_in": built_in,
        "place": "table" if built_in else "ws/n.nodl.xml:4",
        "written": name,
        "remapped_by": [],
        "note": "",
        "qos": {},
    }


def document(enclaves: dict[str, dict[str, Asked]]) -> dict[str, Any]:
    """``{enclave: {node: {operation: [names]}}}`` as the dry run's JSON; every node also has /rosout and
    /parameter_events. A name may be ``/name type``."""
    nodes, lists = [], {}
    for path, inside in enclaves.items():
        lists[path] = {name: set(EVERYWHERE.get(name, ())) for name in LISTS}
        for fqn, asked in inside.items():
            interfaces = [interface(op, n, built_in=True) for op, names in EVERYWHERE.items() for n in names]
            for operation, names in asked.items():
                for written in names:
                    name, _, type_ = written.partition(" ")
                    interfaces.append(interface(operation, name, type=type_))
                    lists[path][operation].add(name)
            nodes.append(
                {"fqn": fqn, "enclave": path, "program": "p/e", "parameters": None, "interfaces": interfaces}
            )
    named = {
        path: {
            "nodes": sorted(enclaves[path]),
            "permissions_unknown": [],
            **{name: sorted(names) for name, names in of.items()},
        }
        for path, of in lists.items()
    }
    return {
        "version": 1,
        "processes": [],
        "components": [],
        "enclaves": named,
        "nodes": nodes,
        "reactions": [],
        "launcher_calls": [],
        "warnings": [],
        "diagnostics": [],
    }


def process(**values: Any) -> dict[str, Any]:
    """A process of the dry run's JSON."""
    return {
        "package": "p",
        "executable": "e",
        "namespace": "/",
        "name": "n",
        "fqn": "/n",
        "cmd": ["e"],
        "remaps": [],
        "parameters": {},
        "enclave": None,
        "prefix": [],
        "domain_id": 0,
        "middleware": "rmw_cyclonedds_cpp",
        "environment": {},
        "launch_file": "f.launch.xml",
        "line": 3,
        "on_event": None,
        "interfaces": None,
        "process": "e-1",
        "kind": "node",
        "machine": None,
        "cwd": None,
        "shell": False,
        "respawn": None,
        "parameter_files": {},
        **values,
    }


def plan(enclaves: dict[str, dict[str, Asked]]) -> PlanDocument:
    return plan_from_document(DryRun(**document(enclaves)))


ROBOT: dict[str, dict[str, Asked]] = {
    "/camera": {"/camera/driver": {"publish": ["/image"]}},
    "/planner": {"/planner": {"subscribe": ["/image"], "publish": ["/plan"], "call_actions": ["/drive"]}},
    "/base": {"/base": {"serve_actions": ["/drive"], "publish": ["/odom"]}},
    "/logger": {"/logger": {"subscribe": ["/image", "/odom"]}},
}
