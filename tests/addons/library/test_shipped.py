"""The library that ships with us: every document is whole, findable, and refers only to what there is."""

from __future__ import annotations

import json
import os
import runpy
from pathlib import Path

import pytest

from enclave_addons.library import INDEX, SHIPPED, Library, fits, read_index
from enclave_addons.library.document import LibraryDocument, read_library_document
from nodl.dependence import Dependence
from nodl.node_interface import EndpointKind
from nodl.verb import main

FILES = sorted(str(path.relative_to(SHIPPED)) for path in Path(SHIPPED).glob("*/*.nodl.yaml"))
DOCUMENTS = {file: read_library_document(SHIPPED, file) for file in FILES}
LIBRARY = Library()
ROOT = Path(__file__).parents[3]
TOOL = runpy.run_path(str(ROOT / "tools" / "library"))
AGREEMENTS = json.loads(Path(SHIPPED, "agreement.json").read_text())


def of(document: LibraryDocument) -> Dependence:
    return document.interface.depends or Dependence()


def test_the_index_says_what_the_documents_say() -> None:
    assert Path(SHIPPED, INDEX).read_text() == TOOL["index"](), "run: tools/library index"


def test_there_are_at_least_a_hundred_pairs_of_package_and_program_or_plugin() -> None:
    pairs = {(e.package, name) for e in read_index(SHIPPED) for name in (*e.programs, *e.classes)}
    assert len(pairs) >= 100


def test_a_look_up_opens_one_document(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def read(folder: str, file: str) -> LibraryDocument:
        opened.append(file)
        return read_library_document(folder, file)

    monkeypatch.setattr("enclave_addons.library.document.read_library_document", read)
    assert Library().find("nav2_lifecycle_manager", "lifecycle_manager", distro="jazzy")
    assert len(opened) <= 1


def test_a_document_is_small_sorted_and_says_how_it_is_known() -> None:
    for file, document in DOCUMENTS.items():
        assert os.path.getsize(document.file) < 20_000, file
        evidence = document.evidence
        assert evidence.repository and evidence.version and len(evidence.commit) >= 7 and evidence.how, file
        endpoints = document.interface.endpoints
        for kind in EndpointKind:
            names = [endpoint.name.text for endpoint in endpoints if endpoint.kind is kind]
            assert names == sorted(names), file
        untyped = [endpoint for endpoint in endpoints if not endpoint.type]
        assert len(untyped) == Path(document.file).read_text().count("description: of any type"), file


def test_what_varies_is_listed() -> None:
    for file, document in DOCUMENTS.items():
        listed = {(endpoint.kind, endpoint.name.text) for endpoint in document.interface.endpoints}
        assert set(of(document).variations) <= listed, file


def test_default_plugins_and_further_nodes_have_documents() -> None:
    for file, document in DOCUMENTS.items():
        depends = of(document)
        for plugins in depends.plugins:
            for name in plugins.types.values():
                assert LIBRARY.of_class(name), (file, name)
        stems = [node.document for node in depends.nodes] + [c.document for c in depends.configurations]
        for stem in filter(None, stems):
            assert LIBRARY.named(stem), (file, stem)


def test_a_controller_publishes_its_transitions_and_serves_none() -> None:
    """controller_interface_base.cpp turns its services off; rcl_lifecycle.c makes the publisher all the same."""
    controllers = [document.interface for document in DOCUMENTS.values() if of(document).own_node]
    assert controllers
    for interface in controllers:
        names = {(endpoint.kind, endpoint.name.text) for endpoint in interface.endpoints}
        assert (EndpointKind.PUBLISHER, "~/transition_event") in names, interface.source
        assert (EndpointKind.SERVICE_SERVER, "~/change_state") not in names, interface.source


def test_a_condition_asks_for_a_parameter_with_a_known_default() -> None:
    """Else "not set" would silently mean "no"; a test that says what it means (``set``, ``not``) may stand alone."""
    for file, document in DOCUMENTS.items():
        depends = of(document)
        for variation in depends.variations.values():
            tests = [test for group in variation.when.any_of for test in group]
            asked = {test.parameter for test in tests if test.is_set}  # "not set" has an answer of its own
            for test in tests:
                alone = test.is_set or test.negated or test.parameter in ("words", *asked)
                by_item = "$(item)" in test.parameter or test.parameter.startswith(("argument ", "--"))
                assert alone or by_item or test.parameter in depends.defaults, (file, test.parameter)


@pytest.mark.parametrize(
    ("versions", "distro", "version", "holds"),
    [
        ({"jazzy": "1.3"}, "jazzy", "1.3.7", True),
        ({"jazzy": "1.3"}, "jazzy", "1.31.0", False),
        ({"jazzy": "1.3"}, "humble", "1.3.7", True),
        ({"jazzy": "1.3"}, "jazzy", None, True),
        ({"jazzy": "1.3"}, "humble", None, False),
        ({}, "humble", "9", True),
    ],
)
def test_a_series_covers_what_begins_with_it(
    versions: dict[str, str], distro: str, version: str | None, holds: bool
) -> None:
    assert fits(versions, distro, version) is holds


def test_the_verbs_find_show_and_miss(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["library", "show", "nav2_amcl", "amcl"]) == 0
    shown = capsys.readouterr().out
    assert "amcl_pose" in shown and "source read: github.com/ros-navigation/navigation2" in shown
    assert "nav2_amcl/amcl.nodl.yaml\n" in shown
    assert main(["library", "list", "nav2_amcl"]) == 0
    assert capsys.readouterr().out.startswith("nav2_amcl\tamcl nav2_amcl::AmclNode\t")
    assert main(["library", "show", "nav2_amcl", "unheard_of"]) == 1
    assert "no document of nav2_amcl/unheard_of" in capsys.readouterr().err


def test_sources_are_held_against_documents(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The real talker's document, once with a package that agrees and once with one that says something else."""
    source = tmp_path / "demo_nodes_py"
    source.mkdir()
    (source / "package.xml").write_text("<package><name>demo_nodes_py</name></package>")
    (source / "setup.py").write_text(
        "setup(entry_points={'console_scripts': ['talker = demo_nodes_py.talker:main']})"
    )
    (source / "demo_nodes_py").mkdir()
    program = (
        "from rclpy.node import Node\nfrom std_msgs.msg import String\n"
        "class Talker(Node):\n"
        "    def __init__(self):\n"
        "        super().__init__('talker')\n"
        "        self.create_publisher(String, {topic}, 10)\n"
        "def main():\n    Talker()\n"
    )
    (source / "demo_nodes_py/__init__.py").touch()
    (source / "demo_nodes_py/talker.py").write_text(program.format(topic="'chatter'"))
    assert main(["library", "check", str(tmp_path)]) == 0
    assert "demo_nodes_py/talker: agrees" in capsys.readouterr().out
    (source / "demo_nodes_py/talker.py").write_text(program.format(topic="'chat'"))
    assert main(["library", "check", str(tmp_path)]) == 1
    out = capsys.readouterr().out
    assert "only in the document: publisher chatter" in out and "only in the source: publisher chat" in out


def test_the_table_in_the_documentation_says_what_the_documents_say() -> None:
    written = ROOT / "docs" / "library-contents.md"
    assert written.read_text() == TOOL["table"](LIBRARY.documents(), AGREEMENTS), "run: tools/library table"


def test_kept_verdicts_are_of_documents_that_there_are_and_differences_have_a_reason() -> None:
    stems = {document.stem: document for document in DOCUMENTS.values()}
    for stem, (said, _) in AGREEMENTS.items():
        assert stem in stems and said != "differs", stem
        assert stems[stem].evidence.differs or said != "differs, explained", stem
