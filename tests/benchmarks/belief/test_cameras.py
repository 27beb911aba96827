"""Boxes with known ids, and what is scored of them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief import cameras
from scenarios.loading.resolve import resolve
from scenarios.schema.sensor import Sensor
from tests import hand_made
from tracking.grouping.grouped_tracks import groups_in_frames
from tracking.scoring.evaluation import evaluate


@pytest.fixture
def seen(monkeypatch, tmp_path):
    monkeypatch.setattr(cameras, "detector", lambda path: Sensor(detect_prob=0.8, clutter_rate=1.0))
    (entry,) = resolve("side-by-side", ["duration=6"])
    return cameras.seen_by(cameras.VIEWS[3], entry, 5, tmp_path)


def test_the_camera_stands_as_the_view_says(seen):
    assert seen.camera.position[2] == pytest.approx(4.0)
    assert seen.image_size == cameras.IMAGE
    assert (seen.truth.truncation <= 0.5).mean() > 0.95


def test_boxes_have_the_ids_of_their_people(seen):
    tracks, truth = cameras.known_boxes(seen), seen.truth
    reported = {(t.index, id) for t in tracks for id in t.id.tolist()}
    people = set(zip(truth.frame.tolist(), truth.id.tolist(), strict=True))
    assert reported < people
    off = [
        np.abs(t.box[:, 0] + t.box[:, 2] / 2 - true[:, 0] - true[:, 2] / 2)
        for t in tracks
        for true in [truth.box[truth.rows(t.index)][np.isin(truth.id[truth.rows(t.index)], t.id)]]
        if np.array_equal(t.id, np.sort(t.id))
    ]
    assert np.median(np.concatenate(off)) < 10  # px


def test_groups_are_scored_at_the_true_places():
    scenes = [hand_made.Scene({1: (0.1 * k, 0.0), 2: (0.1 * k, 0.7), 3: (0.0, 5.0)}, {7: ([1, 2], None)})
              for k in range(30)]  # fmt: skip
    shapes = tuple(groups_in_frames(hand_made.tracks(scenes)))
    truth = hand_made.truth(scenes, groups=shapes)
    away = [t.replace(pos=t.pos + 9.0).keep(np.array([2, 1, 0])) for t in hand_made.tracks(scenes)]
    placed = cameras.at_true_places(truth, away)
    assert [t.id.tolist() for t in placed] == [[1, 2, 3]] * 30
    assert [t.group.tolist() for t in placed] == [[7, 7, -1]] * 30
    assert evaluate(truth, placed)["pairwise_F1"] == 1.0
    assert evaluate(truth, placed)["group_F1_hull"] == 1.0


def test_who_is_missed_limits_the_score():
    scenes = [hand_made.Scene({1: (0.0, 0.0), 2: (0.0, 0.7), 3: (0.0, 5.0)}, {7: ([1, 2, 3], None)})] * 2
    truth, tracks = hand_made.truth(scenes), hand_made.tracks(scenes)
    assert cameras.at_most(truth, tracks) == 1.0
    # 4 of the 6 pairs are left if one of the three is missed in one frame
    fewer = [tracks[0], tracks[1].keep(np.array([0, 1]))]
    assert cameras.at_most(truth, fewer) == pytest.approx(2 * 4 / (6 + 4))
    assert np.isnan(cameras.at_most(truth.replace(group=np.full(6, -1)), tracks))
