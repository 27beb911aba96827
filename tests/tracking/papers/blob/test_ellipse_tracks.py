"""The tracks of `blob` from pixels: directions, sizes that return to the expected ones, boxes round their ellipses."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.camera import camera_rotation
from sim.types import Camera, Context
from tracking.filters import existence, kalman
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.ellipse_tracks import TrackedEllipses
from tracking.papers.blob.tracked_people_kernels import visible_shares

FPS, SCALE = 10.0, 40.0
UP, LEVEL = np.pi / 2, 0.0


def people(*ellipses, **config):
    """Tracks born at these ellipses x, y, h, w, theta."""
    settings, context = BlobConfig(**config), Context(FPS, SCALE, image_size=(320, 240))
    made = TrackedEllipses(settings, settings.dynamics(FPS), context)
    made.widen_view(np.zeros((0, 4)))
    made.start_tracks(np.array(ellipses, float), np.ones(len(ellipses)), 0.0, np.ones(len(ellipses)))
    return made


def test_a_direction_far_off_is_a_distance_and_one_that_is_none_is_not():
    one = people([100, 100, 68, 24, UP])
    z, noise = np.array([[100.0, 100, 68, 24, LEVEL]]), np.tile(one.noise, (1, 1))
    var = np.array([np.radians(10.0) ** 2])
    expected = UP**2 / (one.angle[1, 0] + var[0])
    assert one.direction_distances(z[:, 4], var)[0, 0] == pytest.approx(expected)
    assert one.update(np.array([0]), z, noise, var)[0] == pytest.approx(expected)
    again = people([100, 100, 68, 24, UP])
    assert again.update(np.array([0]), z, noise, np.array([np.inf]))[0] == 0.0
    assert again.angle[0, 0] == UP


def test_looks_stay_with_their_people():
    one = people([100, 100, 68, 24, UP], [150, 100, 68, 24, UP], [200, 100, 68, 24, UP])
    one.look[:, 0, 0] = 1, 2, 3
    one.keep_only(np.array([2, 0]))
    one.start_tracks(np.array([[50.0, 100, 68, 24, UP]]), np.ones(1), 0.0, np.ones(1))
    assert one.look[:, 0, 0].tolist() == [3, 1, 0]


def test_who_comes_later_does_not_stand_in_the_background():
    one, z = people([100, 100, 68, 24, UP]), np.array([[200.0, 100, 68, 24, UP]])
    one.start_tracks(z, np.ones(1), 0.0, np.ones(1), boxed=True)
    assert one.states[:, 1] == pytest.approx([1 - existence.STANDING, existence.STANDING, 0.0])
    for _ in range(3):
        one.predict()
        one.new_people(np.zeros((0, 4)), np.zeros(0, bool))
    one.start_tracks(z, np.ones(1), 0.3, np.ones(1), boxed=True)
    assert one.states[existence.HIDDEN, 2] < existence.STANDING / 5
    assert one.states[:2, 2].sum() == pytest.approx(1.0)


def test_a_detector_sees_who_stands_and_most_who_walk():
    one = people([100, 100, 68, 24, UP])
    one.states[:, 0], one.detector[:], one.standing[:] = (0.5, 0.3, 0.1), 0.6, 0.5
    assert one.seen_by_detector() == pytest.approx([0.5 * 0.6 + 0.15 * 0.6 + 0.15])


@pytest.mark.parametrize(("x", "wide", "share"), [(123, 34, 40 / 68), (100, 16, 52 / 68)])
def test_who_lies_behind_somebody_is_hidden_by_the_boxes_round_the_ellipses(x, wide, share):
    """Of 68 px of his length 28 are behind a wide person beside him, 16 behind a slim one in front."""
    one = people([100, 100, 68, 10, LEVEL], [x, 110, 68, wide, UP])
    shares = visible_shares(one.upright_boxes(), one.scale, one.existence(), one.bank[kalman.VAR])
    assert shares == pytest.approx([share, 1.0], abs=0.02)


def test_who_lies_at_the_edge_leaves_by_his_length():
    one = people([300, 100, 68, 10, LEVEL], [300, 150, 68, 10, UP])
    one.bank[kalman.RATE, :, 0] = 5.0
    one.measured[:] = False
    assert one.rows_to_report().tolist() == [1]


def test_from_straight_above_nobody_is_behind_anybody():
    settings = BlobConfig()
    camera = Camera(
        "top", (320, 240), (20, 20), (160, 120), np.array([0.0, 0, 10]), camera_rotation(UP, 0.0), px_per_m=20.0
    )
    one = TrackedEllipses(settings, settings.dynamics(FPS), Context(FPS, 20.0, camera=camera, image_size=(320, 240)))
    one.start_tracks(np.array([[100.0, 100, 12, 8, UP], [100, 106, 12, 12, UP]]), np.ones(2), 0.0, np.ones(2))
    one.predict()
    assert one.detectable.tolist() == [settings.detect_prob] * 2


def test_axes_return_to_the_expected_ones_with_a_time_constant():
    """After 0.5 s, in five steps, the difference has shrunk to 1 / e; without measurements so has that of variances."""
    one = people([100, 100, 68, 24, UP])
    one.bank[kalman.VAR, 0, 2:] = 9.0
    for _ in range(5):
        one.relax_axes(np.array([0]), np.array([[60.0, 20.0]]), 4.0)
    assert one.bank[kalman.PLACE, 0, 2:] == pytest.approx([60 + 8 / np.e, 20 + 4 / np.e])
    assert one.bank[kalman.VAR, 0, 2:] == pytest.approx(np.full(2, 4 + 5 / np.e**2))
