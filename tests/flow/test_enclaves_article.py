"""The four examples of the design article "ROS 2 Security Enclaves", keystore trees included."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from enclave_launch import ResolveOptions, provision, resolve

DEMO = Path(__file__).parents[2] / "fixtures" / "demo_ws"
LAUNCH = DEMO / "share" / "demo_nodes" / "launch"

# What every enclave of the article's trees holds.
ARTIFACTS = {
    "cert.pem",
    "governance.p7s",
    "identity_ca.cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "permissions.p7s",
}

EXAMPLES = {
    "Unqualified enclave path": ("enclave_unqualified", {"": ["/listener", "/talker"]}),
    "Pushed unqualified enclave path": (
        "enclave_pushed_unqualified",
        {"": ["/talker"], "foo": ["/foo/listener"]},
    ),
    "Relatively pushed qualified enclave path": ("enclave_pushed_qualified", {"foo/bar": ["/foo/listener"]}),
    "Fully qualified enclave path": ("enclave_fully_qualified", {"bar": ["/foo/listener"]}),
}


def enclave_tree(keystore: Path) -> dict[str, set[str]]:
    """Directory below ``enclaves/`` → the article's files in it; directories that only hold others are left out."""
    root = keystore / "enclaves"
    tree = {
        os.path.relpath(folder, root).removeprefix("."): set(files) & ARTIFACTS
        for folder, _, files in os.walk(root)
        if "cert.pem" in files or "key.pem" in files
    }
    return tree


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_keystore_has_exactly_the_tree_of_the_article(example: str, tmp_path: Path) -> None:
    name, enclaves = EXAMPLES[example]
    plan = resolve(LAUNCH / f"{name}.launch.xml", options=ResolveOptions(prefixes=(DEMO,)))
    provision(plan, tmp_path / "keystore")
    assert enclave_tree(tmp_path / "keystore") == dict.fromkeys(enclaves, ARTIFACTS)


@pytest.mark.parametrize("example", EXAMPLES)
def test_each_enclave_holds_the_nodes_of_the_article(example: str) -> None:
    name, enclaves = EXAMPLES[example]
    plan = resolve(LAUNCH / f"{name}.launch.xml", options=ResolveOptions(prefixes=(DEMO,)))
    nodes = {
        path.removeprefix("/"): sorted(node.fqn for node in nodes)
        for path, nodes in plan.derived.nodes.items()
    }
    assert nodes == enclaves


def test_certificates_are_links_to_the_public_part_as_in_the_first_example(tmp_path: Path) -> None:
    plan = resolve(LAUNCH / "enclave_unqualified.launch.xml", options=ResolveOptions(prefixes=(DEMO,)))
    provision(plan, tmp_path / "keystore")
    enclaves = tmp_path / "keystore" / "enclaves"
    assert os.readlink(enclaves / "identity_ca.cert.pem") == "../public/identity_ca.cert.pem"
    assert os.readlink(enclaves / "permissions_ca.cert.pem") == "../public/permissions_ca.cert.pem"
