"""The ground that boxes show, against the camera that made them, and how much of the depth counts there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import scenarios
import sim
import tracking
from sim.scene.body import person_boxes
from sim.scene.camera import camera_rotation
from sim.types import Camera, Tracks
from tracking.grouping import foot_points
from tracking.grouping.foot_points import ground_below
from tracking.grouping.ground_of_boxes import Ground, ground_of_boxes
from tracking.grouping.grouped_tracks import without_groups
from tracking.running.run import grouped


@pytest.mark.parametrize(
    ("tilt", "height", "known", "cut"),
    [(15, 6, True, 0), (40, 8, True, 0), (65, 8, True, 0), (90, 20, False, 0), (3, 2.2, True, 0), (25, 6, True, 0.2)],
)
def test_ground_is_that_of_the_camera_or_unknown(tilt: float, height: float, known: bool, cut: float) -> None:
    view, r = camera_rotation(np.radians(tilt), 0.0), np.random.default_rng(30_000)
    camera = Camera("pinhole", (640, 480), (700.0, 700.0), (320.0, 240.0), np.array([0.0, 0.0, height]), view)
    away = height / np.tan(np.radians(max(tilt, 10)))
    feet = np.column_stack([r.uniform(-3, 3, 400), away * r.uniform(0.7, 1.6, 400), np.zeros(400)])
    box = person_boxes(camera, feet, np.zeros(400), r.normal(1.7, 0.08, 400))
    box[:, 3] *= np.where(r.random(400) < cut, r.uniform(0.1, 0.4, 400), 1)
    one = (np.arange(400), np.full(400, -1), box[:, :2], box[:, :2], np.zeros((400, 4, 4)), box)
    tracks, px_per_m = Tracks(1, 0.0, "image", "person", *one), np.median(box[:, 3]) / 1.7
    ground = ground_below([tracks], None, px_per_m)
    found = ground.camera
    assert (ground.source, found is not None) == ("boxes" if known else None, known)
    assert ground_below([tracks.replace(group=one[0])], None, px_per_m) == Ground(), "it names groups"
    sized = ground_of_boxes([tracks], px_per_m, (640, 480)).camera
    if found is not None:
        assert sized is not None
        assert (sized.image, sized.focal_px[0]) == ((640, 480), pytest.approx(704))
        assert [found.position[2] / height, *found.rotation[2]] == pytest.approx([1, *view[2]], abs=0.15)


def test_the_size_of_the_picture_is_the_sequences(monkeypatch) -> None:
    scene = sim.simulate(scenarios.load("cross", set=["camera.fps=5"]), 30_000, streams=())
    bare, sizes = replace(scene, camera=None, scene=None), []
    monkeypatch.setattr(foot_points, "ground_of_boxes", lambda tracks, scale, size: sizes.append(size) or Ground())
    run = tracking.track("blob", bare, detections="file")
    tracking.group(bare, run)
    grouped(without_groups(run), bare)
    assert sizes == 3 * [scene.image_size]


def test_a_ground_that_is_refused_depends_on_its_boxes_too() -> None:
    same = np.tile([500.0, 380.0, 10.0, 20.0], (60, 1))  # far too low for its width where the camera looks up
    rows = (np.arange(60), np.full(60, -1), same[:, :2], same[:, :2], np.zeros((60, 4, 4)), same)
    found = ground_of_boxes([Tracks(k, 0.0, "image", "person", *rows) for k in range(1, 9)], 12.0)
    assert (found.camera, found.frames) == (None, 5)
