"""Which NoDL describes an executable or component: the package's documents, ``--nodl`` files, conflicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from nodl import errors
from nodl.lookup import Lookup, ManifestLookup
from tests.programs import install_package


class Prefix:
    """An ament install prefix that is filled by the test."""

    def __init__(self, root: Path):
        self.root = root

    def package(self, name: str) -> Path:
        return install_package(self.root, name)

    def v1(self, package: str, file: str, *nodes: tuple[str, str, str]) -> Path:
        """``nodes``: (executable, node name, topic)."""
        path = self.package(package) / file
        path.write_text(v1_text(*nodes))
        return path

    def v2(self, package: str, name: str, topic: str, identity: str = "") -> Path:
        self.package(package)
        folder = self.root / "share/ament_index/resource_index/nodl"
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{package}__{name}"
        path.write_text(v2_text(topic, identity))
        return path


def v1_text(*nodes: tuple[str, str, str]) -> str:
    body = "".join(
        f'<node name="{name}" executable="{executable}"><service name="{topic}" type="p/srv/T" role="client"/></node>\n'
        for executable, name, topic in nodes
    )
    return f'<interface version="1">\n{body}</interface>'


def v2_text(topic: str, identity: str = "") -> str:
    codegen = f"codegen: {{enclave_launch: {{{identity}}}}}\n" if identity else ""
    return f"nodl_version: 2\n{codegen}service_clients: [{{name: {topic}, type: p/T}}]\n"


@pytest.fixture
def prefix(tmp_path: Path) -> Prefix:
    return Prefix(tmp_path / "install")


def find(
    prefix: Prefix, package: str, executable: str = "", plugin: str = "", manifests: Sequence[Path] = ()
) -> Lookup:
    lookup = ManifestLookup([str(prefix.root)], manifests)
    return lookup.find(package, executable=executable or None, plugin=plugin or None)


def topics(found: Lookup) -> list[str]:
    return [endpoint.name.text for node in found.found for endpoint in node.endpoints]


def test_any_v1_file_of_the_share_directory_counts(prefix: Prefix) -> None:
    prefix.v1("demo", "a.nodl.xml", ("talker", "t", "a"))
    prefix.v1("demo", "b.nodl.xml", ("listener", "l", "b"))
    prefix.v1("other", "c.nodl.xml", ("talker", "t", "c"))
    assert topics(find(prefix, "demo", "listener")) == ["b"]
    assert topics(find(prefix, "demo", "talker")) == ["a"]


def test_files_in_folders_below_do_not_count(prefix: Prefix) -> None:
    share = prefix.package("demo")
    (share / "nodl").mkdir()
    (share / "nodl/a.nodl.xml").write_text(v1_text(("talker", "t", "a")))
    assert not find(prefix, "demo", "talker")


def test_v2_resources_of_the_ament_index(prefix: Prefix) -> None:
    prefix.v2("demo", "talker", "a")
    prefix.v2("demo_more", "talker", "b")
    (node,) = find(prefix, "demo", "talker").found
    assert (node.package, node.executable, node.name) == ("demo", "talker", "talker")
    assert topics(find(prefix, "demo_more", "talker")) == ["b"]


def test_v2_documents_that_name_their_executable(prefix: Prefix) -> None:
    prefix.v2("demo", "left", "a", "executable: both, node: left")
    prefix.v2("demo", "right", "b", "executable: both, node: right")
    assert topics(find(prefix, "demo", "both")) == ["a", "b"]
    assert not find(prefix, "demo", "left")


def test_components_by_plugin(prefix: Prefix) -> None:
    prefix.v1("one", "a.nodl.xml", ("one::Talker", "talker", "v1"))
    prefix.v2("two", "two::Talker", "key")
    prefix.v2("three", "Talker", "class")
    prefix.v2("four", "anything", "section", "plugin: 'four::deep::Talker'")
    assert topics(find(prefix, "one", plugin="one::Talker")) == ["v1"]
    assert topics(find(prefix, "two", plugin="two::Talker")) == ["key"]
    assert topics(find(prefix, "three", plugin="three::Talker")) == ["class"]
    assert topics(find(prefix, "four", plugin="four::deep::Talker")) == ["section"]
    assert not find(prefix, "four", plugin="four::Talker")
    assert not find(prefix, "one", "one::Talker")


def test_nothing_found_says_where_it_looked(prefix: Prefix) -> None:
    prefix.v1("demo", "a.nodl.xml", ("talker", "t", "a"))
    missing = find(prefix, "demo", "nobody")
    assert not missing
    assert missing.searched == (
        f"{prefix.root}/share/demo/*.nodl.xml",
        f"{prefix.root}/share/ament_index/resource_index/nodl/demo__*",
    )
    assert f"package 'none' in {prefix.root}" in find(prefix, "none", "x").searched
    nowhere = ManifestLookup([]).find("none", executable="x")
    assert nowhere.searched == ("package 'none' in no prefix at all",)
    isolated = ManifestLookup([f"/ws/install/p{number}" for number in range(150)]).find(
        "none", executable="x"
    )
    assert isolated.searched[0] == (
        "package 'none' in /ws/install/p0, /ws/install/p1, /ws/install/p2 and 147 more"
    )
    assert not find(prefix, "../etc", "x")


def test_one_file_may_describe_several_nodes_of_an_executable(prefix: Prefix) -> None:
    prefix.v1("demo", "a.nodl.xml", ("pair", "left", "a"), ("pair", "right", "b"))
    assert topics(find(prefix, "demo", "pair")) == ["a", "b"]


CONFLICTS = {
    "two files": lambda p: [
        p.v1("demo", "a.nodl.xml", ("talker", "t", "a")),
        p.v1("demo", "b.nodl.xml", ("talker", "t", "b")),
    ],
    "two files with different node names": lambda p: [
        p.v1("demo", "a.nodl.xml", ("talker", "t", "a")),
        p.v1("demo", "b.nodl.xml", ("talker", "u", "a")),
    ],
    "v1 and v2": lambda p: [
        p.v1("demo", "a.nodl.xml", ("talker", "talker", "a")),
        p.v2("demo", "talker", "b"),
    ],
    "one node twice in one file": lambda p: [
        p.v1("demo", "a.nodl.xml", ("talker", "t", "a"), ("talker", "t", "b")),
    ],
    "one node twice by section": lambda p: [
        p.v2("demo", "x", "a", "executable: talker, node: n"),
        p.v2("demo", "y", "b", "executable: talker, node: n"),
    ],
}


@pytest.mark.parametrize("label", CONFLICTS)
def test_definitions_that_disagree_are_an_error_that_lists_the_files(prefix: Prefix, label: str) -> None:
    files = CONFLICTS[label](prefix)
    with pytest.raises(
        errors.ConflictingNoDLError, match="conflicting NoDL definitions of demo/talker"
    ) as caught:
        find(prefix, "demo", "talker")
    assert all(f"\n  {file}:" in str(caught.value) for file in files)
    assert "--nodl" in str(caught.value)


def test_equal_definitions_in_several_files_are_one(prefix: Prefix) -> None:
    prefix.v1("demo", "a.nodl.xml", ("talker", "talker", "a"))
    prefix.v1("demo", "b.nodl.xml", ("talker", "/talker", "a"))
    prefix.v2("demo", "talker", "a")
    assert len(find(prefix, "demo", "talker").found) == 1


def test_a_manifest_that_the_user_names_wins(prefix: Prefix) -> None:
    chosen = prefix.v1("demo", "a.nodl.xml", ("talker", "t", "a"))
    prefix.v1("demo", "b.nodl.xml", ("talker", "t", "b"))
    assert topics(find(prefix, "demo", "talker", manifests=[chosen])) == ["a"]


def test_a_manifest_of_another_package_is_not_taken(prefix: Prefix) -> None:
    other = prefix.v1("other", "a.nodl.xml", ("talker", "t", "other"))
    index = prefix.v2("other", "talker", "other")
    prefix.v1("demo", "b.nodl.xml", ("talker", "t", "own"))
    assert topics(find(prefix, "demo", "talker", manifests=[other, index])) == ["own"]


def test_a_manifest_outside_of_any_package_stands_for_all(prefix: Prefix, tmp_path: Path) -> None:
    file = tmp_path / "talker.nodl.yaml"
    file.write_text(v2_text("mine"))
    prefix.v1("demo", "b.nodl.xml", ("talker", "t", "own"))
    assert topics(find(prefix, "demo", "talker", manifests=[file])) == ["mine"]
    assert topics(find(prefix, "unknown", "talker", manifests=[file])) == ["mine"]
    assert str(file) in find(prefix, "demo", "nobody", manifests=[file]).searched


def test_manifests_that_the_user_names_must_agree_too(prefix: Prefix, tmp_path: Path) -> None:
    files = [tmp_path / "a.nodl.xml", tmp_path / "b.nodl.xml"]
    for file in files:
        file.write_text(v1_text(("talker", "t", file.name[0])))
    with pytest.raises(errors.ConflictingNoDLError):
        find(prefix, "demo", "talker", manifests=files)


def test_a_missing_manifest_is_an_error(prefix: Prefix, tmp_path: Path) -> None:
    with pytest.raises(errors.InvalidNoDLError, match="cannot be read: No such file"):
        find(prefix, "demo", "talker", manifests=[tmp_path / "none.xml"])


def test_a_broken_document_of_the_package_is_never_passed_over(prefix: Prefix) -> None:
    prefix.v1("demo", "a.nodl.xml", ("talker", "t", "a"))
    (prefix.package("demo") / "b.nodl.xml").write_text("<interface>")
    with pytest.raises(errors.InvalidXMLError, match=r"b\.nodl\.xml:1"):
        find(prefix, "demo", "talker")


def test_each_document_is_read_once_for_many_questions(prefix: Prefix) -> None:
    path = prefix.v1("demo", "a.nodl.xml", ("talker", "t", "a"), ("listener", "l", "b"))
    lookup = ManifestLookup([str(prefix.root)])
    assert topics(lookup.find("demo", executable="talker")) == ["a"]
    path.unlink()
    assert topics(lookup.find("demo", executable="listener")) == ["b"]


def test_the_overlay_wins(prefix: Prefix, tmp_path: Path) -> None:
    overlay = Prefix(tmp_path / "overlay")
    prefix.v1("demo", "a.nodl.xml", ("talker", "t", "under"))
    prefix.v2("demo", "other", "under")
    overlay.v1("demo", "a.nodl.xml", ("talker", "t", "over"))
    overlay.v2("demo", "other", "over")
    prefixes = [str(overlay.root), str(prefix.root)]
    for executable in ("talker", "other"):
        assert topics(ManifestLookup(prefixes).find("demo", executable=executable)) == ["over"]


def test_a_document_that_does_not_resolve_refuses_its_own_program_alone(prefix: Prefix) -> None:
    prefix.v2("pk", "good", "/a")
    prefix.v2("pk", "bad", "/b").write_text("nodl_version: 2\ninclude: [{ref: 'nodl://nowhere/at_all'}]\n")
    assert find(prefix, "pk", "good").found
    assert not find(prefix, "pk", "other").found
    with pytest.raises(errors.IncludeError, match="nowhere/at_all"):
        find(prefix, "pk", "bad")
    with pytest.raises(errors.IncludeError, match="nowhere/at_all"):
        ManifestLookup([str(prefix.root)]).all_of("pk")


def test_a_document_under_a_name_that_is_no_program_is_named(prefix: Prefix) -> None:
    prefix.v2("pk", "laser", "/a")
    prefix.v2("pk", "camera", "/a")
    program = prefix.root / "lib" / "pk" / "camera"
    program.parent.mkdir(parents=True, exist_ok=True)
    program.touch(0o755)
    assert find(prefix, "pk", "laser_nodl").registered == ("laser",)
    assert find(prefix, "pk", "camera").registered == ()


@pytest.mark.parametrize(
    ("document", "name"),
    [
        ("nodl_common_interfaces/node", "/rosout"),
        ("nodl_common_interfaces/lifecycle_node", "~/change_state"),
        ("rclcpp/node", "/parameter_events"),
        ("rclpy/node", "~/set_parameters"),
        ("rclpy/lifecycle_node", "~/transition_event"),
        ("rclcpp_lifecycle/lifecycle_node", "~/get_state"),
    ],
)
def test_documents_that_ros_brings_are_known_without_it(prefix: Prefix, document: str, name: str) -> None:
    prefix.v2("pk", "e", "/a").write_text(f"nodl_version: 2\ninclude: [{{ref: 'nodl://{document}'}}]\n")
    (interface,) = find(prefix, "pk", "e").found
    assert name in [str(endpoint.name) for endpoint in interface.endpoints]
