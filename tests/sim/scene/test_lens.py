import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.scene import lens
from sim.scene.camera import ground_jacobian, project, rays, to_ground
from tests.reference_sense import pinhole

BENDS = [0.16, 2.0, 1e-9, -1e-9, -0.05, -0.12]


@given(k=st.floats(-0.3, 5.0), x=st.lists(st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8)), min_size=1))
def test_bending_undoes_straightening(k, x):
    x = np.array(x)
    assert np.abs(lens.distort(lens.undistort(x, k), k) - x).max() < 1e-12


def test_an_ideal_lens_bends_nothing_and_a_weak_one_little():
    x = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    assert lens.distort(x, 0.0) is x
    assert lens.undistort(x, 0.0) is x
    assert np.abs(lens.distort(x, 1e-12) - x).max() < 1e-11
    assert np.abs(lens.distort(x, -1e-12) - x).max() < 1e-11
    assert np.array_equal(lens.distort(np.zeros((1, 2)), 0.2), np.zeros((1, 2)))


def test_a_barrel_shows_no_more_than_its_edge():
    k = -0.1
    edge = 1 / np.sqrt(-3 * k)
    most = edge * (1 + k * edge**2)
    inside, outside = np.array([[most * (1 - 1e-9), 0.0]]), np.array([[most * 1.001, 0.0]])
    assert lens.distort(inside, k)[0, 0] == pytest.approx(edge, rel=1e-3)
    assert np.isnan(lens.distort(outside, k)).all()


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


@pytest.mark.parametrize("k", [0.0, *BENDS])
def test_the_jacobian_is_the_slope(k):
    camera = pinhole(35, -15).replace(radial=k, focal_px=(480.0, 530.0))
    uv = np.random.default_rng(2).uniform([20, 260], [620, 470], (100, 2))
    step = 1e-4
    slope = [(to_ground(camera, uv + d) - to_ground(camera, uv - d)) / (2 * step) for d in step * np.eye(2)]
    right = np.stack(slope, axis=2)
    assert ground_jacobian(camera, uv) == pytest.approx(right, rel=1e-5, abs=1e-8)


def test_straightening_has_the_slope_it_says():
    x = np.random.default_rng(3).uniform(-1, 1, (20, 2))
    step = 1e-6
    right = np.stack(
        [(lens.undistort(x + d, 0.7) - lens.undistort(x - d, 0.7)) / (2 * step) for d in step * np.eye(2)], 2
    )
    assert lens.undistort_jacobian(x, 0.7) == pytest.approx(right, abs=1e-8)
