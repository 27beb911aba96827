"""Members of derived groups: connected people against the exact function of tracking.grouping."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.grouping.group_labels import label_people
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.grouping.merge_split_events import TrackedMotion
from tracking.objective import derived_members_kernels as kernels


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_partitions_are_those_of_the_rule(seed):
    """Who is with whom in each frame, names apart; people come, go, and are not seen for a while."""
    rng = np.random.default_rng(seed)
    length, people = 40, 7
    walk = np.cumsum(rng.normal(0, 0.12, (length, people, 2)), 0) + rng.uniform(0, 3, (people, 2))
    seen = rng.random((length, people)) < 0.8
    frame, column = np.nonzero(seen)
    pos, rule, fps = walk[frame, column], LinkRule(window=0.6, patience=0.4, acquaintance=0.2, memory=0.3), 10.0
    links = find_links(frame, column, pos, np.zeros_like(pos), length, fps, rule)
    places = np.where(seen[..., None], walk, np.nan)
    expected = label_people(frame, column, TrackedMotion(places, np.zeros_like(places), fps), links, rule)[0]
    made = kernels.connected_people(frame, column, length, people, 3, links.frame, links.a, links.b, links.on)
    for t in range(length):
        here = frame == t
        assert together(column[here], made[here]) == together(column[here], expected[here])


def together(who, label):
    return {frozenset(who[label == g].tolist()) for g in set(label[label >= 0].tolist())}
