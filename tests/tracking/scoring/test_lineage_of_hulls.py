"""Who came from whom, told by a method that knows hulls only: the truth's own groups are right, in both planes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import GroupEvent, Tracks, Truth
from sim.types import Sequence as Recording
from tests.groups_as_wholes import wholes
from tests.hand_made import Scene, tracks, truth
from tracking.scoring.evaluation import evaluate

ALONE = 1_000
CASES = [(name, seed) for name in ("merge", "split") for seed in range(2)]


@cache
def recording(name: str, seed: int) -> Recording:
    return simulate(load(name), seed, streams=())


def with_groups_of_one(true: Truth) -> Truth:
    """People alone are groups, too: a method of groups follows them as such, and events name them."""
    group = np.where(true.group >= 0, true.group, ALONE + true.id)
    label = {(f, i): g for f, i, g in zip(true.frame.tolist(), true.id.tolist(), group.tolist(), strict=True)}

    def named(event: GroupEvent) -> GroupEvent:
        before, after = (tuple(sorted({label[f, m] for m in event.members})) for f in (event.start - 1, event.start))
        return replace(event, before=before, after=after)

    events = tuple(named(e) for e in true.events or () if e.kind in ("merge", "split"))
    return true.replace(group=group, events=events)


def told(case: Recording, plane: str) -> list[Tracks]:
    return wholes(SimpleNamespace(truth=with_groups_of_one(case.truth)), plane)


def retold(answers: Sequence[Tracks], change: Callable[[GroupEvent], GroupEvent]) -> list[Tracks]:
    return [replace(t, events=tuple(change(e) for e in t.events)) for t in answers]


@pytest.mark.parametrize("plane", ["image", "ground"])
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_true_groups_are_right(name: str, seed: int, plane: str) -> None:
    case = recording(name, seed)
    found = evaluate(case.truth, told(case, plane))
    assert found[f"{name}_F1"] == 1
    assert found["lineage_accuracy"] == found["lineage_accuracy_found"] == 1


@pytest.mark.parametrize("plane", ["image", "ground"])
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_parents_for_children_are_wrong(name: str, seed: int, plane: str) -> None:
    case = recording(name, seed)
    swapped = retold(told(case, plane), lambda e: replace(e, before=e.after, after=e.before))
    found = evaluate(case.truth, swapped)
    assert found[f"{name}_F1"] == 1  # it was seen, where and when it was
    assert found["lineage_accuracy"] == found["lineage_accuracy_found"] == 0


FRAMES = 60
AB, CD, EF = (1, 2), (3, 4), (5, 6)
PEOPLE = {i: (2.0 * i, 0.0) for i in range(1, 7)}


def scenes(merged_at: int, hulls: Callable[[int], dict[int, tuple[float, float]]] | None = None) -> list[Scene]:
    """Three pairs in a row, the first two are one from a frame on. hulls: from and to where each group is seen."""
    made = []
    for k in range(1, FRAMES + 1):
        members = {1: AB, 2: CD, 3: EF} if k < merged_at else {1: AB + CD, 3: EF}
        span = {g: (2.0 * min(m), 2.0 * max(m)) for g, m in members.items()} | (hulls(k) if hulls else {})
        made.append(Scene(PEOPLE, {g: (m, (span[g][0], -0.3, span[g][1], 0.3)) for g, m in members.items()}))
    return made


def merge(start: int, said: int, before: tuple[int, ...], after: tuple[int, ...], members=()) -> GroupEvent:
    return GroupEvent("merge", start, said, said, before, after, members, (5.0, 0.0))


def accuracy(seen: list[Scene], event: GroupEvent, start: int = 30) -> float:
    true = truth(scenes(start), [merge(start, start, (1, 2), (1,), AB + CD)])
    return evaluate(true, tracks(seen, [event], unit="group"))["lineage_accuracy"]


@pytest.mark.parametrize(
    ("before", "after", "right"),
    [
        ((1, 2), (1,), 1),
        ((2, 1), (1,), 1),
        ((1, 3), (1,), 0),  # the wrong parent
        ((2, 3), (1,), 0),
        ((1, 2), (3,), 0),  # the wrong child
        ((1, 2, 3), (1,), 0),
        ((1,), (1,), 0),
        ((1, 9), (1,), 0),  # nobody's name
    ],
)
def test_parents_must_be_the_right_ones(before: tuple[int, ...], after: tuple[int, ...], right: float) -> None:
    assert accuracy(scenes(30), merge(30, 30, before, after)) == right
