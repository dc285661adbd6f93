"""The report in all its forms: what stands in it, and that no name leaves the place that it was given."""

from __future__ import annotations

import base64
import hashlib
import html.parser
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_addons.review.contents import counts
from enclave_addons.review.diagrams import dot, mermaid
from enclave_addons.review.document import plan_from_document
from enclave_addons.review.graph import plan_graph
from enclave_addons.review.html.page import ASSETS, html_report
from enclave_addons.review.markdown import code, escaped, markdown_report
from enclave_addons.review.verb import main as secure_plan
from tests.addons.review.conftest import plan
from tests.addons.review.report.conftest import HOSTILE, contents, hostile, robot

DEMO = ("--prefix", str(Path(__file__).parents[4] / "fixtures" / "demo_ws"), "demo_nodes")


class Reader(html.parser.HTMLParser):
    """The elements of a page with their attributes, and the text of each script."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.inline: dict[str, list[str]] = {"script": [], "style": []}
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = tag
        if tag in self.inline:
            self.inline[tag].append("")

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside in self.inline:
            self.inline[self._inside][-1] += data


def test_dot_draws_enclaves_as_clusters_and_arrows_along_the_data() -> None:
    text = dot(plan_graph(robot()))
    assert 'label="enclave /camera"' in text and 'label="without an enclave"' in text
    node = re.search(r'(n\d+) \[shape=component, style=solid, label="/camera/driver"\]', text)
    image = re.search(r'(c\d+) \[shape=ellipse, label="/image"\]', text)
    planner = re.search(r'(n\d+) \[shape=component, style=solid, label="/planner"\]', text)
    assert node and image and planner
    assert f"  {node[1]} -> {image[1]};\n" in text and f"  {image[1]} -> {planner[1]};\n" in text
    assert "/rosout" not in text


def test_mermaid_draws_the_same() -> None:
    text = mermaid(plan_graph(robot()))
    assert text.startswith("flowchart LR\n")
    assert 'subgraph g1 ["enclave /base"]' in text
    assert '[["/camera/driver"]]' in text and '(["/image"])' in text and '{{"/drive"}}' in text


_DOT_LINE = re.compile(
    r"digraph launch \{|  rankdir.*;|  subgraph cluster_\d+ \{ label=\"\";|    n\d+ \[shape=component, style=\w+, "
    r"label=\"\"\];|    e\d+ .*;|  c\d+ \[shape=\w+, label=\"\"\];|  [nce]\d+ -> [nce]\d+;|  \}|\}"
)
_MERMAID_LINE = re.compile(
    r"flowchart LR|  subgraph g\d+ \[\"\"\]|    n\d+\[\[\"\"\]\]|  end|"
    r"  c\d+(\(\[\"\"\]\)|\[\"\"\]|\{\{\"\"\}\})|  [nce]\d+ --> [nce]\d+"
)


@pytest.mark.parametrize(
    ("draw", "quoted", "line"),
    [(dot, r'"(?:[^"\\]|\\.)*"', _DOT_LINE), (mermaid, r'"[^"<>`]*"', _MERMAID_LINE)],
    ids=["dot", "mermaid"],
)
def test_no_name_leaves_its_quotes(draw: Callable[..., str], quoted: str, line: re.Pattern[str]) -> None:
    for each in draw(plan_graph(hostile())).splitlines():
        assert line.fullmatch(re.sub(quoted, '""', each)), each


def test_markdown_has_a_section_for_each_question() -> None:
    text = markdown_report(contents(robot()))
    headings = [line for line in text.splitlines() if line.startswith("## ")]
    assert headings == ["## Findings", "## Permissions", "## Flows", "## Statistics"]
    assert "| publish | `/image` | `/camera/driver` | ws/n.nodl.xml:4; written /image |" in text
    assert "| publish | `/of_policy` | a policy file |  |" in text
    assert "2 more that every node has." in text


@pytest.mark.parametrize("name", HOSTILE)
def test_no_name_leaves_its_place_in_markdown(name: str) -> None:
    assert not re.search(r"(?<!\\)[<>\[\]|`*_]", escaped(name).replace("\\\\", ""))
    span = code(name)
    fence = re.match("`+", span)
    assert (
        fence
        and span.endswith(fence[0])
        and fence[0] not in re.findall("`+", span[len(fence[0]) : -len(fence[0])])
    )
    assert not re.search(r"(?<!\\)\|", span)
    assert escaped(name).isprintable() and span.isprintable()


def test_no_row_of_markdown_has_more_cells_than_its_heading() -> None:
    width = 0
    for line in markdown_report(contents(hostile())).splitlines():
        cells = len(re.findall(r"(?<!\\)\|", line))
        if re.fullmatch(r"\|(---\|)+", line):
            width = cells
        elif line.startswith("| ") and width:
            assert cells == width, line
        else:
            width = 0


def test_the_page_allows_its_own_scripts_and_style_by_hash_and_nothing_else() -> None:
    reader = Reader(html_report(contents(robot())))
    policy = next(
        each for tag, each in reader.elements if each.get("http-equiv") == "Content-Security-Policy"
    )
    code_texts = [text for text in reader.inline["script"] if not text.startswith("{")]
    hashes = [
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
        for text in (*code_texts, *reader.inline["style"])
    ]
    assert policy["content"] == (
        f"default-src 'none'; script-src {' '.join(hashes[:3])}; style-src {hashes[3]}; "
        "base-uri 'none'; form-action 'none'"
    )
    named = {name for _, each in reader.elements for name in each}
    assert named.isdisjoint({"src", "srcset", "onclick", "onload", "onerror", "style", "action"})
    assert all(str(each["href"]).startswith("#") for _, each in reader.elements if "href" in each)


def test_hostile_names_add_no_element_to_the_page() -> None:
    calm = {tag for tag, _ in Reader(html_report(contents(robot()))).elements}
    wild = [tag for tag, _ in Reader(html_report(contents(hostile(), HOSTILE[0]))).elements]
    assert set(wild) <= calm
    assert wild.count("script") == 4 and "img" not in wild and "svg" not in wild


def test_the_same_plan_gives_the_same_bytes() -> None:
    assert html_report(contents(robot())) == html_report(contents(robot()))
    assert markdown_report(contents(robot())) == markdown_report(contents(robot()))


def test_the_vendored_libraries_are_those_that_are_written_down() -> None:
    noted = (ASSETS / "README.md").read_text()
    for name in ("cytoscape.min.js", "cytoscape-dagre.min.js"):
        assert hashlib.sha256((ASSETS / name).read_bytes()).hexdigest() in noted, name
        assert "Permission is hereby granted" in (ASSETS / name.replace(".min.js", ".LICENSE")).read_text()


def test_statistics_are_the_columns_of_table_2() -> None:
    robot_counts = {one.column: (one.all, one.system) for one in counts(plan_from_document(robot()))}
    assert robot_counts == {
        "N": (4, 0), "T": (6, 2), "S": (0, 0), "A": (1, 0), "PUB": (7, 4), "SUB": (8, 4),
        "SS": (0, 0), "SC": (0, 0), "AS": (1, 0), "AC": (1, 0),
    }  # fmt: skip
    shared = plan(
        {
            "/a": {
                "/one": {"publish": ["/rosout"], "serve_services": ["/s"]},
                "/two": {"serve_services": ["/s"]},
            }
        }
    )
    found = {one.column: (one.all, one.system) for one in counts(shared)}
    assert found["S"] == (1, 0) and found["SS"] == (2, 0)
    assert found["PUB"] == (2, 1), "what a node asks for itself is its own"


def test_the_command_writes_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "report.html"
    launch = (*DEMO, "services_actions.launch.xml")
    assert secure_plan(["report", *launch, "-o", str(file)]) == 0
    assert "/robot1/arm/count_up" in file.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("form", "start"), [("markdown", "# "), ("dot", "digraph"), ("mermaid", "flowchart")]
)
def test_the_other_forms_are_printed_too(capsys: pytest.CaptureFixture[str], form: str, start: str) -> None:
    assert secure_plan(["report", *DEMO, "talker_listener.launch.xml", "--format", form]) == 0
    assert capsys.readouterr().out.startswith(start)


def test_paths_below_the_working_directory_are_short(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.launch.xml").write_text('<launch><node pkg="demo_nodes" exec="talker"/></launch>')
    assert secure_plan(["report", *DEMO[:2], "one.launch.xml", "--format", "markdown"]) == 0
    assert str(tmp_path) not in capsys.readouterr().out


def test_what_cannot_be_written_or_read_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    launch = (*DEMO, "talker_listener.launch.xml")
    assert secure_plan(["report", *launch, "-o", str(tmp_path / "absent" / "r.html")]) == 2
    assert "r.html: No such file or directory" in capsys.readouterr().err
    assert secure_plan(["report", *launch, "--keystore", str(tmp_path / "ks")]) != 0
    assert "there is no keystore at" in capsys.readouterr().err


def test_expiry_of_a_keystore(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from keystore.verb import main as secure_keystore

    assert secure_keystore(["create", str(tmp_path / "ks")]) == 0
    capsys.readouterr()
    launch = (*DEMO, "talker_listener.launch.xml")
    assert secure_plan(["report", *launch, "--format", "markdown", "--keystore", str(tmp_path / "ks")]) == 0
    assert "| identity CA |" in capsys.readouterr().out
