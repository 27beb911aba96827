"""The evidence on the page comes back as it was, is bounded, and says whose it is."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest

from sim.types import Sequence, Tracks
from tests.groups_as_wholes import wholes
from tests.near_pairs import evidence_of
from tracking.app.replay_page import pair_columns as module
from tracking.app.replay_page.page import Run, write_page
from tracking.app.replay_page.pair_columns import in_bytes, pair_columns, shown_pairs
from tracking.fitting.place_belief import changed
from tracking.grouping.belief import default_belief
from tracking.grouping.explained_pairs import VALUES
from tracking.grouping.link_rule import LinkRule
from tracking.running.explained_people import explained_people
from tracking.running.run import TrackingRun, group


def numbers(text, span):
    whole = np.frombuffer(base64.b64decode(text), np.uint8).astype(float)
    return np.where(whole == 255, np.nan, span[0] + span[1] * whole)


def test_columns_come_back(sequence: Sequence) -> None:
    found, pairs = pair_columns(sequence, None), explained_people(sequence, None, default_belief())
    stints = np.array(found["stints"])
    rows = [(a, b, step + k) for a, b, step, count in stints.tolist() for k in range(count)]
    assert rows == list(zip(pairs.a.tolist(), pairs.b.tolist(), pairs.step.tolist(), strict=True))
    np.testing.assert_allclose(numbers(found["probability"], found["probability_range"]), pairs.probability, atol=0.003)
    for name, span, near in (("threshold", "probability", 0.003), ("bias", "term", 0.051), ("noise", "noise", 0.006)):
        np.testing.assert_allclose(numbers(found[name], found[f"{span}_range"]), getattr(pairs, name), atol=near)
    for k, name in enumerate(VALUES):
        quantity = name.partition(",")[0]
        span = found["ranges"][quantity]
        values = pairs.values[:, k]
        np.testing.assert_allclose(numbers(found["values"][quantity], span), values, atol=0.51 * span[1])
    for q, name in enumerate(pairs.quantities):
        np.testing.assert_allclose(numbers(found["terms"][name], found["term_range"]), pairs.terms[:, q], atol=0.051)
    assert found["left_out"] == 0
    assert found["people"] == pairs.people
    assert {q["a"] for q in found["questions"]} <= set(pairs.a.tolist())


def test_a_pair_that_comes_back_has_a_stint_for_each_time(sequence: Sequence, monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = evidence_of(0, people=2)
    seen = pairs.take(np.flatnonzero(pairs.step % 20 != 7))
    monkeypatch.setattr(module, "explained_people", lambda *_: seen)
    assert pair_columns(sequence, None)["stints"] == [
        [10, 11, 0, 7], [10, 11, 8, 19], [10, 11, 28, 19], [10, 11, 48, 12],
    ]  # fmt: skip


def test_bytes_end_at_their_range() -> None:
    column = np.array([-9.0, 0.0, 1.004, np.nan, 99.0])
    np.testing.assert_array_equal(numbers(in_bytes(column, 0.0, 0.02), (0, 0.02)), [0, 0, 1.0, np.nan, 5.08])


def test_the_least_probable_pairs_are_left_out() -> None:
    pairs = evidence_of(0, people=30)
    kept = shown_pairs(pairs, most=400)
    count = np.bincount(pairs.pair)
    assert 300 < count[kept].sum() <= 400
    highest = np.array([pairs.log_odds[pairs.pair == k].max() for k in range(len(count))])
    assert highest[kept].min() >= highest[~kept].max()
    assert shown_pairs(pairs).all()


def note(sequence: Sequence, run: TrackingRun | None, belief=None) -> str:
    return pair_columns(sequence, run, belief)["note"]


def test_the_page_says_whose_groups_and_whose_evidence(sequence: Sequence, tracks: list[Tracks]) -> None:
    other = changed(default_belief(), np.array([0.5, 0.0, 0.0]))
    assert note(sequence, None) == note(sequence, group(sequence)) == ""
    assert note(sequence, group(sequence, grouping=other), other) == ""
    assert "--grouping" in note(sequence, group(sequence, grouping=other))
    assert "rule" in note(sequence, group(sequence, grouping=LinkRule()))
    assert "not stated" in note(sequence, TrackingRun(tuple(tracks)))
    assert "names its groups itself" in note(sequence, TrackingRun(tuple(tracks), {"tracker": "joint"}))
    shown, default = pair_columns(sequence, None, other), explained_people(sequence, None, default_belief())
    np.testing.assert_allclose(numbers(shown["bias"], shown["term_range"]), default.bias + 0.5, atol=0.051)


def test_groups_last_on_the_page_where_the_belief_made_them(sequence: Sequence, tracks: list[Tracks]) -> None:
    belief = default_belief()
    assert pair_columns(sequence, group(sequence))["held"] == [belief.hold, belief.join]
    assert pair_columns(sequence, None)["held"] is None
    assert pair_columns(sequence, TrackingRun(tuple(tracks)))["held"] is None


def test_without_people_there_is_no_evidence(sequence: Sequence, tmp_path) -> None:
    bare = Sequence("bare", 10.0, 5, lambda: iter(()))
    assert '"pairs":{}' in write_page(bare, [], tmp_path / "bare.html").read_text()
    assert pair_columns(sequence, TrackingRun(())) is None
    page = write_page(sequence, [Run(wholes(sequence, "ground"))], tmp_path / "page.html").read_text()
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page, re.DOTALL)[0])
    assert data["pairs"].keys() == {"truth"}, "not of whole groups"
