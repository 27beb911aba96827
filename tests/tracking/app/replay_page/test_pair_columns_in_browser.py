"""In a real browser: two people are clicked and explained, pairs are labelled by keys, and `fit` reads the file."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.browser import CHROMIUM, PATIENCE, Page, browser
from tests.refusals import answer
from tracking.app.cli import run

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")]

TITLE = "document.getElementById('pair-title').textContent"
ASKED = "document.getElementById('ask-title').textContent"
LEAVES = "dispatchEvent(new Event('beforeunload', { cancelable: true }))"  # False: the browser asks before it leaves
HIDDEN = "document.getElementById('pair').hidden"
REASONS = "[...document.querySelectorAll('#pair-reasons dt')].map(x => Number(x.textContent.replace('−', '-')))"
# The frames before and after the replay goes back.
AGAIN = """new Promise(done => { let last = 0; const look = () => {
    const frame = Number(document.getElementById('seek').value);
    if (frame < last) done([last, frame]);
    else { last = frame; requestAnimationFrame(look); } }; look(); })"""
# Where the people of the shown frame stand on the plan, px of the page, by id: as the page's own map has it.
PLACES = """(() => {
    const data = JSON.parse(document.getElementById('data').textContent), raw = data.tracks, canvas = document.getElementById('plan');
    const [x0, y0, x1, y1] = data.bounds, box = canvas.getBoundingClientRect();
    const scale = Math.min((box.width - 16) / (x1 - x0), (box.height - 16) / (y1 - y0));
    const sums = list => { let t = 0; return list.map(v => (t += v) / raw.scale); };
    const xs = sums(raw.x), ys = sums(raw.y), frame = Number(document.getElementById('seek').value), found = [];
    let row = 0;
    for (const [id, first, count] of raw.stints) {
        if (first <= frame && frame < first + count) { const k = row + frame - first;
            found.push([id, box.left + box.width / 2 + (xs[k] - (x0 + x1) / 2) * scale, box.top + box.height / 2 - (ys[k] - (y0 + y1) / 2) * scale]); }
        row += count;
    }
    return found; })()"""  # noqa: E501


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A street without pictures, its groups, and the page of both."""
    out = tmp_path_factory.mktemp("pairs")
    data = f"{out}/data/flockscope-demo/street-s40000"
    lines = [["generate", "street", "--seeds", "40000", "--streams", "none", "--set", "duration=40.0"]]
    lines[0] += ["--out", f"{out}/data"]
    lines += [["group", data, "--out", f"{out}/run"], ["view", data, f"{out}/run", "--out", f"{out}/page.html"]]
    for line in lines:
        assert run(line) == 0
    return out


@pytest.fixture(params=[(1280, False), (390, True)])
def page(made: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Page]:
    """The page, wide and light, then narrow and dark."""
    width, dark = request.param
    with browser(tmp_path / "browser") as opened:
        opened.look(width, 1000, dark)
        opened.open(Path(f"{made / 'page.html'}"))
        yield opened
        opened.wait(f"document.documentElement.scrollWidth <= {width}")
        assert opened.messages == []


def two_of_one_group(page: Page) -> list[tuple[int, float, float]]:
    """Two people of one group in the first frame that has one, and where they are drawn."""
    words = page.value("[...document.querySelectorAll('#facts dd')].map(x => x.textContent)")
    while not any("T" in word and "," in word for word in words):
        page.press("ArrowRight")
        words = page.value("[...document.querySelectorAll('#facts dd')].map(x => x.textContent)")
    word = next(word for word in words if word.startswith("T"))
    ids = [int(x) for x in word.split("(")[1].split(")")[0].split(",")]
    where = {int(id): (x, y) for id, x, y in page.value(PLACES)}
    return [(id, *where[id]) for id in ids[:2]]


def click(page: Page, x: float, y: float) -> None:
    """A click; on the narrow page the touch of a finger, 8 px off."""
    if page.value("innerWidth") < 600:
        page.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y - 8}])
        page.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        return
    for kind in ("mousePressed", "mouseReleased"):
        page.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)


def test_two_people_are_clicked_and_explained(page: Page) -> None:
    page.value("document.getElementById('show-truth').click()")
    (a, *first), (b, *second) = two_of_one_group(page)
    assert page.value(HIDDEN)
    click(page, *first)
    assert page.value(HIDDEN)
    assert page.value("document.getElementById('pair-a').value") == f"tracks:{a}"
    click(page, *second)
    page.wait(f"!{HIDDEN}")
    assert page.value(TITLE).startswith(f"{a} and {b}: together with probability ")
    told = int(page.value(TITLE).split()[-2])
    total = sum(page.value(REASONS))
    assert 100 / (1 + np.exp(-total)) == pytest.approx(told, abs=7), "what is listed adds up, rounded"
    assert page.value("document.querySelectorAll('#pair-chart .lane').length") >= 2, "truly and reported together"
    assert page.value("document.querySelectorAll('#pair-chart path').length") >= 5
    page.press("Escape")
    page.wait(HIDDEN)


def test_a_pair_is_chosen_from_the_lists(page: Page) -> None:
    choose = """(id, k) => { const list = document.getElementById(id); list.selectedIndex = k;
        list.dispatchEvent(new Event('change')); return list.options[k].textContent }"""
    page.value(f"({choose})('pair-a', 1)")
    assert "up to" in page.value(f"({choose})('pair-b', 1)")
    page.wait(f"!{HIDDEN}")
    svg = "document.querySelector('#pair-chart svg')"
    before = page.value("document.getElementById('seek').value")
    page.value(f"{svg}.scrollIntoView({{ block: 'center' }})")
    x, y = page.value(f"(box => [box.left + 0.5 * box.width, box.top + 40])({svg}.getBoundingClientRect())")
    click(page, x, y)
    page.wait(f"document.getElementById('seek').value !== {before!r}")


def test_labels_by_keys_are_saved_and_fitted(
    page: Page, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page.send("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    frame = page.value("document.getElementById('seek').value")
    page.value("document.getElementById('ask-start').click()")
    count = int(page.value(ASKED).split()[2].rstrip(":"))
    assert count >= 10
    questions = "JSON.parse(document.getElementById('data').textContent).pairs.tracks.questions"
    _, _, first, last = page.value(f"Object.values({questions}[0])")
    page.value("{ const s = document.getElementById('speed'); s.value = 8; s.dispatchEvent(new Event('change')) }")
    assert page.value(LEAVES)
    before, after = page.value(AGAIN)
    assert first <= after < before <= last, "the stretch repeats"
    for key in "122u3":
        page.press(key)
    assert page.value(ASKED).startswith(f"4 of {count}")
    for k in range(3, count):
        page.press("12"[k % 2])
    page.wait(f"{ASKED} === 'Thank you'")
    assert not page.value(LEAVES), "answers would be lost"
    page.press("u")
    page.press("1")
    page.press("1")
    page.value("document.getElementById('ask-save').click()")
    end, file = time.monotonic() + PATIENCE, tmp_path / "street-s40000-pairs.json"
    while not file.exists():
        assert time.monotonic() < end, "no file"
        time.sleep(0.1)
    saved = json.loads(file.read_text(encoding="utf-8"))
    assert page.value(LEAVES)
    page.press("u")
    assert not page.value(LEAVES), "the answers are others than the saved ones"
    page.press("1")
    assert page.value(LEAVES)
    said = [x["answer"] for x in saved["answers"]]
    assert said[:4] == ["together", "not", "don't know", "not"]
    assert len(said) == count
    page.press("Escape")
    page.wait("!document.body.classList.contains('asking')")
    assert page.value("document.getElementById('seek').value") == frame
    for source in ("run", "data"):
        out = answer(capsys, "fit", "grouping", "--labels", file, made / source, "--out", tmp_path / f"{source}.toml")
        assert out["fitted"]["answers"] == count - 1
    mine = tmp_path / "run.toml"
    answer(capsys, "group", made / "run", "--grouping", mine, "--out", tmp_path / "again")
    line = ["view", made / "data", tmp_path / "again", "--grouping", mine, "--out", tmp_path / "again.html"]
    answer(capsys, *line)
