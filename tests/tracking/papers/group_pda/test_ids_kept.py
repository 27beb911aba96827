"""Ids kept through an encounter, as benchmarks/group_pda/encounters.py defines it: on scenes written down by hand."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from benchmarks.group_pda.encounters import Encounter, Outcome, encounter_of, encounters, outcomes
from sim.types import GroupEvent, Tracks, Truth
from tests.hand_made import Scene, tracks, truth

LENGTH = 100
NEAR = (40, 61)  # frames in which the hulls of the two that pass are within 1 m
A, B = (1, 2), (3, 4)


def scene(frame: int, still: bool = False, names: dict[int, tuple[int, ...]] | None = None) -> Scene:
    """Two people pass two who stand (still: they stand beside them), 1.8 m apart; 1 m of hull each. names: the
    estimate's groups by id."""
    x = 10.0 if still else 0.2 * (frame - 1) + 0.01
    people = {1: (x, 0.0), 2: (x + 0.6, 0.0), 3: (10.0, 1.8), 4: (10.6, 1.8)}
    return Scene(people, {g: (who, None) for g, who in (names or {1: A, 2: B}).items()})


def true(still: bool = False, **changes: object) -> Truth:
    return truth([scene(f, still) for f in range(1, LENGTH + 1)], **changes)


def said(names: Callable[[int], dict[int, tuple[int, ...]]], still: bool = False, unit: str = "group") -> list[Tracks]:
    scenes = [scene(f, still, names(f)) for f in range(1, LENGTH + 1)]
    return [t for f, t in enumerate(tracks(scenes, unit=unit), 1) if names(f)]


def right(_: int) -> dict[int, tuple[int, ...]]:
    return {7: A, 8: B}


def swapped(frame: int) -> dict[int, tuple[int, ...]]:
    return {7: A, 8: B} if frame < 50 else {8: A, 7: B}


def one_while_near(frame: int) -> dict[int, tuple[int, ...]]:
    return {7: (*A, *B)} if NEAR[0] <= frame <= NEAR[1] else {7: A, 8: B}


def one_to_the_end(frame: int) -> dict[int, tuple[int, ...]]:
    return {7: (*A, *B)} if frame >= NEAR[0] else {7: A, 8: B}


def lost_for(frames: int) -> Callable[[int], dict[int, tuple[int, ...]]]:
    """One is not told for so long after the encounter."""
    return lambda frame: {7: A} if NEAR[1] < frame <= NEAR[1] + frames else {7: A, 8: B}


def test_where_the_encounter_begins_and_ends() -> None:
    e = encounter_of(true(), 1, 2)
    assert (e.first, e.last) == NEAR
    assert e.frames == tuple(range(1, LENGTH + 1))


@pytest.mark.parametrize("unit", ["group", "person"])
@pytest.mark.parametrize(
    ("names", "fate"),
    [
        (right, Outcome(kept=True, merged=False)), (swapped, Outcome(kept=False, merged=False)),
        (one_while_near, Outcome(kept=True, merged=True)), (one_to_the_end, Outcome(kept=False, merged=True)),
        (lost_for(4), Outcome(kept=True, merged=False)), (lost_for(5), Outcome(kept=False, merged=False)),
    ],
)  # fmt: skip
def test_passing(names: Callable[[int], dict[int, tuple[int, ...]]], fate: Outcome, unit: str) -> None:
    assert outcomes(true(), said(names, unit=unit)) == [fate]


def test_crossings_are_what_counts_where_there_are_any() -> None:
    crossing = GroupEvent("cross", 45, 50, None, (1, 2), (1, 2), (1, 2, 3, 4), (0.0, 0.0))
    frames = tuple(range(1, LENGTH + 1))
    assert encounters(true(events=(crossing,))) == [Encounter(1, 2, frames, 45, 50)]


@pytest.mark.parametrize("sides", [((1, 2), (1,)), ((1,), (1, 2))])
def test_groups_that_become_or_were_one_do_not_meet(sides: tuple[tuple[int, ...], tuple[int, ...]]) -> None:
    change = GroupEvent("merge", 90, 95, None, *sides, (1, 2, 3, 4), (0.0, 0.0))
    assert encounters(true(events=(change,))) == []
