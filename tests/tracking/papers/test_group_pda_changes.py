"""`group-pda` as a user drives it: who is hidden, lost and comes back, merges, splits; and all of it from pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.types import Array, Tracks
from tests.tracking.papers.test_group_pda import FPS, block, changes, events, ids, noisy, track
from tracking.papers.group_pda import GroupPda
from tracking.papers.group_pda_config import GroupPdaConfig


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


def test_a_hidden_group_merges_with_nobody() -> None:
    """Another walks beside it, equally fast, while it is hidden: the regions overlap for more than merge_time."""
    r, made = np.random.default_rng(0), []
    for k in range(90):
        way, aside = np.array([0.1 * k, 0.0]), 2.2 + 0.04 * abs(k - 45)
        made.append(noisy([block(2, 2, (0, aside)) + way, *([] if 40 <= k < 50 else [block(2, 2) + way])], r))
    said = track(made)
    assert said[30].id.tolist() == said[-1].id.tolist() == [1, 2]
    assert not changes(said)


@pytest.mark.parametrize("seed", range(3))
def test_a_lost_group_takes_its_id_back(seed: int) -> None:
    frames = walk((1.0, 0.3), range(40, 60), seed)
    back = track(frames)
    assert ids(back) == {1}
    assert events(back, "enter", "leave") == [("enter", 1, (), (1,))]
    fresh = track(frames, GroupPdaConfig(recapture=False))
    assert ids(fresh) == {1, 2}
    assert [e[0] for e in events(fresh, "enter", "leave")] == ["enter", "leave", "enter"]


@pytest.mark.parametrize("velocity", [(-1.0, 0.0), (1.0, -1.5)])
def test_who_comes_with_another_velocity_is_somebody_else(velocity: tuple[float, float]) -> None:
    assert ids(track(walk((1.0, 0.3), range(40, 60), after=np.array(velocity)))) == {1, 2}


def test_a_leave_tells_where_and_when_it_was_seen_last() -> None:
    made = track([*walk((1.0, 0.3), range(40, 90))[:90]])
    (gone,) = [e for t in made for e in t.events if e.kind == "leave"]
    assert abs(gone.start - 40) <= 1
    assert gone.pos == pytest.approx((3.9, 1.17), abs=0.15)
    assert gone.emitted == 40 + 31  # the first frame more than recapture_time later
    assert not len(made[-1].id)


def test_a_changed_config_holds_from_the_next_frame_on() -> None:
    def forget(tracker: GroupPda, t: Tracks) -> None:
        if t.index == 43:
            tracker.config = replace(tracker.config, report_coast=0.0)

    made = track(walk((1.0, 0.3), range(40, 50)), watch=forget)
    assert [len(t.id) for t in made[40:51]] == [1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 1]
