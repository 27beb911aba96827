"""Who came from whom, told by a method that knows hulls only."""

from __future__ import annotations

import pytest

from sim.types import GroupEvent
from tests.hand_made import Scene, tracks, truth
from tracking.scoring.evaluation import evaluate

AB, CD, EF = (1, 2), (3, 4), (5, 6)
Hull = tuple[float, float]  # m: from x0 to x1


def row(hulls: dict[int, Hull], members: dict[int, tuple[int, ...]]) -> Scene:
    """Six people in a row, at x = 2, 4, …, 12 m."""
    people = {i: (2.0 * i, 0.0) for i in range(1, 7)}
    return Scene(people, {g: (members[g], (x0, -0.3, x1, 0.3)) for g, (x0, x1) in hulls.items()})


def pairs(first: Hull, second: Hull) -> list[Scene]:
    """Three pairs; from frame 30 on the first two are one."""
    apart = row({1: first, 2: second, 3: (10, 12)}, {1: AB, 2: CD, 3: EF})
    return [apart] * 29 + [row({1: (2, 8), 3: (10, 12)}, {1: AB + CD, 3: EF})] * 31


def accuracy(seen: list[Scene], before: tuple[int, ...], after: tuple[int, ...]) -> float:
    true, told = (
        GroupEvent("merge", 30, 30, 30, *parts, (5.0, 0.0)) for parts in (((1, 2), (1,), AB + CD), (before, after, ()))
    )
    return evaluate(truth(pairs((2, 4), (6, 8)), [true]), tracks(seen, [told], unit="group"))["lineage_accuracy"]


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
    assert accuracy(pairs((2, 4), (6, 8)), before, after) == right


def test_a_person_inside_two_hulls_belongs_to_the_smaller() -> None:
    assert accuracy(pairs((2, 8), (5.8, 8)), (1, 2), (1,)) == 1
