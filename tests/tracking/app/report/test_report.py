"""The report: what is chosen, what is left out, and that no text of a file becomes part of the page."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import pytest

from tests.report_parts import candidate, full
from tracking.app.report import content, moments
from tracking.app.report.moments import chosen
from tracking.app.report.page import report_html


def curve_ranges() -> set[tuple[float, float]]:
    """The ends of the horizontal axes of the curves."""
    page = report_html(full("blob"))
    charts = json.loads(re.findall(r'id="charts">(.*?)</script>', page, re.DOTALL)[0])
    found = [
        charts[id]["doc"]["roots"][0]["attributes"]["x_range"]["attributes"] for id in ("chart-shares", "chart-curves")
    ]
    return {(one["start"], one["end"]) for one in found}


EVIL = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"
EMPTY = content.Report("Two trackers", "about", "HOTA", [])


def test_all_parts_stand_in_the_page() -> None:
    page = report_html(full("blob"))
    parts = ("ranking", "scenes", "curves", "matrices", "moments", "causes", "sequences", "failures")
    assert [id for id in parts if f'<section id="{id}">' in page] == list(parts)
    charts = json.loads(re.findall(r'id="charts">(.*?)</script>', page, re.DOTALL)[0])
    assert list(charts) == ["chart-shares", "chart-curves", "chart-causes"]
    assert all(f'id="{id}"' in page for id in charts)
    assert "no scene, blob" in page, "an empty cell says why"
    assert page.count("56 %<small>0.500") == 2, "means, as a share of the oracle's 0.9"
    assert '<i class="unseen">blob on blob: </i>56 %' in page
    assert page.count('role="figure" aria-label="') == len(charts)


def test_curves_leave_room_for_their_last_marks() -> None:
    """2 % at both ends, the easy end on the left."""
    (made,) = curve_ranges()
    assert made == pytest.approx((1.012, 0.388))


def test_parts_without_content_are_left_out() -> None:
    page = report_html(EMPTY)
    assert "<section" not in page
    assert "<nav" in page


def test_text_is_escaped() -> None:
    page = report_html(full(EVIL))
    outside = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert "<img" not in outside
    assert "alert(2)</script>" not in page
    assert page.count("<script") == report_html(full("blob")).count("<script")


def test_the_page_loads_nothing() -> None:
    page = re.sub(r"<script>.*?</script>", "", report_html(full("blob")), flags=re.DOTALL)
    assert re.findall(r"(?:src|href)\s*=\s*[\"']?(?:https?:|//)", page) == []
    assert "default-src 'none'" in page


def test_moments_are_shared_among_trackers_and_scenarios() -> None:
    bad = [candidate("a", "merge", 0.1 + 0.01 * k) for k in range(8)] + [candidate("a", "split", 0.5)]
    good = [candidate("b", "merge", 0.8)]
    found = chosen([*bad, *good], most=3)
    assert [(one.name, one.scenario) for one in found] == [("a", "merge"), ("a", "split"), ("b", "merge")]
    assert len(chosen([*bad, *good])) == 10, "without other scenarios the same one again"
    assert [p.score for p in chosen([replace(p, scene="seed 1") for p in bad])] == [0.1], "a scene once, its worst run"


def test_a_report_stays_small(monkeypatch: pytest.MonkeyPatch) -> None:
    made = content.Moment(candidate("a", "merge", 0.5), 0.0, "switch", "words", "x" * 3_000_000)
    monkeypatch.setattr(moments, "_moment", lambda *_: made)
    chosen_ones = [candidate("a", "merge", k / 10) for k in range(4)]
    found = moments.moments(chosen_ones, lambda one, rival: ())  # type: ignore[return-value, arg-type]
    assert [one.replay is None for one in found] == [False, False, True, True]
    page = report_html(replace(EMPTY, moments=found))
    assert page.count('id="moment-') == 2
    assert page.count("disabled title=") == 2
