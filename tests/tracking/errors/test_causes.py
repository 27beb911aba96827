"""Causes of errors in facts made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.errors.causes import Facts, cause_of_group, cause_of_person
from tracking.errors.groups import GroupError
from tracking.errors.people import PersonError

FRAMES, FPS = 20, 10.0


def facts(places: dict[int, tuple[float, float]], boxes: dict[int, tuple[float, ...]], hidden: int) -> Facts:
    """People who stand still; one of them is hidden in all frames."""
    ids = sorted(places)
    id, rows = np.tile(ids, FRAMES), FRAMES * len(ids)
    pos, box = (np.tile([of[i] for i in ids], (FRAMES, 1)).astype(float) for of in (places, boxes))
    return Facts(
        np.repeat(np.arange(1, FRAMES + 1), len(ids)), id, pos, 1.0, np.zeros((rows, 2)),
        np.where(id == hidden, 0.1, 1.0), None, box, None, None, FPS, (np.zeros(0, np.int64), np.zeros((0, 2))),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("others", "words"),
    [
        ({2: (105, 50, 40, 105)}, " by person 2"),
        ({2: (105, 50, 40, 95)}, ""),  # feet further up: behind
        ({2: (150, 50, 40, 105)}, ""),  # beside
        ({2: (130, 50, 40, 105), 3: (110, 60, 40, 100)}, " by person 3"),  # who covers more
    ],
)
def test_who_hides_a_person_stands_before_and_covers_most(others, words: str) -> None:
    boxes = {1: (100, 50, 40, 100), **others}
    of = facts({i: (3.0 * i, 0.0) for i in boxes}, boxes, hidden=1)
    gap = tuple(np.flatnonzero((of.id == 1) & (of.frame >= 5) & (of.frame < 15)).tolist())
    cause = cause_of_person(PersonError("fragment", 5, 14, gap, 1), of)
    assert (cause.name, cause.text) == ("hidden", f"hidden for 1.0 s{words}")


@pytest.mark.parametrize(("distance", "name"), [(0.7, "near"), (0.9, "tracker")])
def test_another_person_is_near_within_80_cm(distance: float, name: str) -> None:
    boxes = dict.fromkeys((1, 2), (100, 50, 40, 100))
    of = facts({1: (0.0, 0.0), 2: (distance, 0.0)}, boxes, hidden=0)
    cause = cause_of_person(PersonError("switch", 10, 10, (), 1), of)
    assert cause.name == name


@pytest.mark.parametrize(("distance", "name"), [(1.8, "tracker"), (2.2, "apart")])
def test_the_middle_frame_says_whether_a_pair_is_apart(distance: float, name: str) -> None:
    boxes = dict.fromkeys((1, 2), (100, 50, 40, 100))
    of = facts({1: (0.0, 0.0), 2: (0.5, 0.0)}, boxes, hidden=0)
    of.pos[(of.id == 2) & (of.frame == 10)] = distance, 0.0
    assert cause_of_group(GroupError("missed group", 5, 15, 1, (1, 2)), of).name == name


@pytest.mark.parametrize(("distance", "name"), [(1.4, "beside"), (1.6, "tracker")])
def test_strangers_are_beside_a_group_within_a_metre_and_a_half(distance: float, name: str) -> None:
    boxes = dict.fromkeys((1, 2, 3), (100, 50, 40, 100))
    of = facts({1: (0.0, 0.0), 2: (0.5, 0.0), 3: (0.5 + distance, 0.0)}, boxes, hidden=0)
    assert cause_of_group(GroupError("strangers joined", 5, 15, 1, (1, 2), (3,)), of).name == name
