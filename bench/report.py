"""The HTML report of a large plan: making it, drawing it and answering a search in a real browser.

python -m bench.report [NODES]     default: 500

make      seconds of processor time from the dry run's JSON to the page
draw      from opening the page to its second frame with the graph: seconds of the browser's clock
search    from a typed word to the second frame after it, likewise
thread    processor time of the page's thread for both, which other programs of a busy machine do not lengthen
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

from enclave_addons.review.html.page import html_report
from tests.addons.review.report.browser import Page, browser
from tests.addons.review.report.conftest import contents, large

RUNS = 5
_FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
_SEARCH = (
    "(async () => {{ const start = performance.now(); const field = document.getElementById('search'); "
    "field.value = {word!r}; field.dispatchEvent(new Event('input')); await {frames}; "
    "return (performance.now() - start) / 1000; }})()"
)


def measure(page: Page, file: Path) -> tuple[float, float, float]:
    """Seconds to draw, to search, and of the thread."""
    page.call("Page.navigate", url="about:blank")
    before = _thread(page)
    page.open(file)
    drawn = page.run(f"{_FRAMES}.then(() => performance.now() / 1000)")
    found = page.run(_SEARCH.format(word="area_3/node_171", frames=_FRAMES))
    return drawn, found, _thread(page) - before


def _thread(page: Page) -> float:
    metrics = page.call("Performance.getMetrics")["metrics"]
    return float(next(each["value"] for each in metrics if each["name"] == "TaskDuration"))


def main() -> None:
    nodes = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    plan = large(nodes)
    start = time.process_time()
    text = html_report(contents(plan))
    print(f"{nodes} nodes, {len(text) / 1e6:.1f} MB: make {time.process_time() - start:.2f} s")
    with tempfile.TemporaryDirectory() as folder, browser() as page:
        file = Path(folder) / "report.html"
        file.write_text(text, encoding="utf-8")
        page.call("Performance.enable", timeDomain="threadTicks")
        runs = [measure(page, file) for _ in range(RUNS)]
    for name, values in zip(("draw", "search", "thread"), zip(*runs, strict=True), strict=True):
        print(f"{name}: median {statistics.median(values):.2f} s, best {min(values):.2f} s of {RUNS}")


if __name__ == "__main__":
    main()
