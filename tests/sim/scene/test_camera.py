"""Projection: analytic cases, inverses, derivatives, the image scale; the lens: inverses, limits, derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.scene.camera import (
    camera_rotation,
    distort,
    ground_jacobian,
    project,
    px_per_m_at_centre,
    rays,
    scale_of_first_boxes,
    to_ground,
    undistort,
)
from sim.types import Camera
from tests.reference_sense import above, pinhole

BENDS = [0.16, 2.0, 1e-9, -1e-9, -0.05, -0.12]


@given(k=st.floats(-0.3, 5.0), x=st.lists(st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8)), min_size=1))
def test_bending_undoes_straightening(k, x):
    x = np.array(x)
    assert np.abs(distort(undistort(x, k), k) - x).max() < 1e-12


def test_a_barrel_shows_no_more_than_its_edge():
    k = -0.1
    edge = 1 / np.sqrt(-3 * k)
    most = edge * (1 + k * edge**2)
    inside, outside = np.array([[most * (1 - 1e-9), 0.0]]), np.array([[most * 1.001, 0.0]])
    assert distort(inside, k)[0, 0] == pytest.approx(edge, rel=1e-3)
    assert np.isnan(distort(outside, k)).all()


@pytest.mark.parametrize("k", BENDS)
@pytest.mark.parametrize("tilt", [15, 40, 90])
def test_the_ground_comes_back_through_a_bent_lens(k, tilt):
    camera = pinhole(tilt, 20, (8, -4, 6)).replace(radial=k)
    uv = np.random.default_rng(1).uniform([20, 260], [620, 470], (300, 2))
    xy = to_ground(camera, uv, 0.3)
    assert np.isfinite(xy).all()
    back, depth = project(camera, np.column_stack([xy, np.full(300, 0.3)]))
    assert np.abs(back - uv).max() < 1e-8
    origin, direction = rays(camera, uv)
    assert np.abs((origin + depth[:, None] * direction)[:, :2] - xy).max() < 1e-8


def test_axes_are_right_down_forward() -> None:
    camera = pinhole(tilt=0, at=(0, 0, 1))
    uv, depth = project(camera, np.array([[0, 10, 1], [1, 10, 1], [0, 10, 2], [0, -1, 1.0]]))
    assert uv[0] == pytest.approx([320, 240])
    assert uv[1] == pytest.approx([370, 240])  # x is to the right
    assert uv[2] == pytest.approx([320, 190])  # up is towards smaller v
    assert np.isnan(uv[3]).all()  # behind
    assert depth == pytest.approx([10, 10, 10, -1])


def test_positive_tilt_looks_down_and_positive_yaw_left() -> None:
    ahead = np.array([[8.0, 10.0, 7.0]])
    assert project(pinhole(tilt=20), ahead)[0][0, 1] < 240
    assert project(pinhole(tilt=0, yaw=10), ahead)[0][0, 0] > 320
    assert camera_rotation(np.pi / 2, 0.0)[2] == pytest.approx([0, 0, -1])


@pytest.mark.parametrize("camera", [pinhole(), pinhole(70, 30), pinhole(90), above(), above(25)])
def test_ground_comes_back(camera: Camera) -> None:
    xy = np.random.default_rng(1).uniform([2, 2], [14, 9], (200, 2))
    for z in (0.0, 0.8):
        uv, depth = project(camera, np.column_stack([xy, np.full(200, z)]))
        seen = depth > 0
        assert to_ground(camera, uv[seen], z) == pytest.approx(xy[seen], abs=1e-9)
    assert seen.any()


def test_scale_is_a_person_at_the_middle() -> None:
    camera = pinhole()
    foot = np.array([*to_ground(camera, np.array([[320.0, 240.0]]))[0], 0.0])
    uv = project(camera, np.stack([foot, foot + np.array([0, 0, 1.7])]))[0]
    assert px_per_m_at_centre(camera) == pytest.approx((uv[0, 1] - uv[1, 1]) / 1.7)
    assert px_per_m_at_centre(above()) == 40.0
    assert px_per_m_at_centre(pinhole(90)) == pytest.approx(500 / 7)
    assert 0 < px_per_m_at_centre(pinhole(-5)) < 500  # the middle shows sky
    assert 0 < px_per_m_at_centre(pinhole(-30)) < 500  # no ground at all


def test_at_and_above_the_horizon_there_is_no_ground_and_no_warning() -> None:
    level = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    camera = Camera(
        kind="pinhole", image=(160, 120), focal_px=(120.0, 120.0), centre_px=(80.0, 60.0),
        position=np.array([0.0, 0.0, 2.0]), rotation=level,
    )  # fmt: skip
    uv = np.array([[80.0, 30.0], [80.0, 60.0], [80.0, 100.0]])
    assert np.isfinite(to_ground(camera, uv)).all(axis=1).tolist() == [False, False, True]
    J = ground_jacobian(camera, uv)
    assert np.isfinite(J).all(axis=(1, 2)).tolist() == [False, False, True]
    assert J[2, 1, 1] == pytest.approx(-2 * 120 / 40**2), "y = f h / (v - 60)"


@pytest.mark.parametrize("k", [0.0, *BENDS])
def test_the_jacobian_is_the_slope(k):
    camera = pinhole(35, -15).replace(radial=k, focal_px=(480.0, 530.0))
    uv = np.random.default_rng(2).uniform([20, 260], [620, 470], (100, 2))
    step = 1e-4
    slope = [(to_ground(camera, uv + d) - to_ground(camera, uv - d)) / (2 * step) for d in step * np.eye(2)]
    right = np.stack(slope, axis=2)
    assert ground_jacobian(camera, uv) == pytest.approx(right, rel=1e-5, abs=1e-8)


def test_the_frames_that_hold_the_first_boxes_decide():
    frame = np.repeat(np.arange(1, 61), 3)
    height = np.where(frame <= 34, 17.0, 170.0)
    assert scale_of_first_boxes(frame, height) == (pytest.approx(10.0), 34)  # frame of the 100th box
    shuffled = np.random.default_rng(0).permutation(len(frame))
    assert scale_of_first_boxes(frame[shuffled], height[shuffled]) == (pytest.approx(10.0), 34)


def test_few_boxes_all_count_and_unknown_ones_do_not():
    frame = np.array([4, 4, 9, 30])
    assert scale_of_first_boxes(frame, np.array([17.0, np.nan, 34.0, 51.0])) == (pytest.approx(20.0), 30)
    assert scale_of_first_boxes(frame, np.full(4, np.nan)) == (pytest.approx(np.nan, nan_ok=True), 0)
