"""Features in space: followed by KLT, measured with velocities, only while they are good."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from sim.scene.camera import project, project_pair
from tests.sim.scene.test_camera_stereo import rig
from tracking.detect.features import Features, SpacePoints, slopes

FPS, D = 30.0, 6.0
SPACING, DEVIATIONS = 4.0, (0.3, 0.3, 0.15)
RULES = 0.2, SPACING, DEVIATIONS
TEXTURE = np.random.default_rng(0).uniform(0, 255, (240, 420)).astype(np.float32)


def picture(shift: float) -> np.ndarray:
    """A board with a texture that moves to the right, px."""
    smooth = cv2.GaussianBlur(TEXTURE, (0, 0), 1.5)
    columns = np.repeat((np.arange(320, dtype=np.float32) + 80 - shift)[None], 240, 0)
    rows = np.repeat(np.arange(240, dtype=np.float32)[:, None], 320, 1)
    moved = cv2.remap(smooth, columns, rows, cv2.INTER_CUBIC)
    return np.clip(128 + 3 * (moved - moved.mean()), 0, 255).astype(np.uint8)


def followed(frames: int, lost: int | None = None):
    camera = rig(0.0, baseline=0.5)
    features, found = Features(camera, FPS), []
    disparity = np.full((240, 320), D, np.float32)
    for k in range(frames):
        mask = np.zeros((240, 320), bool)
        mask[60:180, 60 + k : 160 + k] = True
        if k == lost:
            features.forget()
            continue
        found.append(features.step(picture(float(k)), mask, disparity, *RULES))
    return camera, features, found


def test_they_move_with_what_they_lie_on() -> None:
    camera, _, found = followed(15)
    last = found[-1]
    assert len(last) > 30
    depth = camera.focal_px[0] * camera.baseline / D
    speed = FPS * depth / camera.focal_px[0]
    along = last.vel @ camera.rotation.T
    assert np.median(np.abs(along - [speed, 0, 0])) < 0.1
    assert ((last.pos - camera.position) @ camera.rotation[2]) == pytest.approx(depth)


def test_they_are_used_when_they_have_lived_through_the_window() -> None:
    _, _, found = followed(10)
    assert [len(p) > 0 for p in found] == [False] * 6 + [True] * 4
    assert set(found[7].id.tolist()) & set(found[8].id.tolist())


def test_a_lost_picture_ends_them_all() -> None:
    _, features, found = followed(16, lost=8)
    assert len(found[8]) == 0
    assert len(found[-1]) > 0
    assert not set(found[7].id.tolist()) & set(found[-1].id.tolist())
    assert features.next_id > features.id.max()


def test_they_keep_their_distance_and_stay_in_the_mask() -> None:
    _, features, _ = followed(12)
    uv = features.uv
    assert (uv[:, 0] >= 60 + 11).all()
    assert (uv[:, 0] < 160 + 11).all()
    apart = np.linalg.norm(uv[:, None] - uv, axis=2)[np.triu_indices(len(uv), 1)]
    assert (apart < SPACING - 1.5).mean() < 0.01


CAMERA = rig(0.0, baseline=0.5)


def watched(image: np.ndarray, area: tuple[slice, slice], disparity: np.ndarray) -> tuple[Features, SpacePoints]:
    """Features after ten pictures of something in this area that does not move, and what was returned last."""
    features, mask = Features(CAMERA, FPS), np.zeros((240, 320), bool)
    mask[area] = True
    for _ in range(10):
        found = features.step(image, mask, disparity, *RULES)
    return features, found


BOARD = np.s_[60:180, 60:160]


def test_a_point_without_disparity_is_not_returned() -> None:
    disparity = np.full((240, 320), D, np.float32)
    disparity[:, :110] = np.nan
    features, found = watched(picture(0.0), BOARD, disparity)
    assert (features.uv[:, 0] < 105).any()
    u = (found.pos - CAMERA.position) @ CAMERA.rotation.T
    assert (160 + 246 * u[:, 0] / u[:, 2] > 108).all()


def test_the_stated_covariance_of_a_velocity_is_that_of_its_errors() -> None:
    """At 8 m with the paper's camera and 0.25 px: 1.7 m/s along the line of sight, over 10 frames."""
    from sim.scene.camera import back_project, point_covariances, project_pair

    camera, r, n = rig(0.0), np.random.default_rng(1), 3000
    X = (camera.position + 8.0 * camera.rotation[2])[None]
    uvd = np.repeat(project_pair(camera, X)[None], n * 10, 0).reshape(n, 10, 3).copy()
    uvd[..., 2] += 0.25 * r.standard_normal((n, 10))
    world = back_project(camera, uvd.reshape(-1, 3)).reshape(n, 10, 3)
    vel, spread = slopes(world, np.ones((n, 10), bool), np.arange(10) / FPS)
    measured = np.median(np.abs(vel @ camera.rotation[2])) * 1.4826
    cov = point_covariances(camera, X, np.square([1e-9, 1e-9, 0.25]))[0]
    stated = np.sqrt(camera.rotation[2] @ cov @ camera.rotation[2] / spread[0])
    assert stated == pytest.approx(1.8, abs=0.1)
    assert measured == pytest.approx(stated, rel=0.1)


def test_a_feature_lies_in_space_where_the_camera_sees_it() -> None:
    """Pixel (row, column) has its centre at (column + 0.5, row + 0.5); for OpenCV that place is (column, row)."""
    spot = np.array([[150.5, 120.5, D]])
    v, u = np.mgrid[:240, :320] + 0.5
    image = np.rint(255 * np.exp(-((u - spot[0, 0]) ** 2 + (v - spot[0, 1]) ** 2) / 8)).astype(np.uint8)
    _, found = watched(image, np.s_[100:140, 130:170], np.full((240, 320), D, np.float32))
    nearest = np.linalg.norm(project_pair(CAMERA, found.pos) - spot, axis=1).min()
    assert nearest < 0.1


def test_a_disparity_that_is_mostly_noise_is_not_used() -> None:
    sd = DEVIATIONS[2]
    disparity = np.full((240, 320), 3.9 * sd, np.float32)
    disparity[:, :110] = 4.1 * sd
    _, found = watched(picture(0.0), BOARD, disparity)
    assert len(found) > 10
    uv, _ = project(CAMERA, found.pos)
    assert uv[:, 0].max() < 112
