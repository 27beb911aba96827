"""Features of pairs and scores of benchmarks/belonging equal slow twins, and the features never look ahead."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belonging.pair_features import NAMES, Pairs, pair_features
from benchmarks.belonging.people import density, scene_of, sparse
from benchmarks.belonging.sources import of_scenes, sample, source_of
from benchmarks.belonging.transfer import average_precision, f1
from scenarios.loading.resolve import load, resolve
from sim.sequence import simulate
from tests import reference_pair_features as slow

FPS = 2.5


def walk(seed: int, frames: int = 20, people: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns frame, id and position of people some of whom stand, come late, are missed for a while, and go."""
    r = np.random.default_rng(seed)
    speed = r.normal(0, 0.8, (people, 2)) * (np.arange(people) > 1)[:, None]
    pos = r.uniform(0, 6, (people, 2)) + np.cumsum(speed / FPS + r.normal(0, 0.03, (frames, people, 2)), axis=0)
    begin, end = r.integers(0, 6, people), r.integers(12, frames + 1, people)
    there = (np.arange(frames)[:, None] >= begin) & (np.arange(frames)[:, None] < end)
    there &= r.random(there.shape) > 0.1
    frame, column = np.nonzero(there)
    return frame + 1, r.permutation(100)[:people][column], pos[frame, column]


def sorted_rows(frame: np.ndarray, id: np.ndarray, pos: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    order = np.lexsort((id, frame))
    return frame[order], id[order], pos[order]


def as_table(pairs: Pairs) -> dict[tuple[int, int, int], np.ndarray]:
    keys = zip(pairs.frame.tolist(), pairs.a.tolist(), pairs.b.tolist(), strict=True)
    return dict(zip(keys, pairs.features, strict=True))


@pytest.mark.parametrize("seed", range(4))
def test_features_equal_the_slow_twin(seed: int) -> None:
    frame, id, pos = sorted_rows(*walk(seed))
    places: dict[int, dict[int, tuple[float, float]]] = {}
    for t, p, x in zip(frame.tolist(), id.tolist(), pos.tolist(), strict=True):
        places.setdefault(t, {})[p] = tuple(x)
    found, expected = as_table(pair_features(frame, id, pos, FPS)), slow.pair_features(places, FPS)
    assert list(found) == sorted(expected)
    np.testing.assert_allclose(np.array([found[k] for k in found]), np.array([expected[k] for k in found]), atol=1e-9)
    assert np.isfinite(np.array(list(found.values()))).all(axis=0).sum() == len(NAMES) - 5  # velocities may be unknown


def test_features_never_look_ahead() -> None:
    frame, id, pos = sorted_rows(*walk(5))
    whole = as_table(pair_features(frame, id, pos, FPS))
    early = frame <= 12
    part = as_table(pair_features(frame[early], id[early], pos[early], FPS))
    assert len(part) > 50
    for key, features in part.items():
        np.testing.assert_allclose(whole[key], features, atol=1e-12)


def test_nobody_gives_no_pairs() -> None:
    none = np.zeros(0, np.int64)
    assert pair_features(none, none, np.zeros((0, 2)), FPS).features.shape == (0, len(NAMES))


def test_a_scene_is_sampled_and_only_people_in_the_image_count() -> None:
    small = [
        "duration=4",
        "camera={ kind = 'top', crop = true, image = [300, 300], px_per_m = 30, position = [10, 10] }",
    ]
    truth = simulate(load("crowd", small), 1, streams=()).truth
    assert truth is not None
    seen = sample(truth)
    assert (seen.fps, seen.length) == (2.5, 10)
    assert np.abs(seen.pos - 10).max() < 6  # the image shows 10 x 10 m
    assert np.abs(truth.pos - 10).max() > 8
    source = source_of([seen], recording=False)
    label = {(t, p): g for t, p, g in zip(seen.frame.tolist(), seen.id.tolist(), seen.group.tolist(), strict=True)}
    pairs = zip(source.pair_frame.tolist(), source.a.tolist(), source.b.tolist(), strict=True)
    expected = [label[t, a] >= 0 and label[t, a] == label[t, b] for t, a, b in pairs]
    assert source.mates.tolist() == expected
    assert 0 < sum(expected) < len(expected)


def test_weighted_scores_are_those_of_repeated_frames() -> None:
    r = np.random.default_rng(0)
    frame, true, p = r.integers(0, 6, 80), r.random(80) < 0.3, r.integers(0, 9, 80) / 10
    weight = r.integers(0, 3, (3, 6)).astype(float)
    found_f1, found_ap = f1(weight, frame, true, p >= 0.5), average_precision(weight, frame, true, p)
    for w, one, other in zip(weight.astype(int), found_f1, found_ap, strict=True):
        rows = np.repeat(np.arange(80), w[frame])
        y, q = true[rows], p[rows]
        assert one == pytest.approx(2 * (y & (q >= 0.5)).sum() / (y.sum() + (q >= 0.5).sum()))
        steps = [(y[q >= at].sum(), (q >= at).sum()) for at in np.unique(q)[::-1]]
        gains = np.diff([0, *(hits for hits, _ in steps)])
        assert other == pytest.approx(sum(g * h / n for g, (h, n) in zip(gains, steps, strict=True)) / y.sum())


def test_scenes_of_a_source_are_what_they_are_alone() -> None:
    made = [simulate(e.scenario, 1, streams=()).truth for e in resolve("streets") if "quiet" in e.name]
    truths = [sample(truth) for truth in made if truth is not None]
    source = source_of(truths, recording=False)
    kept = of_scenes(source, np.array([2, 0]))
    alone = source_of([truths[2], truths[0]], recording=False)
    for number in (0, 1):
        ours, theirs = scene_of(kept, number), scene_of(alone, number)
        np.testing.assert_array_equal(ours.pos, theirs.pos)
        np.testing.assert_array_equal(ours.party, theirs.party)
        rows, others = kept.pair_scene == number, alone.pair_scene == number
        np.testing.assert_array_equal(kept.features[rows], alone.features[others])
    assert kept.length.tolist() == alone.length.tolist()
    densities = [density(scene_of(source, k)) for k in range(3)]
    assert len(sparse(source, np.median(densities)).length) == 1


def test_streets_have_lone_people_who_stand_at_first_and_at_most_2000_rows_of_a_scene() -> None:
    (entry,) = (e for e in resolve("streets") if e.name == "stop-alone")
    truth = simulate(entry.scenario, 1, streams=()).truth
    assert truth is not None
    source = source_of([sample(truth)], recording=False)
    stand = source.features[:, NAMES.index("speed")] < 0.3
    near = source.features[:, NAMES.index("distance, 0.8 s")] < 1.5
    assert (stand & near & ~source.mates).sum() > (stand & near & source.mates).sum()
    assert source.drawn.sum() == min(2000, len(source.drawn))
