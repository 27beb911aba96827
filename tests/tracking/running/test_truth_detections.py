"""Detections made from labels: their order tells nothing, and their arrays lead to no other frame."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Sequence, Tracks
from tracking.running.detection_mode import from_truth, perfect
from tracking.running.prepare import prepare
from tracking.running.run import track
from tracking.scoring import evaluate


@pytest.fixture(scope="module")
def merge() -> Sequence:
    return simulate(load("merge", ["camera.fps=5"]), 40_001)


class RowNumbers:
    """Takes the number of a row for the id of a person."""

    needs = ("boxes", "points")

    def reset(self, context, seed):
        pass

    def step(self, frame, detections):
        n = len(detections.pos)
        alone, cov, unknown = np.full(n, -1), np.tile(np.eye(4), (n, 1, 1)), np.full((n, 2), np.nan)
        plane, pos, box = detections.plane, detections.pos, detections.box
        return Tracks(frame.index, frame.t, plane, "person", np.arange(n), alone, pos, unknown, cov, box)


class RandomNumbers(RowNumbers):
    """Numbers the people of each frame at random: association by chance."""

    def step(self, frame, detections):
        made = super().step(frame, detections)
        return made.replace(id=np.random.default_rng(frame.index).permutation(len(made.id)))


class Writing(RowNumbers):
    """Tries to overwrite everything that it is given and all arrays behind it."""

    def step(self, frame, detections):
        for array in (detections.pos, detections.box, detections.score):
            while array is not None:
                array.flags.writeable = True
                array[...] = -1.0
                array = array.base
        return super().step(frame, detections)


@pytest.mark.parametrize("mode", ["truth", "file"])
def test_the_number_of_a_row_is_worth_no_more_than_chance(merge, mode):
    rows, chance = (evaluate(merge.truth, track(kind, merge, detections=mode)) for kind in (RowNumbers, RandomNumbers))
    assert rows["AssA"] < chance["AssA"] + 0.02
    assert rows["IDF1"] < chance["IDF1"] + 0.02


def test_rows_of_one_group_do_not_stand_together(merge):
    """The mean number of rows between two members of a group is that of a random order, (n + 1) / 3 for n rows."""
    apart, expected = [], []
    for index, found in enumerate(from_truth(merge, {}, 0), 1):
        now = merge.truth.at(index)
        at = [int(np.flatnonzero((now.pos == p).all(1))[0]) for p in found.pos]
        group = now.group[at]
        for g in set(group[group >= 0].tolist()):
            members = np.flatnonzero(group == g)
            apart += [abs(a - b) for k, a in enumerate(members) for b in members[:k]]
            expected += [(len(group) + 1) / 3] * (len(members) * (len(members) - 1) // 2)
    assert np.mean(apart) == pytest.approx(np.mean(expected), rel=0.15)


def test_the_order_depends_on_seed_and_frame_alone(merge):
    first, again, other = (list(from_truth(merge, {}, seed)) for seed in (3, 3, 4))
    assert all(np.array_equal(a.pos, b.pos) for a, b in zip(first, again, strict=True))
    assert not all(np.array_equal(a.pos, b.pos) for a, b in zip(first, other, strict=True))
    for index, found in enumerate(first, 1):
        now = merge.truth.at(index)
        assert sorted(found.pos.tolist()) == sorted(now.pos.tolist())
        assert {(*p, *b) for p, b in zip(found.pos.tolist(), found.box.tolist(), strict=True)} == {
            (*p, *b) for p, b in zip(now.pos.tolist(), now.box.tolist(), strict=True)
        }


@pytest.mark.parametrize("mode", ["truth", "file"])
def test_arrays_lead_to_no_other_frame(merge, mode):
    frames = prepare(RowNumbers, merge, detections=mode).frames_given
    for frame in frames:
        for array in (frame.detections.pos, frame.detections.box, frame.detections.score):
            assert array.base is None
            assert not array.flags.writeable


@pytest.mark.parametrize("mode", ["truth", "file"])
def test_what_a_tracker_writes_reaches_neither_truth_nor_the_next_run(merge, mode):
    before = merge.truth.pos.copy(), merge.truth.box.copy()
    clean = track(RowNumbers, merge, detections=mode)
    track(Writing, merge, detections=mode)
    again = track(RowNumbers, merge, detections=mode)
    assert np.array_equal(merge.truth.pos, before[0])
    assert np.array_equal(merge.truth.box, before[1])
    assert all(np.array_equal(a.pos, b.pos) for a, b in zip(clean, again, strict=True))


def test_settings_with_dots_are_keys_of_a_table(merge):
    """One key of box_noise brings its defaults; without any, boxes are exact."""
    exact, whole, dotted = (
        [d.box for d in from_truth(merge, sensor, 0)]
        for sensor in ({"noise_m": 0.1}, {"box_noise": {"scale": 2.0}}, {"box_noise.scale": 2.0})
    )
    assert all(map(np.array_equal, whole, dotted))
    assert not any(map(np.array_equal, whole, exact))
    for sensor, words in (({"noise_px": 3}, "set box_noise.scale"), ({"noise_m.x": 3}, "sensor.noise_m")):
        with pytest.raises(InputError, match=words):
            from_truth(merge, sensor, 0)


def test_people_without_a_box_are_not_detected(merge):
    """Somebody behind the camera has a position but no box; the other people's rows stay whole."""
    here = merge.truth.at(3)
    box = here.box.copy()
    box[1] = np.nan
    found = perfect(here.replace(box=box))
    rest = np.arange(len(here.id)) != 1
    assert np.array_equal(found.pos, here.pos[rest])
    assert np.array_equal(found.box, here.box[rest])
    assert len(found.score) == rest.sum()
    found = perfect(here.replace(box=box, pos=None, vel=None))
    assert np.array_equal(found.box, here.box[rest])
