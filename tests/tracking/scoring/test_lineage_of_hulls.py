"""Who came from whom, told by a method that knows hulls only."""

from __future__ import annotations

import pytest

from sim.types import GroupEvent
from tests.hand_made import Scene, tracks, truth
from tracking.scoring.evaluation import evaluate

FRAMES = 60
AB, CD, EF = (1, 2), (3, 4), (5, 6)
PEOPLE = {i: (2.0 * i, 0.0) for i in range(1, 7)}


def scenes(merged_at: int) -> list[Scene]:
    """Three pairs in a row, the first two are one from a frame on."""
    made = []
    for k in range(1, FRAMES + 1):
        members = {1: AB, 2: CD, 3: EF} if k < merged_at else {1: AB + CD, 3: EF}
        span = {g: (2.0 * min(m), 2.0 * max(m)) for g, m in members.items()}
        made.append(Scene(PEOPLE, {g: (m, (span[g][0], -0.3, span[g][1], 0.3)) for g, m in members.items()}))
    return made


def merge(start: int, said: int, before: tuple[int, ...], after: tuple[int, ...], members=()) -> GroupEvent:
    return GroupEvent("merge", start, said, said, before, after, members, (5.0, 0.0))


def accuracy(seen: list[Scene], event: GroupEvent, start: int = 30) -> float:
    true = truth(scenes(start), [merge(start, start, (1, 2), (1,), AB + CD)])
    return evaluate(true, tracks(seen, [event], unit="group"))["lineage_accuracy"]


PARENTS = [
    ((1, 2), (1,), 1),
    ((2, 1), (1,), 1),
    ((1, 3), (1,), 0),  # the wrong parent
    ((2, 3), (1,), 0),
    ((1, 2), (3,), 0),  # the wrong child
    ((1, 2, 3), (1,), 0),
    ((1,), (1,), 0),
    ((1, 9), (1,), 0),  # nobody's name
]


@pytest.mark.parametrize(("before", "after", "right"), PARENTS)
def test_parents_must_be_the_right_ones(before: tuple[int, ...], after: tuple[int, ...], right: float) -> None:
    assert accuracy(scenes(30), merge(30, 30, before, after)) == right
