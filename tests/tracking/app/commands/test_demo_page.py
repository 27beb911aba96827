"""The demo's page: a row of the heat map, who stands beside whom, the opening, and the page in a browser."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from sim.types import Sequence
from tests.browser import CHROMIUM, Page, browser
from tests.report_parts import full
from tracking.app.cli import run
from tracking.app.commands import demo
from tracking.app.report.content import Opening
from tracking.app.report.page import report_html
from tracking.app.scored_sequence import ScoringJob


def test_a_tracker_is_a_share_of_the_oracle_with_the_same_input() -> None:
    rows = [
        {"run": "oracle from points", "input": "points", "mean": 0.5, "first": None},
        {"run": "oracle from boxes", "input": "boxes", "mean": 0.8, "first": None},
        {"run": "blob", "input": "boxes", "mean": 0.4, "first": 1},
        {"run": "joint", "input": "points", "mean": 0.4, "first": 1},
    ]
    cells = demo._cells(rows, ["joint", "blob", "stereo"])
    assert [cell.share for cell in cells[:2]] == [0.8, 0.5]
    assert cells[2].why == "not run"


@pytest.mark.parametrize(
    ("hota", "key", "ends", "scores"),
    [
        ((0.5, 0.9, math.nan), "HOTA", ["b", "a"], [0.9, 0.5]),
        ((0.5, math.nan, math.nan), "group_F1", ["a", "c"], [1.0, 0.2]),
    ],
)  # fmt: skip
def test_best_and_worst(
    hota: tuple[float, ...], key: str, ends: list[str], scores: list[float], sequence: Sequence,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """By HOTA if two trackers have it, else by the score that ranks."""
    found = [{"HOTA": h, "group_F1": g} for h, g in zip(hota, (1.0, 0.6, 0.2), strict=True)]
    judged = demo.JudgedRuns(
        ScoringJob(("a", "b", "c")), SimpleNamespace(scores=found), [SimpleNamespace(errors=())] * 3
    )  # fmt: skip
    monkeypatch.setattr(demo, "read_runs", lambda _, job: job.sources)
    runs, by, values = demo._best_and_worst(sequence, judged, ["a", "b", "c"], "group_F1")
    assert ([run.name for run in runs], by, values) == (ends, key, scores)
    assert [run.tracks for run in runs] == ends


def test_the_report_opens_with_the_replay() -> None:
    """Before the ranking, whose table is folded; its page cannot end the attribute that it stands in."""
    page = report_html(replace(full("blob"), opening=Opening("Words.", '<p title="x">&amp;</p>', "pages/a.html")))
    assert 'srcdoc="&lt;p title=&#34;x&#34;&gt;&amp;amp;&lt;/p&gt;"' in page
    assert page.index('id="opening"') < page.index('id="ranking"')
    assert "<details><summary>As a table" in page[page.index('id="ranking"') :][:600]
    assert "<details open><summary>As a table" in report_html(full("blob"))


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("demo")
    assert run(["demo", "--quick", "--out", str(out)]) == 0
    return out / "index.html"


@pytest.fixture
def page(index: Path, tmp_path: Path) -> Iterator[Page]:
    with browser(tmp_path) as opened:
        opened.look(1280, 900)
        opened.open(index)
        yield opened


INNER = "document.querySelector('#opening iframe').contentDocument"
FRAME = f"parseInt({INNER}.getElementById('clock').value)"
STATE = f"{INNER}.getElementById('play').getAttribute('aria-label')"


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_replay_plays_and_names_errors(page: Page, index: Path) -> None:
    page.wait(f"{INNER}.querySelector('video')?.readyState > 1 && {STATE} === 'Pause'")
    first = page.value(FRAME)
    page.wait(f"{FRAME} !== {first}")
    page.wait(f"{INNER}.querySelector('#now .kind') !== null")
    page.press(" ")
    page.wait(f"{STATE} === 'Play'")
    still = page.value(FRAME)
    page.press("ArrowRight")
    page.wait(f"{FRAME} === {min(still + 1, 50)}")
    assert page.value("scrollY") == 0, "the page around it does not move"
    page.look(390, 844)
    page.wait("document.documentElement.scrollWidth <= 390")
    assert page.messages == []
    html = index.read_text(encoding="utf-8")
    assert html.count("&lt;noscript&gt;&lt;img src=") == 1, "a picture without JavaScript"
