"""Scores of groups and of membership on random crowds, equal to slow oracles that loop over everything."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sim.truth.group_hulls import groups_over_time
from sim.types import Groups, Tracks, Truth
from tests import reference_social as reference
from tests.reference_polygons import iou_matrix
from tests.reference_trackeval import trackeval_scores
from tracking.scoring import evaluate

FPS, FRAMES = 10.0, 25


def scene(seed: int, unit: str) -> tuple[Truth, list[Tracks]]:
    """A crowd whose truth changes now and then, and a tracker that errs in places, labels, ids and existence."""
    r = np.random.default_rng(seed)
    people = int(r.integers(4, 9))
    pos, label = r.uniform(0, 4, (people, 2)), r.integers(-1, 3, people)
    rows, tracks, truths = [], [], []
    told = label.copy()
    for index in range(1, FRAMES + 1):
        pos = pos + r.normal(0, 0.15, pos.shape)
        if r.random() < 0.2:
            label = np.where(r.random(people) < 0.3, r.integers(-1, 3, people), label)
        if r.random() < 0.3:
            told = np.where(r.random(people) < 0.6, label, r.integers(-1, 4, people))
        here, seen = np.flatnonzero(r.random(people) < 0.9), np.flatnonzero(r.random(people) < 0.8)
        rows.append((index, here + 1, label[here], pos[here]))
        truths.append(frame_groups(here + 1, label[here], pos[here], np.zeros((len(here), 2))))
        clutter = r.uniform(0, 4, (int(r.integers(0, 3)), 2))
        places = np.concatenate([pos[seen] + r.normal(0, 0.4, (len(seen), 2)), clutter])
        id = np.concatenate([seen + 11, 50 + np.arange(len(clutter))])
        group = np.concatenate([told[seen], r.integers(-1, 4, len(clutter))])
        tracks.append(answer(index, id, group, places, unit))
    frame = np.concatenate([np.full(len(i), f) for f, i, _, _ in rows])
    id, group, places = (np.concatenate([row[k] for row in rows]) for k in (1, 2, 3))
    alone = np.array([np.sum((frame == f) & (group == g)) < 2 for f, g in zip(frame, group, strict=True)])
    truth = Truth(
        "random", FPS, FRAMES, 40.0, frame, id, np.where(alone, -1, group), places, np.zeros_like(places), None,
        np.ones(len(id)), groups=tuple(truths), labelled=np.ones(FRAMES, bool), events=(),
    )  # fmt: skip
    return truth, tracks


def frame_groups(id, group, pos, vel) -> Groups:
    return groups_over_time(np.zeros(len(id), np.int64), id, group, pos, vel, 0, 1)[0]


def answer(index: int, id, group, pos, unit: str) -> Tracks:
    n = len(id)
    groups = frame_groups(id, group, pos, np.zeros((n, 2)))
    if unit == "group":
        none = tuple(np.zeros(0, np.int64) for _ in groups.id)
        groups = Groups(groups.id, none, groups.pos, groups.vel, groups.extent, groups.size * np.nan, groups.hull)
        id = group = groups.id
        pos, n = groups.pos, len(groups.id)
    cov = np.zeros((n, 4, 4))
    return Tracks(index, index / FPS, "ground", unit, id, group, pos, np.zeros((n, 2)), cov, None, np.ones(n), groups)


def both_sides(truth: Truth, tracks: list[Tracks]):
    true, est = [], []
    for t in tracks:
        now = truth.at(t.index)
        places = dict(zip(now.id.tolist(), now.pos, strict=True))
        true.append(reference.groups_of(now.groups, lambda p: p))
        if t.unit == "group":
            est.append(reference.groups_without_people(t.groups, places))
        else:
            name = reference.who_is_who(places, dict(zip(t.id.tolist(), t.pos, strict=True)))
            est.append(reference.groups_of(t.groups, name.get))
    return true, est


@pytest.mark.parametrize("by", ["hull", "members"])
@pytest.mark.parametrize("unit", ["person", "group"])
@pytest.mark.parametrize("seed", range(8))
def test_equal_to_the_oracle(seed: int, unit: str, by: str) -> None:
    truth, tracks = scene(seed, unit)
    true, est = both_sides(truth, tracks)
    found = evaluate(truth, tracks, group_match=by)
    expected = {f"group_{k}": v for k, v in reference.group_scores(true, est, by).items()} | reference.pairwise_scores(
        true, est
    )
    expected |= reference.right_group_scores(true, est, "right_groups", Fraction(2, 3))
    expected |= reference.right_group_scores(true, est, "exact_groups", Fraction(1))
    assert found["group_TP"] > 0
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, abs=1e-7, nan_ok=True), key


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("seed", range(8))
def test_hota_of_groups_is_trackevals(seed: int) -> None:
    truth, tracks = scene(seed, "person")
    true, est = both_sides(truth, tracks)
    similarity = [iou_matrix([g.hull for g in a], [g.hull for g in b]) for a, b in zip(true, est, strict=True)]
    ids = [[np.array([g.id for g in frame], int) for frame in side] for side in (true, est)]
    expected = trackeval_scores(*ids, similarity)
    found = evaluate(truth, tracks)
    for key in ("HOTA", "DetA", "AssA", "DetRe", "DetPr", "AssRe", "AssPr", "LocA"):
        assert found[f"group_{key}"] == pytest.approx(expected[key], abs=1e-9), key


@pytest.mark.parametrize("unit", ["person", "group"])
def test_names_mean_nothing(unit: str) -> None:
    """Other ids on either side, and another order of rows, leave every score as it is."""
    truth, tracks = scene(3, unit)
    r = np.random.default_rng(0)
    other = {k: int(n) for k, n in enumerate(r.permutation(200) + 1000)}

    def renamed(ids):
        return np.array([other[int(k)] if k >= 0 else -1 for k in ids], np.int64)

    changed = []
    for t in tracks:
        order, turn = r.permutation(len(t.id)), r.permutation(len(t.groups.id))
        g = t.groups
        groups = Groups(
            renamed(g.id)[turn], tuple(renamed(g.members[k]) for k in turn), g.pos[turn], g.vel[turn],
            g.extent[turn], g.size[turn], tuple(g.hull[k] for k in turn),
        )  # fmt: skip
        changed.append(
            t.replace(id=renamed(t.id)[order], group=renamed(t.group)[order], pos=t.pos[order], groups=groups)
        )
    for by in ("hull", "members"):
        was, now = (evaluate(truth, tracks_, group_match=by) for tracks_ in (tracks, changed))
        for key, value in was.items():
            assert now[key] == pytest.approx(value, abs=1e-9, nan_ok=True), key
