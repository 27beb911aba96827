"""`group-pda` as a user drives it: who is hidden, lost and comes back, merges, splits; and all of it from pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from sim.scene.body import person_boxes
from sim.truth.merge_split_rules import SPLIT_VELOCITY
from sim.types import Array, Context, Tracks
from tests.painted import ids
from tests.reference_sense import pinhole
from tests.tracking.papers.group_pda.test_tracker import FPS, GROUND, block, changes, events, noisy, sizes, track
from tracking.papers.group_pda.association import below_heads
from tracking.papers.group_pda.config import GroupPdaConfig


def walk(velocity: tuple[float, float], hidden: range, seed: int = 0, after: Array | None = None) -> list[Array]:
    """A group of four, not seen for a while; after: its velocity once it is seen again, from where it should be."""
    r, v, made = np.random.default_rng(seed), np.array(velocity), []
    place = np.zeros(2)
    for k in range(hidden.stop + 30):
        made.append(noisy([] if k in hidden else [block(2, 2) + place], r))
        place = place + (v if after is None or k < hidden.stop else after) / FPS
    return made


def test_a_hidden_group_goes_straight_on_ever_less_surely() -> None:
    states: list[tuple[Array, Array]] = []
    made = track(
        walk((1.0, 0.3), range(40, 50)), watch=lambda t, _: states.append((t.bank.x[0].copy(), t.bank.P[0].copy()))
    )
    x, P = states[39]
    for k in range(40, 50):
        assert states[k][0] == pytest.approx([*(x[:2] + (k - 39) / FPS * x[2:]), *x[2:]])
        assert (np.diag(states[k][1]) > np.diag(states[k - 1][1])).all()
    assert np.trace(states[49][1]) > 3 * np.trace(P)
    assert ids(made) == {1}
    assert made[50].id.tolist() == [1]
    assert [len(t.id) for t in made[40:50]] == [1] * 5 + [0] * 5  # told for report_coast


@pytest.mark.parametrize("seed", range(3))
def test_a_hidden_group_merges_with_nobody(seed: int) -> None:
    """Another walks beside it, equally fast, while it is hidden: for longer than merge_time near enough to merge."""
    r, made = np.random.default_rng(seed), []
    for k in range(52):
        way, aside = np.array([0.1 * k, 0.0]), 1.95 + 0.03 * abs(k - 45)
        made.append(noisy([block(2, 2, (0, aside)) + way, *([] if k >= 38 else [block(2, 2) + way])], r))
    said = track(made)
    assert said[30].id.tolist() == [1, 2]
    assert not changes(said)


def test_a_leave_tells_where_and_when_it_was_seen_last() -> None:
    made = track([*walk((1.0, 0.3), range(40, 90))[:90]])
    (gone,) = [e for t in made for e in t.events if e.kind == "leave"]
    assert abs(gone.start - 40) <= 1
    assert gone.pos == pytest.approx((3.9, 1.17), abs=0.15)
    assert gone.emitted == 40 + 16  # the first frame more than coast_time later
    assert not len(made[-1].id)


@pytest.mark.parametrize(("hidden", "known"), [(range(40, 54), {1}), (range(40, 55), {1, 2})])
def test_a_group_comes_back_until_coast_time_and_not_a_frame_later(hidden: range, known: set[int]) -> None:
    assert ids(track(walk((0.0, 0.0), hidden))) == known


@pytest.mark.parametrize("observed", [range(100), [*range(16), *range(35, 100)], range(0, 100, 5)])
def test_frames_that_nobody_observed_are_no_evidence(observed: Sequence[int]) -> None:
    """All, none for longer than coast_time, or one in half a second: the group stays, is reported, and splits once."""
    made = track([points if k in observed else None for k, points in enumerate(parting(0, 1.0, 0.8)[0])])
    assert events(made, "enter", "leave", "merge", "split") == [("split", 52, (1,), (1, 2))]
    assert all(len(t.id) for t in made[10:])


def test_only_groups_of_several_people_who_come_later_enter_and_leave() -> None:
    come, r = [block(2, 1, (0, 9)), block(1, 1, (9, 0))], np.random.default_rng(0)
    made = track([noisy([block(2, 2), *come[: 2 * (30 <= k < 60)]], r) for k in range(90)])
    assert made[50].id.tolist() == [1, 2, 3]
    (pair,) = made[50].id[sizes(made[50]).round() == 2].tolist()
    assert events(made, "enter", "leave") == [("enter", 31, (), (pair,)), ("leave", 60, (pair,), ())]


@pytest.mark.parametrize(("fps", "coast"), [(10, 0.0), (10, 0.05), (0.5, 1.5)])
def test_who_is_measured_in_every_frame_is_not_lost(fps: float, coast: float) -> None:
    made = [noisy([block(2, 2)], np.random.default_rng(k)) for k in range(20)]
    said = track(made, GroupPdaConfig(coast_time=coast), context=Context(fps, float("nan")))
    assert ids(said) == {1}
    assert not events(said, "leave")


def joining(seed: int, ranks: tuple[int, int]) -> list[Array]:
    """A group comes to another's side, 1 m between the nearest from frame 31 on, and walks with it."""
    r, made = np.random.default_rng(seed), []
    for k in range(90):
        s = k / FPS
        aside = (sum(ranks) - 2) * 0.3 + 1.0 + max(3 - s, 0)
        made.append(noisy([block(2, ranks[0], (s, 0)), block(2, ranks[1], (s, aside))], r))
    return made


@pytest.mark.parametrize(("ranks", "stays"), [((3, 2), 1), ((2, 3), 2)])
def test_equally_fast_groups_within_reach_merge_once(ranks: tuple[int, int], stays: int) -> None:
    for seed in range(3):
        made = track(joining(seed, ranks))
        assert made[20].id.tolist() == [1, 2]
        ((kind, start, before, after),) = changes(made)
        assert (kind, before, after) == ("merge", (1, 2), (stays,))
        assert start == pytest.approx(31, abs=5)
        assert made[-1].id.tolist() == [stays]
        assert sizes(made[-1]) == pytest.approx([10], abs=0.5)


@pytest.mark.parametrize("seed", range(6))
def test_who_was_missed_before_he_left_has_split_off(seed: int) -> None:
    """At 2.5 frames/s, with the next sight of him 0.8 s later, 1.3 m on."""
    r, frames = np.random.default_rng(seed), []
    for k in range(40):
        away = np.array([[0.9 + 1.6 * max(k - 20, 0) / 2.5, 0.0]])
        frames.append(noisy([block(2, 2), *([] if k == 21 else [away])], r))
    ((kind, _, before, after),) = changes(track(frames, context=replace(GROUND, fps=2.5)))
    assert (kind, before, after) == ("split", (1,), (1, 2))


def parting(seed: int, along: float, apart: float, ranks: int = 1, who: int = 2) -> tuple[list[Array], list[int]]:
    """Of four abreast, so many ranks deep, the right `who` leave from frame 41 on; the first frame in which the nearest
    are 1.5 m apart."""
    r, made = np.random.default_rng(seed), []
    for k in range(100):
        group = block(4, ranks, (0.0, along * k / FPS))
        group[group[:, 0] > 0.3 + 0.6 * (1 - who), 0] += apart * max(k - 40, 0) / FPS
        made.append(noisy([group], r))
    # People 0.6 m apart have split 1.5 m apart, or, who leave slowly, at most 2 m apart.
    ends = (0.9, 0.9 if apart > SPLIT_VELOCITY else 1.4)
    return made, [41 + int(np.ceil(way / apart * FPS)) for way in ends]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("along", "apart"), [(0.0, 0.5), (1.0, 0.5), (1.0, 1.2)])
@pytest.mark.parametrize("who", [1, 2])
def test_a_group_that_falls_into_two_splits_once(seed: int, along: float, apart: float, who: int) -> None:
    frames, due = parting(seed, along, apart, who=who)
    made = track(frames)
    ((kind, start, before, after),) = changes(made)
    assert (kind, before, after) == ("split", (1,), (1, 2))
    assert due[0] - FPS <= start <= due[1] + FPS
    left, right = made[-1].pos[np.argsort(made[-1].pos[:, 0])], sizes(made[-1])
    assert left[:, 0] == pytest.approx([-0.9 + 0.3 * (3 - who), 0.9 - 0.3 * (who - 1) + 5.9 * apart], abs=0.1)
    assert sorted(right) == pytest.approx(sorted([4 - who, who]), abs=0.2)
    if who == 1:
        assert sizes(made[-1])[0] == pytest.approx(3, abs=0.2)  # who stay are most, and keep the id


def test_the_larger_part_keeps_the_id() -> None:
    frames, _ = parting(0, 1.0, 0.8, ranks=2, who=1)
    for turned, x in ((frames, -0.3), ([-p for p in frames], 0.3)):
        last = track(turned)[-1]
        assert last.id.tolist() == [1, 2]
        assert last.pos[0, 0] == pytest.approx(x, abs=0.1)
        assert sizes(last) == pytest.approx([6, 2], abs=0.3)


@pytest.mark.parametrize("gap", [2.0, 2.2])
def test_two_that_stand_beside_each_other_do_not_join_and_part(gap: float) -> None:
    """Twice 16 people; gap: between the nearest, m."""
    for seed in range(2):
        r = np.random.default_rng(seed)
        made = track([noisy([block(4, 4), block(4, 4, (1.8 + gap, 0))], r) for _ in range(200)])
        assert not events(made, "split")
        assert len(events(made, "merge")) <= 1


def one_aside(seed: int, frames: int, back: float = np.inf, hidden: float = np.inf) -> list[Tracks]:
    """Of five, one goes 1.4 m from the others, beyond the search region, and comes back; the others may be hidden."""
    r, made = np.random.default_rng(seed), []
    for k in range(frames):
        aside = 0.8 + 0.6 * np.clip(min(k - 30, back - k) / 10, 0, 1)
        made.append(noisy([block(2, 2)[: 0 if k > hidden else 4], np.array([[0.3 + aside, 0.0]])], r))
    return track(made)


@pytest.mark.parametrize("seed", range(3))
def test_a_member_who_steps_aside_for_a_moment_stays_in_the_group(seed: int) -> None:
    said = one_aside(seed, 90, back=60)
    assert not changes(said)
    assert [sizes(t).tolist() for t in said[-1:]] == [pytest.approx([5], abs=0.5)]


def test_a_hidden_member_does_not_end_a_group_of_two_parts() -> None:
    """The larger part is lost while the other, who has come apart, stays: no leave, and the group keeps its id."""
    said = one_aside(0, 80, hidden=50)
    assert ids(said) == {1}
    assert not events(said, "leave", "split")


def test_hidden_feet_are_no_further_than_below_a_head_at_one_and_a_half_m() -> None:
    box = person_boxes(pinhole(), np.array([[8.0, 4.0, 0.0], [8.0, 5.0, 0.0]]), np.zeros(2), np.full(2, 1.5))
    box[1, 3] *= 0.4
    assert below_heads(np.array([[8, 5.5], [8, 6.5]]), box, pinhole())[:, 1] == pytest.approx([5.5, 5.0], abs=0.05)
