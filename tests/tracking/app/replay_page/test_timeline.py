"""The timeline of the replay page: bars of ids, their sizes, and their links."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sim.types import GroupEvent, Sequence
from tests.groups_as_wholes import wholes
from tracking.app.replay_page.page import Run, page_data
from tracking.app.replay_page.timeline import Bar, bars, links


def test_bars_and_links_of_groups(sequence: Sequence) -> None:
    """Their sizes are those estimated; what merges and splits joins bars of both sides."""
    data = page_data(sequence, [Run(wholes(sequence, "ground"))])
    assert {bar[0]: (*bar[1:3], bar[4]) for bar in data["tracks"]["bars"]} == {
        1: (1, 160, 5), 2: (1, 53, 2), 3: (114, 160, 2),
    }  # fmt: skip
    assert data["tracks"]["links"] == [(54, 2, 1), (114, 1, 3)]
    assert data["truth"]["links"] == [(50, 2, 1), (110, 1, 3)]


def rows(*lives: tuple[int, int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """frame, group of lives (id, first, last, people)."""
    made = [(f, g) for g, a, b, n in lives for f in range(a, b + 1) for _ in range(n)]
    table = np.array(made or np.zeros((0, 2)), np.int64)
    return table[:, 0], table[:, 1]


def test_bars_are_unbroken_lives_in_free_lanes() -> None:
    made = bars(*rows((1, 1, 9, 3), (2, 1, 4, 2), (3, 6, 9, 2), (-1, 1, 9, 4)))
    assert made == [Bar(2, 1, 4, 0, 2), Bar(1, 1, 9, 1, 3), Bar(3, 6, 9, 0, 2)]


@given(st.lists(st.tuples(st.integers(1, 40), st.integers(0, 10)), max_size=12))
def test_bars_of_a_lane_never_overlap(spans: list[tuple[int, int]]) -> None:
    made = bars(*rows(*((k, a, a + n, 2) for k, (a, n) in enumerate(spans))))
    assert len(made) == len(spans)
    for lane in {bar.lane for bar in made}:
        mine = sorted((bar.start, bar.end) for bar in made if bar.lane == lane)
        assert all(a[1] < b[0] for a, b in itertools.pairwise(mine))


def test_links_join_and_fork() -> None:
    def event(kind: str, before: tuple[int, ...], after: tuple[int, ...], emitted: int | None = None) -> GroupEvent:
        return GroupEvent(kind, 10, 12, emitted, before, after, (), (0.0, 0.0))

    merge, split = event("merge", (-1, 1, 2), (1,)), event("split", (1,), (1, 3), emitted=14)
    more = event("cross", (1, 2), (1, 2)), event("form", (-1, -1), (4,))
    assert links((merge, split, *more)) == [(10, 2, 1), (14, 1, 3)]
