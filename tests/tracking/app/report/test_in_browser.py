"""A report in a real browser: charts, filters, replays and keys work, and nothing is written to the console."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser import CHROMIUM, Page, browser
from tests.report_parts import full
from tracking.app.cli import run
from tracking.app.report.page import report_html

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")]

CLOCK = "document.querySelector('iframe').contentDocument?.getElementById('clock')?.value"
BUTTONS = """[...document.querySelectorAll('#list li')].filter(item => !item.hidden)
    .map(item => item.querySelector('button').dataset.moment)"""
HELP = "document.querySelector('iframe').contentDocument.getElementById('help')"
CHOOSE = """{ const select = document.querySelector('select[data-field=name]');
    select.value = 'Bad'; select.dispatchEvent(new Event('change')) }"""
INK = "[...Bokeh.documents[0]._all_models.values()].find(m => m.type === 'LinearAxis').major_label_text_color"
SHOWN = "[...document.querySelectorAll('#list li')].filter(item => !item.hidden).map(item => item.dataset.name)"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on a good and a bad tracker."""
    out = tmp_path_factory.mktemp("report")
    (out / "bad.py").write_text(BAD, encoding="utf-8")
    lines = [["generate", "merge", "--seeds", "0:2", "--streams", "left", "--out", f"{out}/data"]]
    lines += [["track", "blob", f"{out}/data", "--detections", "file", "--out", f"{out}/good"]]
    options = ["--by", "group_F1", "--workers", "2", "--out", f"{out}/pages"]
    lines += [["view", f"{out}/data", f"{out}/good", f"{out}/bad.py:Bad", *options]]
    for line in lines:
        assert run(line) == 0
    return out / "pages" / "index.html"


BAD = """
import numpy as np
from sim.types import Groups
from tests.fake_tracker import Nearest

class Bad(Nearest):
    def step(self, frame, detections):  # a new id for everybody, twice a second
        found = super().step(frame, detections)
        return found.replace(id=np.arange(len(found.id)) + 100 * (frame.index // 3), groups=Groups.none())
"""


@pytest.fixture
def page(report: Path, tmp_path: Path) -> Iterator[Page]:
    """The report, opened."""
    with browser(tmp_path) as opened:
        opened.look(1300, 900)
        opened.open(report)
        opened.wait("Bokeh.documents.length === document.querySelectorAll('.chart').length")
        yield opened


def test_open_filter_replay(page: Page) -> None:
    assert page.value("document.querySelector('#ranking h2').textContent") == "Ranking by group_F1"
    assert set(page.value(SHOWN)) == {"good", "Bad"}
    page.value(CHOOSE)
    assert set(page.value(SHOWN)) == {"Bad"}
    page.value("[...document.querySelectorAll('#list li')].find(item => !item.hidden).querySelector('button').click()")
    page.wait(CLOCK)
    heading = page.value("document.querySelector('iframe').contentDocument.querySelector('h1').textContent")
    assert heading.startswith("merge-s0000")
    first = page.value(CLOCK)
    page.press("x")
    page.wait(f"{CLOCK} !== {first!r}")
    error = page.value(CLOCK)
    page.press(" ")
    page.wait(f"{CLOCK} !== {error!r}")
    panes = "document.querySelector('iframe').contentDocument.getElementById('stages').classList.contains('beside')"
    assert page.value(panes), "two trackers side by side"
    page.press("?")
    page.wait(f"{HELP}.open")
    page.press("Escape")
    page.wait(f"!{HELP}.open")
    assert page.value("document.getElementById('player').open"), "Escape closes the list of keys alone"
    page.press("]")
    page.wait(f"{CLOCK} && document.getElementById('which').textContent.startsWith('Bad')")
    second = page.value(BUTTONS)[1]
    page.press("Escape")
    page.wait("!document.getElementById('player').open")
    page.wait(f"document.activeElement.dataset.moment === {second!r}")
    assert page.messages == []


@pytest.mark.parametrize("dark", [False, True])
def test_looks(page: Page, dark: bool) -> None:
    """Text of charts has the contrast of text to the page; nothing is wider than a phone."""
    page.look(390, 844, dark)
    page.wait("document.documentElement.scrollWidth <= 390")
    assert page.value(INK) == ("#c9d1d9" if dark else "#3b434b")
    assert page.messages == []


WIDE = """[...document.querySelectorAll('.wide')].filter(table => table.checkVisibility())
    .map(table => [table.scrollWidth > table.clientWidth + 1, table.classList.contains('more')])"""
LINES = """(() => { const node = document.querySelector('h1'), found = []; let top = null;
    const walk = document.createTreeWalker(node, NodeFilter.SHOW_TEXT); const range = document.createRange();
    for (let text; text = walk.nextNode();) for (let k = 0; k < text.length; k++) {
        range.setStart(text, k); range.setEnd(text, k + 1);
        const at = range.getBoundingClientRect().top;
        if (top === null || at > top + 4) { found.push(''); top = at; }
        found[found.length - 1] += text.data[k];
    } return found; })()"""


@pytest.mark.parametrize("width", [390, 1280])
def test_a_narrow_page_cuts_nothing(width: int, tmp_path: Path) -> None:
    name = "experiments/baseline_v2/my_nearest_neighbour_tracker.py:NearestNeighbourTracker"
    (tmp_path / "r.html").write_text(report_html(full(name)), encoding="utf-8")
    with browser(tmp_path) as opened:
        opened.look(width, 900)
        opened.open(tmp_path / "r.html")
        opened.wait("Bokeh.documents.length === document.querySelectorAll('.chart').length")
        opened.wait(f"{WIDE}.every(([wide, more]) => wide === more)")
        assert opened.value("document.documentElement.scrollWidth") <= width
        assert any(wide for wide, _ in opened.value(WIDE)) or width > 390
        for line in opened.value(LINES)[:-1]:
            assert line.rstrip()[-1] in "/._:=-" or line.endswith(" "), f"a line of the title ends in a word: {line}"
