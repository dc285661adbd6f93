"""The HTML report as a person meets it: in a real browser, with mouse and keyboard, without network."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.review.html.page import html_report
from enclave_launch import DryRun
from tests.addons.review.report.browser import Page, browser, chromium
from tests.addons.review.report.conftest import HOSTILE, contents, hostile, large, robot

GRAPH = "document.getElementById('canvas')._cyreg.cy"


def opened(page: Page, folder: Path, plan: DryRun, title: str = "robot.launch.xml") -> Page:
    file = folder / "report.html"
    file.write_text(html_report(contents(plan, title)), encoding="utf-8")
    page.told.clear()
    page.requests.clear()
    page.open(file)
    return page


def type_into(page: Page, field: str, text: str) -> None:
    page.run(f"document.getElementById('{field}').focus()")
    page.run(f"document.getElementById('{field}').select()")
    page.call("Input.insertText", text=text)
    settled(page)


def click(page: Page, selector: str) -> None:
    """With the mouse, in the middle of the element."""
    settled(page)
    x, y = page.run(
        f"(() => {{ const e = document.querySelector({selector!r}); e.scrollIntoView({{block: 'center'}}); "
        "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()"
    )
    page.click(x, y)
    settled(page)


def settled(page: Page) -> None:
    """Wait until what was asked for is laid out and shown: on a busy machine a frame comes late."""
    page.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")


def listed(page: Page) -> list[str]:
    return list(page.run("[...document.querySelectorAll('#matches button')].map(b => b.textContent)"))


def detail(page: Page) -> str:
    return str(page.run("document.getElementById('detail').innerText"))


def drawn(page: Page, selector: str = "node:visible:childless") -> set[str]:
    return set(page.run(f"{GRAPH}.nodes('{selector}').map(n => n.data('label'))"))


def test_it_opens_without_a_word_on_the_console_and_asks_for_nothing_but_itself(
    page: Page, tmp_path: Path
) -> None:
    opened(page, tmp_path, robot())
    assert page.told == []
    assert page.requests == [(tmp_path / "report.html").as_uri()]


def test_the_graph_has_nodes_in_their_enclaves_and_the_names_they_share(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    assert drawn(page) == {
        "/camera/driver", "/camera/helper", "/planner", "/base", "/logger", "/tool",
        "/image", "/plan", "/drive", "/odom", "/map/*", "/of_policy",
    }  # fmt: skip
    homes = f"{GRAPH}.nodes('.node').map(n => [n.data('label'), n.parent().data('label')])"
    assert ["/camera/driver", "/camera"] in page.run(homes)
    assert ["/tool", "without an enclave"] in page.run(homes)
    dashed = f"{GRAPH}.nodes('.doubtful').map(n => n.data('label')).sort()"
    assert page.run(dashed) == ["/camera/helper", "/map/*", "/tool"]
    arrows = f"{GRAPH}.edges().map(e => e.source().data('label') + ' ' + e.target().data('label'))"
    assert {"/camera/driver /image", "/image /planner", "/planner /drive", "/drive /base"} <= set(
        page.run(arrows)
    )
    assert "/logger /of_policy" in page.run(arrows), "what only a policy file says begins at the enclave"


def test_what_every_node_has_is_hidden_until_asked_for(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    assert "/rosout" not in drawn(page)
    click(page, "#hide-built-in")
    assert {"/rosout", "/parameter_events"} <= drawn(page)


@pytest.mark.parametrize(("kind", "name"), [("topic", "/image"), ("action", "/drive")])
def test_a_kind_of_name_can_be_left_out(page: Page, tmp_path: Path, kind: str, name: str) -> None:
    opened(page, tmp_path, robot())
    assert name in drawn(page)
    click(page, f"#show-{kind}")
    assert name not in drawn(page) and "/planner" in drawn(page)


@pytest.mark.parametrize(
    ("grouping", "home"),
    [("namespace", "/camera"), ("both", "namespace /camera"), ("none", None), ("enclave", "/camera")],
)
def test_nodes_are_grouped_as_one_likes(page: Page, tmp_path: Path, grouping: str, home: str | None) -> None:
    opened(page, tmp_path, robot())
    page.run(
        f"(() => {{ const s = document.getElementById('group'); s.value = '{grouping}'; "
        "s.dispatchEvent(new Event('change')); })()"
    )
    parent = (
        f"{GRAPH}.nodes('.node').filter(n => n.data('label') === '/camera/driver').parent().data('label')"
    )
    assert page.run(parent) == home
    depth = f"{GRAPH}.nodes('.node').filter(n => n.data('label') === '/camera/driver').parents().length"
    assert page.run(depth) == {"both": 2, "none": 0}.get(grouping, 1)


def test_search_marks_what_matches_and_fades_what_is_far_from_it(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    type_into(page, "search", "ODOM")
    assert listed(page) == ["/odom (topic)"]
    assert "1 of" in page.run("document.getElementById('status').textContent")
    assert drawn(page, ".match") == {"/odom"}
    assert {"/camera/driver", "/drive"} <= drawn(page, ".faded")
    assert drawn(page, ".faded").isdisjoint({"/odom", "/base", "/logger"})
    click(page, "#only-near")
    assert drawn(page) == {"/odom", "/base", "/logger"}
    type_into(page, "search", "nobody has this name")
    assert listed(page) == []


def test_a_click_in_the_list_tells_the_reasons_with_file_and_line(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    type_into(page, "search", "/camera/driver")
    click(page, "#matches button")
    told = detail(page)
    assert "enclave /camera" in told and "launched at bringup.launch.xml:3" in told
    assert "/camera/driver publish /image\nws/n.nodl.xml:4; written /image" in told
    assert "and 2 that every node has" in told


def test_a_click_in_the_graph_tells_the_same(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    position = (
        f"(() => {{ const n = {GRAPH}.nodes('.node').filter(n => n.data('label') === '/planner'); "
        "document.getElementById('canvas').scrollIntoView({block: 'center'}); "
        "const r = document.getElementById('canvas').getBoundingClientRect(); const p = n.renderedPosition(); "
        "return [r.x + p.x, r.y + p.y]; })()"
    )
    page.click(*page.run(position))
    page.wait("document.querySelector('#detail h3')")
    told = detail(page)
    assert told.startswith("node /planner")
    assert "remapped by plan:=path at bringup.launch.xml:9" in told
    assert "/planner subscribe /map/*" in told and "--accept-patterns" in told


def test_everything_is_reached_by_keyboard(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    page.press("/")
    assert page.run("document.activeElement.id") == "search"
    page.call("Input.insertText", text="/image")
    page.press("Enter")
    assert detail(page).startswith("topic /image")
    type_into(page, "search", "a")
    page.run("document.querySelector('#matches button').focus()")
    page.press("ArrowDown")
    second = listed(page)[1]
    assert page.run("document.activeElement.textContent") == second
    page.press("Enter")
    assert second.partition(" ")[0] in detail(page)
    page.run("document.getElementById('canvas').focus()")
    before = page.run(f"[{GRAPH}.zoom(), {GRAPH}.pan().x]")
    page.press("+")
    page.press("ArrowLeft")
    zoom, left = page.run(f"[{GRAPH}.zoom(), {GRAPH}.pan().x]")
    assert zoom > before[0] and left != before[1]
    page.press("0")
    page.press("Escape")
    assert "Choose an element" in detail(page)


def test_buttons_zoom_and_fit(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    fitted = page.run(f"{GRAPH}.zoom()")
    click(page, "#zoom-in")
    assert page.run(f"{GRAPH}.zoom()") > fitted
    click(page, "#zoom-out")
    click(page, "#zoom-out")
    assert page.run(f"{GRAPH}.zoom()") < fitted
    click(page, "#fit")
    assert page.run(f"{GRAPH}.zoom()") == pytest.approx(fitted, rel=0.1)


def test_rows_of_the_tables_are_filtered_and_completed(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    shown = (
        "[...document.querySelectorAll('details.enclave tbody tr')].filter(r => r.checkVisibility()).length"
    )
    type_into(page, "row-filter", "/odom")
    assert page.run(shown) == 2, "who publishes it and who subscribes it"
    type_into(page, "row-filter", "/rosout")
    assert page.run(shown) == 0
    click(page, "#rows-built-in")
    assert page.run(shown) == 4


CONTRAST = """
(() => {
  const channel = (v) => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = (text) => { const [r, g, b] = text.match(/[\\d.]+/g).map(Number);
    return 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b); };
  const probe = document.createElement("p"); document.body.append(probe);
  const value = (name) => { probe.style.color = `var(--${name})`; return light(getComputedStyle(probe).color); };
  const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const pairs = [["text", "back"], ["text", "soft"], ["text", "node"], ["text", "topic"], ["text", "service"],
    ["text", "action"], ["text", "group"], ["accent", "back"], ["error", "back"], ["warning", "back"],
    ["accepted", "back"]];
  const found = pairs.map(([a, b]) => [a, b, ratio(value(a), value(b))]);
  found.push(["line", "back", ratio(value("line"), value("back")) * 1.5]);
  probe.remove();
  return found.filter((each) => each[2] < 4.5);
})()
"""


def test_text_has_the_contrast_that_wcag_asks_for_in_light_and_dark(page: Page, tmp_path: Path) -> None:
    """4.5 to 1 for text, 3 to 1 for lines (WCAG 2.2, 1.4.3 and 1.4.11)."""
    opened(page, tmp_path, robot())
    back = "getComputedStyle(document.body).backgroundColor"
    light = page.run(back)
    assert page.run(CONTRAST) == []
    click(page, "#theme")
    assert page.run(back) != light
    assert page.run(CONTRAST) == []
    assert page.run(f"{GRAPH}.nodes('.node')[0].style('background-color')") == "rgb(31,58,90)"


def test_it_prints_with_everything_open_and_in_light(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    assert page.pdf().startswith(b"%PDF-")
    page.run("window.dispatchEvent(new Event('beforeprint'))")
    assert page.run("document.querySelectorAll('details:not([open])').length") == 0
    page.run("window.dispatchEvent(new Event('afterprint'))")
    assert page.run("document.querySelectorAll('details:not([open])').length") == 3


def test_no_name_becomes_markup_or_code(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, hostile(), title=HOSTILE[0])
    click(page, "#hide-built-in")
    click(page, "#rows-built-in")
    for number in range(len(listed(page))):
        page.run(f"document.querySelectorAll('#matches button')[{number}].click()")
    assert page.run("window.broken") is None
    assert page.run("document.querySelectorAll('main img, main svg, main script, body > svg').length") == 0
    assert page.told == [] and len(page.requests) == 1
    assert any("</script><script>window.broken=1</script> (topic)" in text for text in listed(page))
    assert "\x1b" not in page.run("document.body.innerText") and "\u202e" not in page.run(
        "document.body.innerText"
    )


def test_what_would_break_out_could_still_load_and_run_nothing(page: Page, tmp_path: Path) -> None:
    """The policy of the page holds without the escaping."""
    opened(page, tmp_path, robot())
    page.run(
        "document.body.insertAdjacentHTML('beforeend', '<img src=\"file:///nowhere.png\" onerror=\"window.broken=1\">')"
    )
    page.run(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.broken=1'; "
        "document.body.append(s); })()"
    )
    assert page.run("fetch('http://127.0.0.1:9/').then(() => 'went', () => 'refused')") == "refused"
    assert page.run("window.broken") is None
    assert any("Content Security Policy" in text for text in page.told)


def test_five_hundred_nodes_are_drawn_and_searched(page: Page, tmp_path: Path) -> None:
    """How fast is measured in bench/report.py; a bound on a busy machine would only tell how busy it is."""
    opened(page, tmp_path, large())
    assert page.run(f"{GRAPH}.nodes('.node').length") == 500
    type_into(page, "search", "area_3/node_171")
    assert listed(page) == ["/area_3/node_171 (node)"]
    assert page.run("document.getElementById('only-near').checked"), "names of so many cannot be read at once"
    assert drawn(page) == {
        "/area_3/node_171", "/area_3/out_171", "/area_3/state_171", "/area_3/out_170", "/area_3/state_164",
        "/area_0/state_21",
    }  # fmt: skip
    type_into(page, "search", "")
    click(page, "#only-near")
    assert page.run(f"{GRAPH}.nodes('.node:visible').length") == 500
    assert page.told == []


@pytest.mark.parametrize("width", [390, 1024, 1600])
@pytest.mark.parametrize("dark", [False, True])
def test_nothing_sticks_out_or_overlaps_at_any_width(tmp_path: Path, width: int, dark: bool) -> None:
    if chromium() is None:
        pytest.skip("no Chromium")
    file = tmp_path / "report.html"
    file.write_text(html_report(contents(robot())))
    with browser(width=width, height=900, dark=dark) as page:
        page.open(file)
        assert page.run("document.documentElement.scrollWidth") <= width
        overlap = (
            "(() => { const [a, b] = ['h1', '#theme'].map(s => document.querySelector(s).getBoundingClientRect());"
            " return a.right > b.left && a.bottom > b.top && a.left < b.right && a.top < b.bottom; })()"
        )
        assert page.run(overlap) is False
        assert page.run("document.getElementById('canvas').clientWidth") > 0.9 * width - 60
        assert page.run(f"{GRAPH}.zoom()") > 0.3 and page.told == []


def test_an_enclave_is_chosen_in_the_list_and_shown_alone(page: Page, tmp_path: Path) -> None:
    opened(page, tmp_path, robot())
    names = page.run("[...document.querySelectorAll('#enclaves button code')].map(b => b.textContent)")
    assert len(names) == 4
    page.run("document.querySelectorAll('#enclaves button')[2].click()")
    visible = "filter(each => each.checkVisibility()).map(each => each.dataset.enclave)"
    shown = f"[...document.querySelectorAll('details.enclave')].{visible}"
    assert page.run(shown) == ["2"]
    assert names[2] in detail(page)
