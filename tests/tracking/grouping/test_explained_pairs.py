"""The evidence about pairs adds up to the belief, whatever the recording; people are known by where they are."""

from __future__ import annotations

import numpy as np

from tests.near_pairs import table_of, walking
from tracking.grouping.belief import default_belief
from tracking.grouping.explained_pairs import VALUES, explain
from tracking.grouping.pair_beliefs import beliefs_of_tracks
from tracking.grouping.pair_evidence import NAMES


def test_terms_add_up_to_the_belief():
    table, belief = table_of(walking(3)), default_belief()
    found = explain(table, 2.5, belief)
    expected = beliefs_of_tracks(table.frame, table.column, table.pos, table.length, 2.5, belief)
    order = np.lexsort((expected.step, expected.b, expected.a))
    np.testing.assert_array_equal(found.a, table.ids[expected.a[order]])
    np.testing.assert_array_equal(found.step, expected.step[order])
    np.testing.assert_allclose(found.log_odds, expected.log_odds[order, 0])
    np.testing.assert_allclose(found.terms.sum(axis=1) + found.bias, found.log_odds, atol=1e-5)
    np.testing.assert_array_equal(found.noise, expected.noise[order])
    above = found.probability - found.threshold
    np.testing.assert_allclose(above, belief.together(found.log_odds, found.noise))
    assert np.ptp(found.bias) > 0.01, "the bias is that of the row's noise"
    assert "nearer others" not in found.quantities, "tables that are 0 for now are left out"
    assert set(VALUES) <= set(NAMES)
    assert (np.diff(found.pair) >= 0).all()
    assert len(np.unique(np.column_stack([found.a, found.b]), axis=0)) == found.pair[-1] + 1


def test_people_who_are_predicted_are_no_evidence():
    table = table_of(walking(3))
    seen = table.frame % 7 != 3
    few = explain(table_of(walking(3), seen), 2.5, default_belief())
    assert set((few.step % 7).tolist()) == {0, 1, 2, 4, 5, 6}


def test_people_are_known_by_place_and_time():
    def name(walk, fps=2.5):
        return explain(table_of(walk), fps, default_belief()).people

    frame, id, pos = walking(3)
    assert name((frame, id, pos + 1e-7)) == name((frame, id, pos))
    others = [name((frame, id, pos + 0.02)), name((frame, id + 1, pos)), name((frame, id, pos), 5.0)]
    assert name((frame, id, pos)) not in others


def test_nobody_and_nobody_near():
    for people in (0, 1):
        found = explain(table_of(walking(0, people=people)), 2.5, default_belief())
        assert len(found.step) == len(found.terms) == 0
